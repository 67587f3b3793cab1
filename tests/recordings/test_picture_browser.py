"""The picture of a recording in a browser: it draws by itself and fetches nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from _browser import Browser, is_this_machine
from recording_samples import contract_file

from recordings import picture, save_text

pytestmark = pytest.mark.browser

DRAWN = """
    (() => {
        const idle = Bokeh.documents.length > 0 && Bokeh.documents.every((document) => document.is_idle);
        const canvases = [];
        const look = (node) => {
            for (const child of node.querySelectorAll("*")) {
                if (child instanceof HTMLCanvasElement && child.width > 0) canvases.push(child);
                if (child.shadowRoot) look(child.shadowRoot);
            }
        };
        look(document);
        return idle && canvases.length >= 4;
    })()
"""


def test_the_picture_draws_and_fetches_nothing(browser: Browser, tmp_path: Path) -> None:
    save_text(tmp_path / "rec.html", picture(contract_file(tmp_path / "rec.h5")))
    browser.open("about:blank")
    browser.console(), browser.requests()
    browser.open(tmp_path / "rec.html")
    browser.wait(DRAWN)  # position, force, gland_colour, and the loop
    assert [line for line in browser.console() if line.startswith("SEVERE")] == []
    assert [address for address in browser.requests() if not is_this_machine(address)] == []
    labels = browser.run(
        "const models = [...Bokeh.documents[0].roots()[0].references()];"
        "return models.filter((model) => model.type === 'Figure').map((figure) => figure.left[0].axis_label)"
        ".map((label) => typeof label === 'string' ? label : label.text)"
    )
    assert sorted(labels) == ["force [N]", "force [N]", "gland_colour [furlong]", "position [mm]"]
