"""The bundled recordings are what their script makes, and small."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import bundled, bundled_names, bundled_path, read_truth
from tools import bundled_recordings

NAMES = sorted(bundled_recordings.EXPERIMENTS)


def test_every_one_has_its_entry_in_the_script():
    assert list(bundled_names()) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_making_it_again_gives_what_is_shipped(name):
    recording, truth = bundled_recordings.make(name)
    shipped, path = bundled(name), bundled_path(name)
    assert set(shipped) == set(recording)
    for signal in recording:
        again, there = recording[signal], shipped[signal]
        assert there.spec == again.spec
        scale = np.ptp(again.values)
        assert np.max(np.abs(there.values - again.values)) < 1e-9 * scale, signal
    assert shipped.plant == recording.plant
    assert shipped.title == recording.title
    assert shipped.source == "simulated"
    assert {k: v for k, v in read_truth(path).items() if isinstance(v, float | str)} == truth


def test_together_they_are_small():
    assert sum(bundled_path(name).stat().st_size for name in NAMES) < 2_000_000


def test_the_script_writes_them_where_the_package_looks(monkeypatch, capsys):
    written = []
    monkeypatch.setattr(bundled_recordings, "write", lambda path, recording, truth: written.append(path))
    bundled_recordings.main()
    assert sorted(path.name for path in written) == [f"{name}.h5" for name in NAMES]
    assert {path.parent for path in written} == {bundled_path(NAMES[0]).parent}
    assert len(capsys.readouterr().out.splitlines()) == len(NAMES)
