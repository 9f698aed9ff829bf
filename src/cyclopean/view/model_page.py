"""The page of a model that nobody has checked yet: its blocks, where they touch, what holds them."""

from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.arrays import Bools
from cyclopean.assembly import Assembly, Contacts
from cyclopean.view import markup
from cyclopean.view.colours import FORCE
from cyclopean.view.drawing import still
from cyclopean.view.figures import number
from cyclopean.view.layers import contact_sides

_NOT_ASKED = "Whether it stands is not asked here: see the command check."


def model_html(
    assembly: Assembly, contacts: Contacts, fixed: Bools, warnings: Sequence[str] = (), drawing: str = ""
) -> str:
    """Write the page of a model: self-contained, with nothing about whether it stands.

    Contacts are given or detected, `fixed` (n,) are supports; warnings say what is odd about it. A `drawing` of the
    wall's own, one `<svg>` element, goes first.
    """
    figures = [
        ("blocks", len(assembly)),
        ("of them supports", int(fixed.sum())),
        ("contacts", len(contacts)),
        ("contact points", len(contacts.point)),
        ("volume, m³", number(float(assembly.mass.volume.sum()))),
    ]
    outline = f'<path d="M1 8H31" stroke="{FORCE}" stroke-width="3"/>'
    keys = markup.legend(
        [markup.key(markup.SUPPORTED, "support"), markup.key(outline, "outline of a contact, in the 3D scene")]
    )
    shown = markup.model_figures(still(assembly, fixed), assembly.name, _NOT_ASKED, joints=contact_sides(contacts))
    body = (
        markup.headline(assembly.name, figures),
        markup.section("The face", markup.figure(drawing)) if drawing else "",
        markup.section("The model", keys + shown),
        markup.section("Block by block", _table(assembly, contacts, fixed)),
        markup.section("Warnings", markup.listed(warnings)),
    )
    return markup.document(assembly.name, body, may=markup.POLICY)


def _table(assembly: Assembly, contacts: Contacts, fixed: Bools) -> str:
    touching = np.bincount(np.concatenate([contacts.a, contacts.b]), minlength=len(assembly))
    head = ["Block", "Group", ">Volume (m³)", ">Contacts", ""]
    rows = (
        (escape(b.id), escape(b.group or ""), number(float(v)), f"{int(t):,}", "support" if held else "")
        for b, v, t, held in zip(assembly.blocks, assembly.mass.volume, touching, fixed, strict=False)
    )
    return markup.table(head, rows)
