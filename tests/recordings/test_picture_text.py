"""Texts of a file are text on its page: neither mathematics nor markup is made of them."""

from __future__ import annotations

import json
import re

import numpy as np

from recordings import Recording, Signal, picture, write

TRAP = "$$\\href{javascript:alert(1)}{x}$$"


def test_no_text_of_a_file_is_read_as_mathematics(tmp_path):
    path = tmp_path / "trap.h5"
    time = Signal("time", np.arange(8.0), "s", "time")
    names = [TRAP, "position", "force"]
    signals = [Signal(name, np.arange(8.0), "m" if name == "position" else "N", "extra") for name in names]
    write(path, Recording.of([time, *signals], title=TRAP))
    page = picture(path)
    (docs,) = re.findall(r'<script type="application/json"[^>]*>\s*(.*?)\s*</script>', page, re.DOTALL)
    models = list(objects(json.loads(docs)))
    words = [one for one in models if one.get("name") == "Div"]
    assert words
    assert all(one["attributes"]["disable_math"] is True for one in words)
    labels = [one["attributes"]["axis_label"] for one in models if "axis_label" in one.get("attributes", {})]
    written = [label for label in labels if label != "time [s]"]
    assert written
    assert all(isinstance(label, dict) and label["name"] == "PlainText" for label in written)


def objects(part):
    """Every model of a bokeh document."""
    inside = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    if isinstance(part, dict) and part.get("type") == "object":
        yield part
    for one in inside:
        yield from objects(one)
