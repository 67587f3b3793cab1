"""An effect, a generator, an importer, a register map and a transport are each added by one file, and no other."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parents[1]
ROOMS = ("recordings", "simulator", "identification", "detector", "hil")

ADDED = {
    "simulator/effects/force/magnet.py": '''
from simulator.effect import Effect, Parameter, Site

class Magnet(Effect):
    """A steady pull."""
    id = "magnet"
    site = Site.FORCE
    sentence = "a magnet"
    check = "whether the stem is magnetised"
    parameters = (Parameter("G", "N", "pull", scale=50.0, neutral=0.0),)

    def force(self, q, p, s, ds):
        return p["G"]
''',
    "detector/generators/change.py": '''
import numpy as np
from detector.generators.contract import EvaluatedGenerator, Generator

class Change(Generator):
    """The change of each measurement."""
    def __init__(self, outputs):
        self._outputs = outputs

    @property
    def width(self):
        return 0, self._outputs, self._outputs

    def initial(self):
        return np.full(self._outputs, np.nan)

    def _advance(self, state, u, y):
        return y[-1], np.nan_to_num(y - np.vstack([state, y[:-1]]))

EVALUATED = EvaluatedGenerator(
    "change", "changes of the position", lambda run: run["X"][:, None], lambda y: Change(y.shape[1])
)
''',
    "recordings/importers/formats/counts.py": '''
import numpy as np
from recordings.importers.file_format import FileFormat, Match
from recordings.importers.table import ForeignTable

def _match(path, head):
    return Match.CONTENT if head[:6] == b"COUNTS" else Match.NO

def _read(path, layout, texts):
    values = np.frombuffer(path.read_bytes()[8:]).reshape(-1, 2)
    return ForeignTable(str(path), {"time": values[:, 0], "position": values[:, 1]}, {"time": "s", "position": "mm"})

COUNTS = FileFormat("counts", _match, _read)
''',
    "hil/registers/maps/own-map.toml": (HOUSE / "hil/registers/maps/positioner-int16.toml")
    .read_text("utf-8")
    .replace("name = \"positioner-int16\"", "name = \"own-map\""),
    "hil/client/loopback.py": '''
from dataclasses import dataclass
from typing import ClassVar
from hil.client.transport import LiveAddress, timeout_of
from hil.modbus.messages import Reply, ReplyFault

class Loopback:
    """Answers every request itself."""
    async def exchange(self, request):
        return Reply(fault=ReplyFault.SILENCE, text=f"unit {request.unit} was asked")

    def close(self):
        pass

@dataclass(frozen=True)
class LoopbackAddress(LiveAddress):
    scheme: ClassVar[str] = "loopback"
    form: ClassVar[str] = "loopback:"

    @classmethod
    def of(cls, parts):
        return cls(parts.text, timeout=timeout_of(parts))

    def opening(self):
        async def opened(side):
            return Loopback()
        return opened
''',
}  # fmt: skip
"""Files by their place in the house."""

ASKED = """
import asyncio, json, sys
import numpy as np
from simulator import CATALOGUE, kernel, BASE
from detector.evaluation import DETECTORS, BenchmarkRun
from detector.generators import GENERATORS
from recordings.importers import import_file
from hil import RegisterMap, parse_address
from hil.client.link import Link
from hil.modbus.messages import Request

run = BenchmarkRun(np.arange(6.0) * np.arange(200.0)[:, None], None)
open("rig.cnt", "wb").write(b"COUNTS  " + np.array([[0.0, 1.0], [0.1, 2.0], [0.2, 4.0]]).tobytes())

async def asked():
    heard = asyncio.Event()
    link = Link(parse_address("loopback:?timeout=1"), lambda happening, text: heard.set())
    task = asyncio.create_task(link.run())
    await heard.wait()
    reply = await link.exchange(Request(7, 3, 0, 1))
    task.cancel()
    return reply.text

print(json.dumps({
    "effect": [CATALOGUE.ids[-1], kernel((*BASE, "magnet")).parameters[-1]],
    "generator": ["Change" in GENERATORS, DETECTORS["change"].learn(run)(run)[-1].tolist()],
    "importer": import_file("rig.cnt").recording["position"].values.tolist(),
    "map": RegisterMap.load("own-map").name,
    "transport": asyncio.run(asked()),
}))
"""


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """What a house says that has the files of `ADDED` besides its own, linked, files."""
    place = tmp_path_factory.mktemp("house")
    for room in ROOMS:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(HOUSE / room, place / room, copy_function=os.symlink, ignore=ignored)
    for name, text in ADDED.items():
        (place / name).write_text(text, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(place), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", ASKED], cwd=place, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    ("kind", "answer"),
    [
        ("effect", ["magnet", "magnet.G"]),
        ("generator", [True, [4.0]]),
        ("importer", [1e-3, 2e-3, 4e-3]),
        ("map", "own-map"),
        ("transport", "unit 7 was asked"),
    ],
)
def test_one_file_is_all_it_takes(answers, kind, answer):
    assert answers[kind] == (pytest.approx(answer) if kind == "importer" else answer)
