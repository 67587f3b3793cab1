"""Valves written a second time, from the physics, with effects of their own: the truth of `benchmarks.trace`.

`integration` states and integrates the equations, `physics` has their numbers, `effects` says which of them make which
effect, `strengths` how strong each is, and `cases` and `recordings` make experiments of them.
"""
