"""Tables for a spreadsheet: comma-separated, as RFC 4180 has them.

Spreadsheets run text that begins with = + - or @, a tab or an end of line, as a formula. Such text is written with an
apostrophe before it, and so is text that has an apostrophe there already: what is read again loses one. Numbers are
left alone.
"""

import csv
import io
import re
from collections.abc import Iterable, Sequence

import numpy as np

__all__ = ["cell_text", "csv_number", "csv_text"]

_FORMULA = re.compile(r"[\s']*[=+\-@\uFF1D\uFF0B\uFF0D\uFF20]|'*[\t\r\n]")  # the four also as wide as Japanese text
_NUMBER = re.compile(r"[+-]?[0-9]+(\.[0-9]*)?")


def csv_number(value: float) -> str:
    """Six digits without an exponent, which some spreadsheets take for text."""
    return np.format_float_positional(float(f"{value:.6g}"), trim="-")


def csv_text(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """One line of names, then one line a row."""
    said = io.StringIO()
    writer = csv.writer(said, lineterminator="\r\n")
    writer.writerows([_harmless(cell) for cell in row] for row in (head, *rows))
    return said.getvalue()


def _harmless(cell: str) -> str:
    return f"'{cell}" if _FORMULA.match(cell) and not _NUMBER.fullmatch(cell) else cell


def cell_text(cell: str) -> str:
    """Text as it was before `csv_text` made it harmless.

    Examples
    --------
    >>> cell_text("'=A1"), cell_text("'tis"), cell_text("-2.5")
    ('=A1', "'tis", '-2.5')
    """
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell
