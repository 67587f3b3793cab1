"""What a refit has to show on recordings that were held out."""

from __future__ import annotations

from dataclasses import replace

import pytest
from stiff_models import model_of
from stiff_valves import STIFF

from identification.tracing import judge as judging
from identification.tracing.judge import Candidate, judge
from identification.tracing.models.comparison import Comparison
from identification.tracing.refine import CandidateFit
from identification.tracing.screen import Score
from identification.tracing.settings import CLEAR_GAIN

WEAK = Comparison(gain=40.0, t=1.5, p_value=0.07, gain_elsewhere=5.0)
"""A held-out gain that rests on a few slips."""
MUCH, LITTLE = 1.1 * CLEAR_GAIN, 0.9 * CLEAR_GAIN


def judged(monkeypatch: pytest.MonkeyPatch, gain: float, held_out: Comparison, *, white: bool) -> Candidate:
    """A refit judged by what it gains, fitted and held out. white : whether it leaves nothing."""
    model = model_of(STIFF)
    answers = iter([replace(held_out, gain=gain), held_out])
    monkeypatch.setattr(judging, "compare", lambda *_: next(answers))
    monkeypatch.setattr(judging, "is_white", lambda _: white)
    return judge(model, CandidateFit(Score("backlash", gain, {}), (), gain, model))


def test_what_leaves_nothing_has_to_agree_with_held_out_data_if_chance_gains_less(monkeypatch):
    found = judged(monkeypatch, MUCH, WEAK, white=True)
    assert found.accepted
    assert found.doubtful
    assert found.why == "agrees with held-out data (t = 1.5)"


@pytest.mark.parametrize(
    ("gain", "held_out", "white"),
    [
        pytest.param(MUCH, WEAK, False, id="something is left"),
        pytest.param(MUCH, replace(WEAK, gain=-1.0, t=-0.1, p_value=0.5), True, id="held-out data disagree"),
        pytest.param(LITTLE, WEAK, True, id="it gains little"),
    ],
)
def test_what_rests_on_a_few_slips_is_rejected_otherwise(monkeypatch, gain, held_out, white):
    found = judged(monkeypatch, gain, held_out, white=white)
    assert not found.accepted
    assert "does not explain held-out data" in found.why
