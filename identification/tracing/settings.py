"""Every number of the method, once, with its unit and its reason.

Gains are falls of the cost (robust loss of the normalised innovations plus log variances), in units of one: a parameter
that explains nothing gains about one by chance. Losses are means over the innovations of the position, 1 for a complete
model. Shares are dimensionless. What the method does with these numbers is told in `algorithm.py`. What a factor of two
on each does is measured by `python -m benchmarks.trace --ablation`. Constants of arithmetic stand where they are used.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from identification.estimators.imposed_motion.grid import BLOCK as IMPOSED_BLOCK
from identification.estimators.noise_aware.linearised_model import PathFreedom

# Descents: how candidates and models are fitted.

PATH_FREEDOM: Final = PathFreedom(1.0, 1e-5, 0.1, 5e-4, honest=False)
"""Freedom of the path in all fits while tracing: they start near their end, and need no more."""
CHUNK_FREEDOM: Final = replace(PATH_FREEDOM, h_max=2e-3)
"""The same for fits to chunks, with longer sub-steps [s]: they only choose where to go on."""
STEPS: Final = 12
"""Steps of a descent at most, of parameters or of paths alone: most settle before."""
FIRST_STEPS: Final = 4
"""Steps after which starts are compared: bad ones show by then."""
PATH_STEPS: Final = 2
"""Steps of the paths before the cost of a model and that of a trial of another are compared: memory has to settle."""
REPEATS: Final = 4
"""Descents of one model at most, each from where the last one ended: plays come to rest slowly."""
IDLE_GAIN: Final = 2.0
"""Gain below which two steps in a row are the last of a descent: it is what noise gives."""
CHUNK_LENGTH: Final = 2.0
"""Length of a chunk [s]: a few strokes."""
CHUNK_DISTANCE: Final = 7.0
"""Distance of the beginnings of two chunks [s]: a good quarter of the recording is enough to compare starts."""

# Data and base model.

HELD_OUT_SHARE: Final = 0.25
"""Share of each recording that is held out when no recording is: enough to judge, little to lose."""
REPORT_SHARE: Final = 0.3
"""Share of what is held out that judges nothing either, and gives the errors before and after: what chose an effect
makes it look better than it is."""
STIFFNESS_GROWTH: Final = 2.0
"""Bristles may become so many times as stiff with an effect added: what lacks an effect may have softened them, but one
that no node resolves explains anything."""
POOR_LOSS: Final = 1.4
"""Loss from which a model lacks so much that its scores are not to be trusted."""

# Screening: the values at which effects are tried.

POSITIONS: Final = (0.15, 0.35, 0.5, 0.65, 0.85)
"""Positions at which local effects are tried, as shares of the travel: neighbours overlap."""
WIDTHS: Final = (0.06, 0.2)
"""Half widths at which they are tried, as shares of the travel: a tight spot, and a good part of the stroke."""
NOISE_MULTIPLES: Final = (4.0, 16.0)
"""Sizes at which a strength is tried that works through memory, in standard deviations of the position noise: below it
nothing shows."""
SCALE_SHARES: Final = (0.1, 0.5)
"""Sizes at which other strengths of that kind are tried, as shares of their scale; the smaller one is also where an
effect starts that can only grow and whose score says that it should shrink."""
MAX_STRENGTH: Final = 3.0
"""Strength, in scales from neutral, that a score sets at most: first-order predictions overshoot."""
PEAKS: Final = 3
"""Frequencies and pitches that are tried, the strongest of the residual force: noise has peaks, too."""
MIN_PERIODS: Final = 1.5
"""Periods of them that the longest recording, or the travel, holds at least: of fewer, they look like a drift or a
spring."""
MAX_FREQUENCY: Final = 40.0
"""Highest frequency that is tried [Hz]: above it a valve hardly moves."""

# Shortlist and refits: which candidates are fitted, and how far.

CANDIDATES: Final = 8
"""Candidates that are fitted in one way, the best by score; half as many are refitted to whole recordings from chunks.
Where all are fitted to chunks, only these (and what the base model imitates) also start from the base model's own
parameters."""
AT_LEAST: Final = 2
"""Of them, and of starts after their first steps, those that go on however far behind the best: scores are of first
order, and the best after a few steps is not always the best in the end."""
GAIN_SHARE: Final = 0.5
"""Share of the best gain below which a candidate, or another end of the same one, is given up: it will not overtake."""
FAR_SHARE: Final = 0.1
"""The same for scores, and where a fit costs little."""
CHANCE_GAIN: Final = 8.0
"""Gain that a candidate has by chance, at least: a complete model scores as much by noise."""

# Judgement on held-out recordings.

BLOCK: Final = IMPOSED_BLOCK
"""Length of the blocks of innovations that are taken for independent [s]: longer than any memory of a valve."""
LEFT_OUT_BLOCKS: Final = 3
"""Best blocks that are left out when it is asked whether a gain rests on a few places only."""
MIN_GAIN: Final = 60.0
"""Gain on the fitted recordings below which nothing is accepted, whatever its significance. Noise alone would need 25;
the rest are descents that end beside their best."""
HALF_GAIN: Final = MIN_GAIN / 2
"""Gain that a further fit hardly doubles, so that what has not come to it is given up; and a difference of gains that
does not count."""
LEVEL: Final = 0.05
"""Level of tests, one-sided: of chance gains, for all candidates together, and of held-out gains that are above
`MIN_GAIN` as well, for an effect that acts in a few places has few blocks to show itself in."""
STRICT_LEVEL: Final = 0.01
"""Level of other held-out gains, and of the test whether innovations are noise of the size that the recordings have."""
LEAST_SHARE: Final = 0.05
"""Share of what is missing that an effect explains at least, where the force is predicted: every block is far from
noise there, and a gain says little."""
COMPLETE_LOSS: Final = 1.05
"""Loss of a complete model at most: 1, and what linearisation leaves."""
MAX_OUTLIERS: Final = 1e-3
"""Share of outliers that a complete model has at most."""

# Forward selection, classes of effects and the verdict.

MAX_EFFECTS: Final = 3
"""Effects that are added at most: several imitate anything."""
ALIKE_SHARE: Final = 0.05
"""Candidates whose gains differ by less than this share are one class, and ends whose parameters do are one end: no
valve has quite the form of a candidate."""
EXPLAINED: Final = 0.8
"""Share of the excess loss on the held-out recordings that effects explain at least for one to be named."""
EXPLAINED_FITTED: Final = 0.5
"""The same on the fitted recordings."""
EXPLAINED_IMPOSED: Final = 0.25
"""Both shares where the force is predicted from the motion: what a rig's force holds beside a model never comes near
its noise, and no free run amplifies it; the rest is reported beside the name."""
MAX_LOSS_ONE: Final = 1.25
"""Held-out loss up to which a single effect is named: a share of much may still be much."""
MAX_LOSS_SEVERAL: Final = 1.1
"""The same for several: together they imitate an unknown one, but not down to the noise."""

# Null bootstrap: whether as much is gained by chance.

CLEAR_GAIN: Final = 300.0
"""Gain beyond doubt: where nothing was missing, effects gained up to 17 in the studies of docs/studies/tracing.md."""
CLEAR_GAIN_UNRESOLVED: Final = 2000.0
"""The same where the sampling does not resolve a swing on the bristles: models end beside their best by up to 1000."""
NULL_REPLICATES: Final = 6
"""Null replicates at most; fewer where they decide earlier."""
