"""The work of `bristle fit` by what one would use instead: one script each, on one recording, scored in one way.

    python -m benchmarks.peers.by_bristle       and by_scipy, by_lmfit, by_shooting, by_pysindy, by_pypesto

Each prints a row of docs/studies/peers.md.
"""
