"""Recordings as tables of other programs, and back without loss: pandas, Parquet, MATLAB."""

from __future__ import annotations

from recordings.exchange.data_frames import ABOUT, frame_of, table_of_frame
from recordings.exchange.files import write_table
from recordings.exchange.matlab import COLUMNS
from recordings.exchange.table_form import REMEDY, WholeTable, parts_of_table, table_of

__all__ = [
    "ABOUT",
    "COLUMNS",
    "REMEDY",
    "WholeTable",
    "frame_of",
    "parts_of_table",
    "table_of",
    "table_of_frame",
    "write_table",
]
