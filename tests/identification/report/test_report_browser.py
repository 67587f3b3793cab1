"""The report of a fit in a browser: it draws by itself, fetches nothing, zooms, and suits dark and narrow screens."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from _browser import Browser
from report_samples import IDLE, SPIKE, long_run

from identification import Identification

pytestmark = pytest.mark.browser

FITS = ("valve_fit", "rig_fit", "drive_fit", "ramp_fit", "short_fit")
INKED = """
    (() => {
        const canvases = [];
        const look = (node) => {
            for (const child of node.querySelectorAll("*")) {
                if (child instanceof HTMLCanvasElement) canvases.push(child);
                if (child.shadowRoot) look(child.shadowRoot);
            }
        };
        look(document);
        return canvases.filter((c) => {
            if (c.width * c.height === 0) return false;
            return c.getContext("2d").getImageData(0, 0, c.width, c.height).data.some((v, i) => i % 4 === 3 && v > 0);
        }).length;
    })()
"""
"""Number of canvases with something drawn on them."""
MODELS = """
    const models = Bokeh.documents.flatMap(d => d.roots()).flatMap(root => [...root.references()]);
    const figures = models.filter(m => m.type === "Figure");
    const residual = figures.find(f => f.left[0].axis_label.text.startsWith("residual ["));
    const stack = figures.filter(f => f.x_range === residual.x_range);
"""


@pytest.fixture
def opened(browser: Browser, written: Callable[[Identification], Path]):
    """Opens the report of a fit and waits until everything in view is drawn."""
    browser.open("about:blank")
    browser.console(), browser.requests()

    def show(identification: Identification, width: int = 1280, scheme: str = "light") -> Path:
        path = written(identification)
        browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        browser.resize(width, 900)
        browser.open(path)
        browser.wait(IDLE)
        return path

    yield show
    browser.devtools("Emulation.setEmulatedMedia", features=[])


@pytest.mark.parametrize("name", FITS)
def test_every_plot_is_drawn_without_a_network_or_an_error(name, opened, browser, request):
    path = opened(request.getfixturevalue(name))
    browser.run("for (const block of document.querySelectorAll('details')) block.open = true;")
    figures = browser.run(f"{MODELS} return figures.length;")
    assert figures >= 7
    browser.wait(f"{IDLE} && {INKED} >= {figures}")
    assert browser.requests() == [path.as_uri()]
    assert browser.run("return performance.getEntriesByType('resource').map(e => e.name);") == []
    assert browser.console() == []


def test_a_drag_zooms_signal_residual_and_input_together(rig_fit, opened, browser):
    opened(rig_fit)
    ranges = f"{MODELS} return stack.map(f => [f.x_range.start, f.x_range.end]);"
    before = browser.run(ranges)
    assert len(before) == 3
    box = browser.run("""
        const drawing = document.querySelector("#signals .drawn").firstElementChild.firstElementChild;
        drawing.scrollIntoView({block: "center", behavior: "instant"});
        const r = drawing.getBoundingClientRect();
        return [r.left, r.top, r.width];
    """)
    y = box[1] + 180
    for kind, x in (("mousePressed", 0.4), ("mouseMoved", 0.5), ("mouseMoved", 0.6), ("mouseReleased", 0.6)):
        mouse = {"type": kind, "x": box[0] + x * box[2], "y": y + 200 * (x - 0.4), "button": "left", "buttons": 1}
        browser.devtools("Input.dispatchMouseEvent", clickCount=1, **mouse)
    browser.wait(f"(() => {{{MODELS} return stack[0].x_range.end < {0.9 * before[0][1]}; }})()")
    after = browser.run(ranges)
    assert after[0] == after[1] == after[2]
    assert 0.1 < (after[0][1] - after[0][0]) / (before[0][1] - before[0][0]) < 0.35


@pytest.mark.slow
def test_dark_pages_get_light_letters_and_narrow_pages_do_not_overflow(rig_fit, opened, browser):
    seen = {}
    for scheme, width in (("light", 1280), ("dark", 360)):
        opened(rig_fit, width, scheme)
        text = "getComputedStyle(document.body).color"
        seen[scheme] = browser.run(f"{MODELS} return [figures[0].below[0].axis_label_text_color, {text}];")
        assert browser.run("return document.documentElement.scrollWidth;") == width
        assert browser.overlapping() == []
    for scheme, (letters, body) in seen.items():
        assert letters == {"light": "#1c2127", "dark": "#e4e8ec"}[scheme]
        assert body == {"light": "rgb(28, 33, 39)", "dark": "rgb(228, 232, 236)"}[scheme]


@pytest.mark.parametrize("width", [1400, 800, 400])
def test_tables_show_every_column_at_every_width(width, valve_fit, opened, browser):
    opened(valve_fit, width)
    hidden = "[...document.querySelectorAll('.wide')].filter(e => e.scrollWidth > e.clientWidth + 1).length"
    assert browser.run(f"return {hidden};") == 0
    assert browser.overlapping() == []
    badges = "[...document.querySelectorAll('#parameters td .badge')].map(e => e.getBoundingClientRect().right)"
    assert max(browser.run(f"return {badges};")) < width


@pytest.mark.slow
def test_thinning_a_long_recording_keeps_its_extremes_and_its_gap(drive_fit, opened, browser):
    run = long_run(drive_fit.trajectories[0])
    opened(replace(drive_fit, trajectories=(run,)))
    drawn = browser.run(f"""{MODELS}
        const columns = stack[0].renderers[0].data_source.data, y = [...columns.measured];
        return [y.length, Math.max(...y.filter(Number.isFinite)), y.filter(v => !Number.isFinite(v)).length];
    """)
    assert drawn[0] < 80_000
    assert drawn[1] == pytest.approx(1e3 * SPIKE)
    assert drawn[2] == 1


@pytest.mark.slow
def test_printing_a_dark_page_prints_every_recording(valve_fit, opened, browser):
    opened(valve_fit, scheme="dark")
    closed = browser.run("return document.querySelectorAll('details:not([open])').length;")
    assert closed > 0
    assert browser.printed().startswith(b"%PDF")
    assert browser.run("return document.querySelectorAll('details:not([open])').length;") == 0
    assert not browser.run("return document.documentElement.classList.contains('night');")


@pytest.mark.slow
@pytest.mark.parametrize("name", FITS)
def test_every_fit_prints_on_a4_with_nothing_cut(name, written, browser, request):
    assert browser.lost_on_a4(written(request.getfixturevalue(name))) == []
