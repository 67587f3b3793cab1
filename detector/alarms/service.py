"""Learning that goes on in service: limits come down as fault-free time grows, and a slow fault is not learned away.

A period of an hour is trusted when it and the next one have passed without an alarm; an alarm drops both. Limits move
when a day of such periods is there, however long was learned before, for a part of a day does not show its rhythm; the
promise moves when that time and the learned one make a day. Limits are never above those of the first learning, centre
and size stay where they were, and after seven trusted days it ends.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detector.alarms.evidence import N_BINS, N_RUNNING, N_SCALES, N_STATISTICS, STEP, advance_all, closes
from detector.alarms.healthy import LEAST_BLOCKS, Healthy, limits_of, share_bound
from detector.alarms.promise import DAY_S, Promise
from recordings import Array, BadInput

PERIOD_S = 3600.0
MOST_S = 7 * DAY_S


@dataclass(frozen=True)
class EvidenceState:
    """What is remembered of n_channels residuals, as arrays with the channels first.

    running (n_channels, N_RUNNING); limits, shares (n_channels, N_SCALES, N_STATISTICS) : in use now; counts : three
    arrays (n_channels, N_SCALES, N_STATISTICS, N_BINS + 1), histograms of this period, the one that waits, and the
    trusted ones; samples : of this period; waits : whether one waits; alarmed : whether there was an alarm in this
    period; trusted_s : fault-free time, with that of learning [s].
    """

    running: Array
    limits: Array
    shares: Array
    counts: tuple[Array, Array, Array]
    samples: int
    waits: bool
    alarmed: bool
    trusted_s: float

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for JSON."""
        arrays: dict[str, Any] = {name: getattr(self, name).tolist() for name in ("running", "limits", "shares")}
        arrays["counts"] = [one.tolist() for one in self.counts]
        return arrays | {name: getattr(self, name) for name in ("samples", "waits", "alarmed", "trusted_s")}

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> EvidenceState:
        """What `as_dict` gave."""
        arrays = [np.array(parts[name], float) for name in ("running", "limits", "shares", "counts")]
        n = len(arrays[0])
        grid = (N_SCALES, N_STATISTICS)
        shapes = [(n, N_RUNNING), (n, *grid), (n, *grid), (3, n, *grid, N_BINS + 1)]
        if [array.shape for array in arrays] != shapes:
            raise BadInput("state of the detector", "it belongs to another detector", "learn anew")
        numbers = int(parts["samples"]), bool(parts["waits"]), bool(parts["alarmed"]), float(parts["trusted_s"])
        running, limits, shares, (current, waiting, trusted) = arrays
        return cls(running, limits, shares, (current, waiting, trusted), *numbers)


@dataclass(frozen=True)
class Evidence:
    """Residuals of a valve under one promise. healthy : each as it was learned; names : of them; shares : how the
    allowed rate is divided, one in all; notes : what of them cannot be judged, or not yet; learns : whether learning
    goes on in service.
    """

    healthy: tuple[Healthy, ...]
    names: tuple[str, ...]
    shares: tuple[float, ...]
    promise: Promise
    notes: tuple[str, ...] = ()
    learns: bool = True

    @property
    def dt_s(self) -> float:
        """Sampling time [s]."""
        return self.healthy[0].dt_s

    @cached_property
    def _edges(self) -> Array:
        """Lowest edges of the histograms (n_channels, n_scales, n_statistics)."""
        return np.array([one.edges for one in self.healthy])

    @cached_property
    def _numbers(self) -> Array:
        """A row of `ResidualNumbers` for each channel."""
        return np.array([one.numbers(share) for one, share in zip(self.healthy, self.shares, strict=True)], float)

    def initial(self) -> EvidenceState:
        """No evidence, and nothing but what was learned."""
        n = len(self.healthy)
        current, waiting, trusted = np.zeros((3, n, N_SCALES, N_STATISTICS, N_BINS + 1))
        limits, shares = (np.array([getattr(one, name) for one in self.healthy]) for name in ("limits", "shares"))
        return EvidenceState(
            np.zeros((n, N_RUNNING)), limits, shares, (current, waiting, trusted), 0, False, False, self.promise.seconds
        )

    def run(self, state: EvidenceState, residuals: Array) -> tuple[EvidenceState, Array]:
        """Many samples (n_samples, n_channels), NaN where there is none; the evidence after each, (n_samples,
        n_channels), as shares of the limit. An alarm is one at least, of any. Pieces give the same as the whole.
        """
        load, first = np.empty(residuals.shape), 0
        while first < len(residuals):
            left = max(round(PERIOD_S / self.dt_s), 1) - state.samples if self.learns else len(residuals)
            part = slice(first, min(first + left, len(residuals)))
            state = self._part(state, residuals[part], load[part])
            first = part.stop
        return state, load

    def scores(self, state: EvidenceState, load: Array) -> Array:
        """Evidence on a scale of its logarithm, as residuals have it: nothing at 0, an alarm at 1."""
        limit_s = self.supported(state).interval_s
        return np.asarray(np.log1p(load * limit_s) / np.log1p(limit_s))

    def supported(self, state: EvidenceState) -> Promise:
        """What is promised by now: from the first trusted day on more than at the start."""
        return self.promise.after(state.trusted_s) if state.trusted_s >= DAY_S else self.promise

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        rows = {name: list(getattr(self, name)) for name in ("names", "shares", "notes")}
        healthy = [one.as_dict() for one in self.healthy]
        return {"healthy": healthy, "promise": self.promise.as_dict(), "learns": self.learns} | rows

    @classmethod
    def from_dict(cls, parts: Mapping[str, Any]) -> Evidence:
        """What `as_dict` gave."""
        healthy = tuple(Healthy.from_dict(one) for one in parts["healthy"])
        names, shares, notes = (tuple(parts[name]) for name in ("names", "shares", "notes"))
        return cls(healthy, names, shares, Promise.from_dict(parts["promise"]), notes, parts["learns"])

    def _part(self, state: EvidenceState, residuals: Array, load: Array) -> EvidenceState:
        """Samples of one period."""
        running, current = state.running.copy(), state.counts[0]
        if closes(running, self._numbers, len(residuals)):  # else they stay, and they are most of the state
            current = current.copy()
        found = np.empty((len(self.healthy), len(residuals)))
        advance_all(
            running, state.limits, state.shares, current, self._edges, self._numbers,
            self.supported(state).interval_s, np.ascontiguousarray(residuals.T), found,
        )  # fmt: skip
        load[:] = found.T
        samples = state.samples + (len(residuals) if self.learns else 0)
        alarmed = state.alarmed or bool((load >= 1.0).any())
        after = EvidenceState(
            running,
            state.limits,
            state.shares,
            (current, *state.counts[1:]),
            samples,
            state.waits,
            alarmed,
            state.trusted_s,
        )
        return self._turned(after) if samples >= round(PERIOD_S / self.dt_s) else after

    def _turned(self, state: EvidenceState) -> EvidenceState:
        """The end of a period."""
        (current, waiting, trusted), trusted_s = state.counts, state.trusted_s
        limits, shares, none = state.limits, state.shares, np.zeros_like(current)
        if state.alarmed:
            waiting = none
        else:
            if state.waits and trusted_s < MOST_S:
                trusted = trusted + waiting
                trusted_s += PERIOD_S
                counted_s = PERIOD_S * round((trusted_s - self.promise.seconds) / PERIOD_S)
                if counted_s >= DAY_S:
                    tightened = [self._tightened(i, trusted[i], counted_s) for i in range(len(self.healthy))]
                    limits, shares = (np.array(rows) for rows in zip(*tightened, strict=True))
            waiting = current
        counts = none, waiting, trusted
        return EvidenceState(state.running, limits, shares, counts, 0, not state.alarmed, False, trusted_s)

    def _tightened(self, i: int, counts: Array, counted_s: float) -> tuple[Array, Array]:
        """Limits and shares of a channel by the blocks of so many trusted seconds in service."""
        healthy = self.healthy[i]
        n = counts[..., N_BINS]
        beyond = counts[..., :N_BINS] / np.maximum(n, 1.0)[..., None]
        quantiles = np.array([_quantile(beyond, healthy.edges, level) for level in (0.5, 0.9, 0.999)])
        wanted = limits_of(quantiles, n, counted_s, healthy)
        places = np.clip(np.ceil(np.log(wanted / healthy.edges) / np.log(STEP) - 1e-9), 0, N_BINS - 1).astype(np.int64)
        bad = np.take_along_axis(counts, places[..., None], axis=-1)[..., 0]
        known = n >= LEAST_BLOCKS
        limits = np.where(known, healthy.edges * STEP**places, healthy.limits)
        return limits, np.where(known, share_bound(bad, n), healthy.shares)


def _quantile(beyond: Array, edges: Array, level: float) -> Array:
    """Where a share of 1 - level is beyond, by the logarithm between edges. beyond (n_scales, n_statistics, n_bins)."""
    over: NDArray[np.int64] = np.sum(beyond > 1.0 - level, axis=-1)
    upper = np.clip(over, 0, N_BINS - 1)
    lower = np.maximum(upper - 1, 0)
    at_upper, at_lower = (np.take_along_axis(beyond, one[..., None], axis=-1)[..., 0] for one in (upper, lower))
    way = np.clip((at_lower - (1.0 - level)) / np.maximum(at_lower - at_upper, 1e-12), 0.0, 1.0)
    return np.asarray(edges * STEP ** (lower + (upper - lower) * way))
