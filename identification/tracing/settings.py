"""Every number of the method, once, with its unit and its reason.

Gains are falls of the cost (robust loss of the normalised innovations plus log variances), in units of one: a parameter
that explains nothing gains about one by chance. Losses are means over the innovations of the position, 1 for a complete
model. Shares are dimensionless. What the method does with these numbers is told in `algorithm.py`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from identification.estimators.noise_aware.linearised_model import PathFreedom

# Descents and paths: how candidates and models are fitted.

PATH_FREEDOM: Final = PathFreedom(1.0, 1e-5, 0.1, 5e-4, honest=False)
"""Freedom of the path in all fits while tracing: they start near their end, and need no more."""
CHUNK_FREEDOM: Final = replace(PATH_FREEDOM, h_max=2e-3)
"""The same for fits to chunks, with longer sub-steps [s]: they only choose where to go on."""
REFIT_STEPS: Final = 12
"""Steps of a refit at most: most settle before."""
IDLE_GAIN: Final = 2.0
"""Gain below which two steps in a row are the last of a fit: it is what noise gives."""
PATH_STEPS: Final = 2
"""Steps of the paths before the cost of a model and that of a trial of another are compared: memory has to settle."""
MEMORY_STEP: Final = 1e-3
"""Longest sub-step [s] while the memory of a new effect is run along a path: finer changes nothing."""
HELD_OUT_STEPS: Final = 10
"""Steps of the paths on the held-out recordings between two looks at their cost."""
HELD_OUT_ROUNDS: Final = 5
"""How often that is done at most: paths of plays take long."""
HELD_OUT_FALL: Final = 30.0
"""Gain of a round of such steps below which the paths have come to rest."""

# Fits to chunks: cheap fits from several starting values.

CHUNK_LENGTH: Final = 2.0
"""Length of a chunk [s]: a few strokes."""
CHUNK_DISTANCE: Final = 7.0
"""Distance of the beginnings of two chunks [s]: a good quarter of the recording is enough to compare starts."""
CHUNK_NODES: Final = 20
"""Nodes of a chunk at least: below, the whole recording is fitted."""
FIRST_STEPS: Final = 4
"""Steps after which the starts are compared: bad ones show by then."""
CHUNK_STEPS: Final = 12
"""Steps of the starts that are continued, the first ones among them."""
STARTS_CONTINUED: Final = 2
"""Starts that are continued: the best after a few steps is not always the best in the end."""
SAME_VALUES: Final = 0.05
"""Relative difference of all parameters of an effect up to which two fits of it ended at the same place."""
END_SHARE: Final = 0.5
"""Share of the best gain on chunks below which another end of the same candidate is given up."""

# Base model.

HELD_OUT_SHARE: Final = 0.25
"""Share of each recording that is held out when no recording is: enough to judge, little to lose."""
REPORT_SHARE: Final = 0.3
"""Share of what is held out that judges nothing either, and gives the errors before and after: what chose an effect
makes it look better than it is."""
MIN_PART_SAMPLES: Final = 10
"""Samples that a part of a divided segment has more than, or it is dropped: its motion cannot be smoothed."""
BASE_WAYS: Final = 4
"""Ways that a base model is searched on chunks: one that lacks an effect fits badly at the end of all of them."""
MASS_BOUND: Final = 5.0
"""A base model is at most so many times as heavy as a regression of the force on the smoothed motion says: what lacks
an effect may have a mass of tons swallow it, and then nothing looks like what is missing."""
STIFFNESS_BOUND: Final = 4.0
"""The same for the stiffness of its bristles, which may become a rigid stem."""
AT_BOUND: Final = 0.99
"""Share of a bound from which a base model presses on it."""
UNBOUNDED_LOSS: Final = 1.4
"""Loss on chunks up to which a base model may do without its bounds: above it, freedom is not all that it lacks."""
STIFFNESS_GROWTH: Final = 2.0
"""Bristles may become so many times as stiff with an effect added: what lacks an effect may have softened them, but one
that no node resolves explains anything."""
NOTABLE_GAIN: Final = 10.0
"""Gain of a refit from which another is worth its time."""
REPEATED_REFITS: Final = 3
"""Refits of a model in a row at most: plays and hysteresis come to rest slowly."""

# Screening: the score test of all effects.

POSITIONS: Final = (0.15, 0.35, 0.5, 0.65, 0.85)
"""Positions at which local effects are tried, as shares of the travel: neighbours overlap."""
WIDTHS: Final = (0.06, 0.2)
"""Half widths at which they are tried, as shares of the travel: a tight spot, and a good part of the stroke."""
NOISE_MULTIPLES: Final = (4.0, 16.0)
"""Sizes at which a strength is tried that works through memory, in standard deviations of the position noise: below it
nothing shows."""
SCALE_SHARES: Final = (0.1, 0.5)
"""Sizes at which other strengths of that kind are tried, as shares of their scale."""
MAX_STRENGTH: Final = 3.0
"""Strength, in scales from neutral, that a score sets at most: first-order predictions overshoot."""
MIN_STRENGTH: Final = 0.05
"""Strength, in scales from neutral, of an effect that can only grow and whose score says that it should shrink."""
VISIBLE: Final = 1e-12
"""Curvature by a coordinate, relative to the largest, below which the recordings do not show it at all."""
SINGULAR: Final = 1e-9
"""Relative singular value below which two parameters are taken for one in a score."""
PEAKS: Final = 3
"""Frequencies and pitches that are tried, the strongest of the residual force: noise has peaks, too."""
MIN_PERIODS: Final = 3.0
"""Periods that the longest recording holds of a frequency at least: of fewer, a drift cannot be told."""
MAX_FREQUENCY: Final = 40.0
"""Highest frequency that is tried [Hz]: above it a valve hardly moves."""
PITCH_BINS: Final = 512
"""Bins along the travel in which the residual force is averaged to find pitches."""
PITCH_PADDING: Final = 4
"""Factor by which their spectrum is interpolated (padding with zeros), to place its peaks."""
MIN_PITCHES: Final = 1.5
"""Pitches along the travel at least: a longer one looks like a spring."""
MAX_PITCHES: Final = 100.0
"""Pitches along the travel at most: five bins each."""
MOVING: Final = 1e-4
"""Speed [m/s] above which the residual force is taken for one of the position: at rest friction holds any force."""

# Shortlist: which candidates are fitted at all.

BASE_PATH_REFITS: Final = 8
"""Candidates that are refitted on the base model's paths, the best by score."""
BASE_PATH_SCORE: Final = 8.0
"""Score that they have at least: a complete model scores as much by noise."""
CHUNK_FITS: Final = 8
"""Candidates that are fitted to chunks, the best by score. Where all are, only these (and what the base model imitates)
also start from the base model's own parameters."""
ALWAYS_FITTED: Final = 2
"""Of them, those that are fitted however far behind the best: scores are of first order."""
MIN_SCORE: Final = 30.0
"""Score that they have at least."""
SCORE_SHARE: Final = 0.1
"""Share of the best score that they have at least."""
UNTRUSTED_LOSS: Final = 1.4
"""Loss of a model from which its scores are not to be trusted, and all candidates are fitted to chunks."""

# Refits: which candidates are fitted to whole recordings, and for how long.

REFITS: Final = 4
"""Candidates on chunks that are refitted to whole recordings at most, the best by gain."""
REFITS_IMPOSED: Final = 8
"""The same where the force is predicted from the motion, which costs little."""
GAIN_SHARE: Final = 0.5
"""Share of the best gain below which a candidate is given up: it will not overtake."""
GAIN_SHARE_IMPOSED: Final = 0.2
"""The same where the force is predicted from the motion."""
CHUNK_GAIN_SHARE: Final = 0.5
"""Share of `MIN_GAIN`, for as much of the recordings as the chunks are, that a candidate gains on them at least."""
HOPELESS_GAIN: Final = 30.0
"""Gain, with what the next step promises, below which a refit on the base model's paths is given up: it never comes to
twice as much."""
PROMISE_FACTOR: Final = 4.0
"""How many times as much as the next step promises such a refit may still gain, while a shape is not right yet."""
SLOW_SHARE: Final = 0.02
"""Share of the gain of a candidate that explains all, below which two steps of another are its last."""

# Judgement on held-out recordings.

BLOCK: Final = 1.0
"""Length of the blocks of innovations that are taken for independent [s]: longer than any memory of a valve."""
LEFT_OUT_BLOCKS: Final = 3
"""Best blocks that are left out when it is asked whether a gain rests on a few places only."""
MIN_GAIN: Final = 60.0
"""Gain on the fitted recordings below which nothing is accepted, whatever its significance. Noise alone would need 25;
the rest are descents that end beside their best."""
LEVEL: Final = 5e-3
"""Level of the held-out test over blocks, one-sided."""
LENIENT_LEVEL: Final = 0.05
"""The same where the held-out gain is above `MIN_GAIN` as well: an effect that acts in a few places has few blocks to
show itself in; and for gains above `CLEAR_GAIN` that are not gained by chance."""
IMPOSED_SHARE: Final = 0.05
"""Share of the excess loss that an effect explains at least, fitted and held out, where the force is predicted: every
block is far from noise there, and a gain says little."""
COMPLETE_LOSS: Final = 1.05
"""Loss of a complete model at most: 1, and what linearisation leaves."""
LOSS_SPREAD: Final = 1.264
"""Standard deviation of Cauchy's loss of one unit normal innovation, in means of it."""
MAX_OUTLIERS: Final = 1e-3
"""Share of outliers that a complete model has at most."""
WHITE_LEVEL: Final = 0.01
"""Level of the test whether innovations are noise of the size that the recordings have."""

# Forward selection, classes of effects and the verdict.

MAX_EFFECTS: Final = 3
"""Effects that are added at most: several imitate anything."""
ALIKE_SHARE: Final = 0.05
"""Candidates whose gains differ by less than this share are one class: no valve has quite the form of a candidate."""
ALIKE_T: Final = 2.0
"""Student's t below which two candidates explain the held-out data alike."""
ALIKE_GAIN: Final = MIN_GAIN / 3
"""Difference of their gains on the fitted recordings below which they are one class then."""
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
NULL_LEVEL: Final = 0.05
"""Level of the test, for all candidates of the catalogue together."""
NULL_GAIN: Final = 5.0
"""Gain of a null replicate at least: about what refitted candidates gain where nothing is missing."""
NULL_SEED: Final = 0
"""Seed of the noise, so that a trace gives the same answer every time."""

# Description of the residual.

RESIDUAL_BINS: Final = 12
"""Bins, equally filled, over which the residual is compared: enough to tell a place."""
AT_REST: Final = 0.01
"""Speed below which a valve rests, as a share of its root mean square speed."""

# Cross-check by sparse regression.

CROSSCHECK_SHARE: Final = 0.05
"""Share of the residual force below which sparse regression chooses nothing."""
SLIDING_DISTANCES: Final = (1.0, 0.3)
"""Break-away distances that the valve slides within a window: the first with enough windows."""
MIN_WINDOWS: Final = 100
"""Windows in which the valve slides at least: of fewer, nothing is said."""
MIN_APART: Final = 1e-4
"""Share of a force that is not one of the base model's own, from which it is offered."""
SAME_FORCE: Final = 0.999
"""Correlation of two forces from which only one is offered."""
SINGULAR_FORCE: Final = 1e-6
"""Relative singular value below which two forces of an effect are taken for one."""
