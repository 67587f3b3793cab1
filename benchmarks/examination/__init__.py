"""A blind examination of every release: cases nobody has seen, drawn by a seed, run once, scored into the house.

`plant` is a second valve with an integrator, laws and ranges of its own, behind a closed-loop positioner; `draws` makes
cases of a seed; `subjects` examines them; `score` counts; `python -m benchmarks.examination` runs and writes.
"""
