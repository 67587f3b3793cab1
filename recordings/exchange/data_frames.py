"""Data frames of pandas that hold all of a recording."""

from __future__ import annotations

from typing import Any

from recordings.errors import not_installed
from recordings.exchange.table_form import WholeTable

ABOUT = "bristle_recording"
"""Under which name the text about a recording stands: in ``frame.attrs``, in a Parquet file, in a MATLAB file."""


def frame_of(table: WholeTable) -> Any:
    """A pandas DataFrame of a table, the text in its ``attrs``. Raises BadInput where pandas is not installed."""
    try:
        import pandas
    except ImportError:
        raise not_installed("to_dataframe", "it", "pandas", "pandas", "use to_arrays()") from None
    frame = pandas.DataFrame({name: column.copy() for name, column in table.columns.items()})
    frame.attrs[ABOUT] = table.about
    return frame


def table_of_frame(frame: Any) -> WholeTable | None:
    """The table that `frame_of` made a frame of, with the rows and values that it has now; None for any other frame."""
    about = getattr(frame, "attrs", {}).get(ABOUT)
    if not isinstance(about, str):
        return None
    return WholeTable({str(name): frame[name].to_numpy() for name in frame.columns}, about)
