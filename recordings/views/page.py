"""A recording as one self-contained HTML page: what is in it, in words and as pictures."""

from __future__ import annotations

import html
from pathlib import Path

from recordings.hdf5.reader import read
from recordings.views.description import describe
from recordings.views.pictures import plots


def picture(path: str | Path) -> str:
    """The page of a recording, with everything inside that a browser needs; `BadInput` when it is not valid."""
    from bokeh.embed import file_html
    from bokeh.layouts import column
    from bokeh.models import Div
    from bokeh.resources import INLINE

    recording = read(path)
    words = Div(text=f"<pre>{html.escape(describe(path))}</pre>", disable_math=True)
    title = recording.title or Path(path).name
    return file_html(column(words, *plots(recording), sizing_mode="stretch_width"), INLINE, title=title)
