"""Blocks and contacts as tables for a spreadsheet: CSV as RFC 4180 has it, SI units, every digit, UTF-8.

Shapes have no place in them, so that they are written and not read.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from cyclopean.assembly import Assembly
from cyclopean.io.csv_tables import csv_text
from cyclopean.io.findings import Findings
from cyclopean.io.round_trip import carried, shown, told

__all__ = ["tables_csv"]

_UNITS = {"density": "density [kg/m3]", "volume": "volume [m3]"}


def tables_csv(assembly: Assembly, findings: Findings) -> list[str]:
    """Table of the blocks, and where the model lists contacts one of these."""
    blocks = _blocks_csv(assembly, findings)
    return [blocks] if assembly.contacts is None else [blocks, _contacts_csv(assembly, findings)]


def _blocks_csv(assembly: Assembly, findings: Findings) -> str:
    """One row a block: id, what the model says of it, volume, centre of mass, mass, and what was found out."""
    _, rows, _ = carried(assembly)
    said = told(assembly, findings)
    given = list(dict.fromkeys(key for row in rows for key in row))
    found = list(dict.fromkeys(key for row in said for key in row))
    centre = assembly.mass.centroid.tolist()
    head = ["id", *(_UNITS.get(key, key) for key in (*given, *found)), "x [m]", "y [m]", "z [m]", "vertices", "faces"]
    table = (
        [
            block.id,
            *(_cell(rows[k].get(key)) for key in given),
            *(_cell(said[k].get(key)) for key in found),
            *map(_cell, centre[k]),
            str(len(block.vertices)),
            str(len(block.faces)),
        ]
        for k, block in enumerate(assembly.blocks)
    )
    return csv_text(head, table)


def _contacts_csv(assembly: Assembly, findings: Findings) -> str:
    """One row a contact: which blocks, area, centre, normal from a into b, and its forces where they are known."""
    contacts = assembly.contacts
    assert contacts is not None
    _, _, rows = carried(assembly)
    given = list(dict.fromkeys(key for row in rows for key in row if key not in ("a", "b", "polygon")))
    head = ["a", "b", *given, "area [m2]", "x [m]", "y [m]", "z [m]", "nx", "ny", "nz", "points"]
    head += ["N [N]", "T [N]", "utilisation"] if findings.contact else []
    area, normal = contacts.area.tolist(), contacts.frame[:, 0].tolist()
    table = (
        [
            row["a"],
            row["b"],
            *(_cell(row.get(key)) for key in given),
            _cell(area[k]),
            *map(_cell, contacts.polygon(k).mean(axis=0).tolist()),
            *map(_cell, normal[k]),
            str(len(row["polygon"])),
            *_forces(findings, k),
        ]
        for k, row in enumerate(rows)
    )
    return csv_text(head, table)


def _forces(findings: Findings, k: int) -> Sequence[str]:
    """Resultant normal and tangential force of a contact, and its utilisation."""
    if not findings.contact:
        return ()
    state = findings.contact[k]
    normal, u, v = state.local.sum(axis=0).tolist()
    return _cell(normal), _cell(float(np.hypot(u, v))), _cell(state.utilisation)


def _cell(value: Any) -> str:
    """Plain decimals, because some spreadsheets take an exponent for text; nothing where nothing is known."""
    if value is None:
        return ""
    if isinstance(value, float):
        return np.format_float_positional(value, trim="-")
    return value if isinstance(value, str) else shown("", value)
