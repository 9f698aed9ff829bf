"""The page of a model that nobody has checked yet: its blocks, where they touch, what holds them."""

from collections.abc import Sequence
from html import escape

import numpy as np

from cyclopean.arrays import Bools
from cyclopean.assembly import Assembly, Contacts
from cyclopean.view.colours import FORCE, HATCH, SUPPORT, classes
from cyclopean.view.drawing import EDGE_LIMIT, FACE_LIMIT, Picture, feature_edges, outlines
from cyclopean.view.elevation import elevation_svg
from cyclopean.view.layers import contact_sides
from cyclopean.view.markup import counts, document, key, section
from cyclopean.view.page import POLICY
from cyclopean.view.scene import scene_html
from cyclopean.view.tables import table

__all__ = ["model_html"]

ROWS = 400  # of the table of blocks
_STYLE = ".rows{max-height:34rem;overflow:auto}"


def model_html(assembly: Assembly, contacts: Contacts, fixed: Bools, warnings: Sequence[str] = ()) -> str:
    """Write the page of a model: self-contained, with nothing about whether it stands.

    Parameters
    ----------
    assembly : Assembly
        The model.
    contacts : Contacts
        Given or detected.
    fixed : (n,) bool
        Supports.
    warnings : sequence of str
        What is odd about it.
    """
    drawn = _picture(assembly, fixed)
    name = escape(assembly.name)
    held = int(fixed.sum())
    mass = float(assembly.mass.volume.sum())
    figures = [("blocks", f"{len(assembly):,}"), ("of them supports", f"{held:,}"), ("contacts", f"{len(contacts):,}")]
    figures += [("contact points", f"{len(contacts.point):,}"), ("volume, m³", f"{mass:.4g}")]
    scene = escape(scene_html(drawn, contact_sides(contacts)), quote=True)
    flat = elevation_svg(drawn, f"Elevation of {assembly.name}")
    box = f'<rect width="32" height="16" fill="{SUPPORT}"/><path d="M2 18 18 0M12 18 28 0M22 18 38 0" stroke="{HATCH}"'
    legend = key(f'{box} stroke-width="3"/>', "support")
    legend += key(f'<path d="M1 8H31" stroke="{FORCE}" stroke-width="3"/>', "outline of a contact, in the 3D scene")
    body = (
        f"<header><h1>{name}</h1><span>cyclopean</span></header>",
        counts(figures),
        f'<section><h2>The model</h2><div class="legend">{legend}</div>'
        f'<figure class="scene"><iframe title="3D scene: {name}" srcdoc="{scene}"></iframe>'
        "<figcaption>Drag to turn, scroll to zoom, right-drag to move.</figcaption></figure>"
        f'<figure class="elevation">{flat}<figcaption>Elevation. Whether it stands is not asked here: see the command'
        " check.</figcaption></figure></section>",
        section("Block by block", _table(assembly, contacts, fixed)),
        section("Warnings", "".join(f"<p>{escape(line)}</p>" for line in warnings)),
    )
    return document(assembly.name, body, style=_STYLE, may=POLICY)


def _picture(assembly: Assembly, fixed: Bools) -> Picture:
    mesh = outlines(assembly.mesh, FACE_LIMIT)
    edge = feature_edges(mesh)
    none = np.zeros((0, 2, 3))
    group = classes(np.full(len(assembly), np.nan), fixed)
    return Picture(
        mesh, group, "nothing", edge if len(edge) <= EDGE_LIMIT else none, none, none, 0.0, np.zeros(3), None, ()
    )


def _table(assembly: Assembly, contacts: Contacts, fixed: Bools) -> str:
    touching = np.bincount(np.concatenate([contacts.a, contacts.b]), minlength=len(assembly))
    head = [("Block", ""), ("Group", ""), ("Volume, m³", "n"), ("Contacts", "n"), ("", "")]
    rows = [
        (escape(b.id), escape(b.group or ""), f"{v:.4g}", f"{int(t):,}", "support" if held else "")
        for b, v, t, held in zip(assembly.blocks[:ROWS], assembly.mass.volume, touching, fixed, strict=False)
    ]
    more = f'<p class="soft">and {len(assembly) - ROWS:,} more</p>' if len(assembly) > ROWS else ""
    return f'<div class="rows">{table(head, rows)}</div>{more}'
