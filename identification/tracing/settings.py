"""The numbers that decide, once, with unit and reason; those that were set on cases are called tuned.

They say which models are fitted and how far, what is accepted and what is named. Numbers that only say how finely
something is computed, or from where a fit starts, stand where they are used.

Gains are falls of the cost (robust loss of the normalised innovations plus log variances), in units of one: a parameter
that explains nothing gains about one by chance. Losses are means over the innovations of the position, 1 for a complete
model. Shares are dimensionless. What the method does with these numbers is told in `algorithm.py`. What a factor of two
on each does is measured by `python -m benchmarks.trace --ablation`.
"""

from __future__ import annotations

from typing import Final

from identification.estimators.noise_aware.linearised_model import PathFreedom

# Descents: how candidates and models are fitted.

PATH_FREEDOM: Final = PathFreedom(1.0, 1e-5, 0.1, 5e-4, honest=False)
"""Freedom of the path in all fits while tracing: they start near their end, and need no more."""
STEPS: Final = 12
"""Steps of a descent at most, of parameters or of paths alone: most settle before. After a third of them starts are
compared: bad ones show by then."""
PATH_STEPS: Final = 2
"""Steps of the paths before the cost of a model and that of a trial of another are compared: memory has to settle."""
REPEATS: Final = 4
"""Descents of one model at most, each from where the last one ended: plays come to rest slowly."""
PROMISE_FACTOR: Final = 4.0
"""How many times as much as the next step promises a descent may still gain, while a shape is not right yet."""
CHUNK_LENGTH: Final = 2.0
"""Length of a chunk [s]: a few strokes."""
CHUNK_DISTANCE: Final = 7.0
"""Distance of the beginnings of two chunks [s]: a good quarter of the recording is enough to compare starts."""

# Data and base model.

HELD_OUT_SHARE: Final = 0.25
"""Share of each recording that is held out when no recording is: enough to judge, little to lose. As much of that
judges nothing either, and gives the errors before and after: what chose an effect makes it look better than it is."""
STIFFNESS_GROWTH: Final = 2.0
"""Bristles may become so many times as stiff with an effect added: what lacks an effect may have softened them, but one
that no node resolves explains anything."""

# Shortlist and refits: which candidates are fitted, and how far.

CANDIDATES: Final = 8
"""Candidates that are fitted to chunks, the best by score; half as many are refitted to whole recordings from chunks.
Where more are fitted to chunks, only these (and what the base model imitates) also start from the base model's own
parameters."""
AT_LEAST: Final = 2
"""Of them, and of starts after their first steps, those that go on however far behind the best: scores are of first
order, and the best after a few steps is not always the best in the end."""
GAIN_SHARE: Final = 0.5
"""Share of the best gain below which a candidate, or another end of the same one, is given up: it will not overtake.
Tuned."""
FAR_SHARE: Final = 0.1
"""The same for scores, and where a fit costs little."""
MAX_STRENGTH: Final = 3.0
"""Strength, in scales from neutral, that a score sets at most: first-order predictions overshoot."""
CHANCE_GAIN: Final = 8.0
"""Gain by chance, at least: a complete model scores as much by noise, and two steps in a row that gain less are the
last of a descent."""

# Judgement on held-out recordings.

LEFT_OUT_BLOCKS: Final = 3
"""Best blocks that are left out when it is asked whether a gain rests on a few places only."""
MIN_GAIN: Final = 60.0
"""Gain on the fitted recordings below which nothing is accepted, whatever its significance. Noise alone would need 25;
the rest are descents that end beside their best. A further fit hardly doubles half of it, so what has not come to that
is given up; and a difference of gains that is smaller does not count. Tuned."""
LEVEL: Final = 0.05
"""Level of tests, one-sided: of chance gains, for all candidates together, and of held-out gains that are above
`MIN_GAIN` as well, for an effect that acts in a few places has few blocks to show itself in."""
STRICT_LEVEL: Final = 0.01
"""Level of other held-out gains, and of the test whether innovations are noise of the size that the recordings have."""
SMALL_SHARE: Final = 0.05
"""Share that is as good as nothing, of a gain or of a loss: gains that differ by less are one class, for no valve has
quite the form of a candidate; where the force is predicted, every block is far from noise, and what explains less is no
effect."""
COMPLETE_LOSS: Final = 1.05
"""Loss of a complete model at most: 1, and what linearisation leaves. Tuned."""

# Forward selection, classes of effects and the verdict.

MAX_EFFECTS: Final = 3
"""Effects that are added at most: several imitate anything."""
EXPLAINED: Final = 0.8
"""Share of the excess loss on the held-out recordings that effects explain at least for one to be named; likewise of
the gain on chunks of an effect that leaves nothing, for another to be refitted beside it. Tuned."""
EXPLAINED_FITTED: Final = 0.5
"""The same on the fitted recordings; on both where the force is predicted from the motion: what a rig's force holds
beside a model hardly comes near its noise, and no free run amplifies it. Tuned."""
MAX_LOSS_ONE: Final = 1.25
"""Held-out loss up to which a single effect is named: a share of much may still be much. Tuned."""
MAX_LOSS_SEVERAL: Final = 1.1
"""The same for several: together they imitate an unknown one, but not down to the noise. Tuned."""

# Null bootstrap: whether as much is gained by chance.

CLEAR_GAIN: Final = 300.0
"""Gain beyond doubt: in the 74 controls of docs/studies/tracing.md, where nothing was missing, refits gained 5 to 30,
and up to 293 on noisy recordings. Tuned."""
CLEAR_GAIN_UNRESOLVED: Final = 2000.0
"""The same where the sampling does not resolve a swing on the bristles: models end beside their best by up to 1000.
Tuned."""
REPLICATES: Final = 3
"""Replicates of the recordings at most that say what a complete model leaves in damped order; fewer where one does."""
NULL_REPLICATES: Final = 6
"""Null replicates at most; fewer where they decide earlier."""
