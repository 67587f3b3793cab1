"""The work by `bristle fit`, without guesses."""

import numpy as np

import bristle as br
from benchmarks.peers.work import Work, scored


def solve(work: Work) -> tuple[np.ndarray, str]:
    found = br.fit(work.recordings[0], crosscheck=False)
    return np.array(list(found.values.values())), f"converged: {found.converged}; intervals and statuses"


if __name__ == "__main__":
    scored("bristle fit, no guesses", solve)
