"""Tables for a spreadsheet: comma-separated, as RFC 4180 has them."""

import csv
import io
from collections.abc import Iterable, Sequence

import numpy as np

__all__ = ["csv_number", "csv_text"]


def csv_number(value: float) -> str:
    """Six digits without an exponent, which some spreadsheets take for text."""
    return np.format_float_positional(float(f"{value:.6g}"), trim="-")


def csv_text(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """One line of names, then one line a row."""
    said = io.StringIO()
    writer = csv.writer(said, lineterminator="\r\n")
    writer.writerow(head)
    writer.writerows(rows)
    return said.getvalue()
