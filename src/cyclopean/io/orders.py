"""Orders of building that somebody wrote down: a text, a table, or JSON."""

import csv
import io
from collections.abc import Sequence

from cyclopean.errors import InputError
from cyclopean.io.csv_tables import cell_text
from cyclopean.io.fields import fail, found, parsed
from cyclopean.io.files import PathLike, decoded, one_line, read_bytes

__all__ = ["read_order"]

NAMES = ("block", "id", "stone", "name")  # of the column with the ids, the first of these that there is
STEPS = ("step", "order", "number", "nr")  # of one by which the rows are sorted, where it holds numbers


def read_order(path: PathLike) -> tuple[str, ...]:
    """Read the ids of stones, the first to be laid first.

    Parameters
    ----------
    path : path
        A text with an id a line (blank lines and those that begin with # left out); a table, `.csv`, with a column
        `block` (or `id`, `stone`, `name`; else the first), and perhaps one `step` that the rows are sorted by; JSON, a
        list of ids or an object with a list `order`, such as a sequence file.

    Raises
    ------
    InputError
        It cannot be read, or holds no ids.
    """
    shown = one_line(path)
    text = decoded(shown, read_bytes(path))
    if shown.lower().endswith(".json") or text.lstrip()[:1] in ("[", "{"):
        ids = _of_json(shown, parsed(shown, text))
    elif shown.lower().endswith(".csv"):
        ids = _of_table(shown, text)
    else:
        ids = [line.strip() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not ids:
        raise InputError(f"{shown}: holds no ids; write one a line, the first to be laid first")
    return tuple(ids)


def _of_json(shown: str, data: object) -> list[str]:
    rows = data.get("order") if isinstance(data, dict) else data
    if not isinstance(rows, list):
        raise InputError(f"{shown}: expected a list of ids, or an object with a list 'order', not {found(rows)}")
    for k, row in enumerate(rows):
        if not isinstance(row, str):
            raise InputError(f"{shown}: entry {k + 1} of the order is {found(row)}; expected the id of a block")
    return rows


def _of_table(shown: str, text: str) -> list[str]:
    try:
        delimiter = csv.Sniffer().sniff(text.partition("\n")[0], ",;\t").delimiter
    except csv.Error:
        delimiter = ","  # one column alone
    try:
        rows = [(k, row) for k, row in enumerate(csv.reader(io.StringIO(text), delimiter=delimiter), 1) if any(row)]
    except csv.Error as error:
        raise InputError(f"{shown}: is no table: {one_line(str(error))}") from None
    head = [cell.strip().lower() for cell in rows[0][1]] if rows else []
    column = next((head.index(name) for name in NAMES if name in head), None)
    turn = next((head.index(name) for name in STEPS if name in head and head.index(name) != column), None)
    rows = rows if column is None else rows[1:]
    if turn is not None and column is not None:
        rows.sort(key=lambda row: _step(shown, row, turn))
    return [_cell(shown, row, column or 0) for row in rows]


def _cell(shown: str, row: tuple[int, Sequence[str]], column: int) -> str:
    if len(row[1]) <= column or not (cell := row[1][column].strip()):
        fail(shown, row[0], "names no block")
    return cell_text(cell)


def _step(shown: str, row: tuple[int, Sequence[str]], column: int) -> float:
    try:
        return float(row[1][column])
    except (IndexError, ValueError):
        fail(shown, row[0], "its step is not a number")
