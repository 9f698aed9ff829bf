"""What a mason would call a prop: a centring under an arch until its keystone is in, a strut against a leaning stone.

A stone *hangs over* if, in the finished structure, a share of its underside lies on nothing (`SOFFIT`), and joints that
are neither level nor upright press it from two sides: a voussoir. Stones that hang over, touch each other, and are let
go together are on one *centring*. It stays until the stone that frees it is in; that one is a *keystone* if it is
wedged between stones on two sides. Any other stone that is held has a prop of its own: a *shore* under it where it was
laid upon nothing, else a *strut* against it.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cyclopean.analysis import PreparedModel
from cyclopean.arrays import Floats
from cyclopean.assembly import Contacts
from cyclopean.design.construction.blocking import neighbours
from cyclopean.design.construction.ordering import SupportGraph
from cyclopean.design.construction.props import Held
from cyclopean.geometry import components, face_normals

__all__ = ["Prop", "hanging", "named_props"]

SOFFIT = 0.2  # share of what a stone covers, seen from below, that lies on nothing
SHOWN = 6  # stones that are named
INCLINED = 0.1  # least share of a joint's normal across gravity, and along it: 6 degrees off level, and off upright


@dataclass(frozen=True, slots=True)
class Prop:
    """What holds stones for the time being."""

    kind: Literal["centring", "strut", "shore"]
    blocks: tuple[int, ...]  # of the whole, in the order of building
    first: int  # step, from 0, from which it holds the first of them
    last: int  # the last step at which it is needed
    until: int | None  # the block that is laid next and frees it; None = the finished structure needs it
    keystone: bool  # whether that one is wedged between stones on two sides

    def said(self, ids: Sequence[str]) -> str:
        """In a mason's words, with the names of the blocks: what, where, from when, until when."""
        names = ", ".join(f"'{ids[i]}'" for i in self.blocks[:SHOWN])
        names += f" and {len(self.blocks) - SHOWN} more" if len(self.blocks) > SHOWN else ""
        what = {"centring": "centring under", "strut": "strut against", "shore": "shore under"}[self.kind]
        if self.until is None:
            return f"{what} {names} from step {self.first + 1}, for good: finished, it does not stand without"
        key = "the keystone " if self.keystone and self.kind == "centring" else ""
        return f"{what} {names} from step {self.first + 1} until {key}'{ids[self.until]}' is in, step {self.last + 2}"


def hanging(whole: PreparedModel, graph: SupportGraph, up: Floats) -> frozenset[int]:
    """Free blocks that hang over; `up` is (3,) unit, against gravity."""
    assembly, around = whole.assembly, neighbours(whole.contacts, len(whole.assembly))
    below = np.maximum(-face_normals(assembly.mesh) @ up / 2.0, 0.0)
    covered = np.add.reduceat(below, assembly.mesh.face_start[:-1]) if len(below) else np.zeros(len(assembly))
    borne = np.zeros(len(assembly))
    for edge in graph.edges:
        borne[edge.upper] += edge.support
    over = (borne < (1.0 - SOFFIT) * covered) & ~whole.fixed
    return frozenset(k for k in np.flatnonzero(over).tolist() if _from_two_sides(around[k].normal, up, down=True))


def named_props(
    whole: PreparedModel, held: Held, order: Sequence[int], hang: Collection[int], up: Floats
) -> list[Prop]:
    """What is put up in an episode.

    Parameters
    ----------
    whole : PreparedModel
        The finished structure.
    held : Held
        What is held at each stage.
    order : sequence of int
        Blocks, the first to be laid first.
    hang : collection of int
        Those that hang over.
    up : (3,) unit
        Against gravity.
    """
    spans = sorted(_spans(held), key=lambda span: (span[2], span[1]))
    together: dict[tuple[str, int, int], list[tuple[int, int]]] = {}
    for block, first, last in spans:
        borne = len(_beds(whole, order[: first + 1], block, up))
        key = ("centring", last, 0) if block in hang else ("strut" if borne else "shore", last, block)
        together.setdefault(key, []).append((first, block))
    props: list[Prop] = []
    for (kind, last, _), rows in together.items():
        until = order[last + 1] if last + 1 < len(order) else None
        blocks = [block for _, block in rows]
        wedged = until is not None and _from_two_sides(_beds(whole, order[: last + 1], until, up), up, down=False)
        for group in _touching(whole.contacts, len(whole.assembly), blocks, until) if kind == "centring" else [blocks]:
            some = sorted(row for row in rows if row[1] in group)
            props.append(Prop(kind, tuple(block for _, block in some), some[0][0], last, until, wedged))  # type: ignore[arg-type]
    return sorted(props, key=lambda prop: (prop.first, prop.blocks))


def _spans(held: Held) -> list[tuple[int, int, int]]:
    """Every block that is held, from which step to which; twice where it is held again."""
    found: list[tuple[int, int, int]] = []
    begun: dict[int, int] = {}
    for number, blocks in enumerate((*held.blocks, ()), held.first):
        for block in [b for b in begun if b not in blocks]:
            found.append((block, begun.pop(block), number - 1))
        for block in blocks:
            begun.setdefault(block, number)
    return found


def _touching(contacts: Contacts, count: int, blocks: Sequence[int], link: int | None) -> list[set[int]]:
    """Blocks in groups that touch, one way or another, or by way of one more block."""
    inside = np.isin(np.stack([contacts.a, contacts.b]), [*blocks, *(() if link is None else (link,))]).all(axis=0)
    label = components(count, contacts.a[inside], contacts.b[inside])
    return [{block for block in blocks if label[block] == k} for k in dict.fromkeys(label[list(blocks)].tolist())]


def _beds(whole: PreparedModel, laid: Sequence[int], block: int, up: Floats) -> Floats:
    """(k, 3) normals of the joints by which a block lies on what is laid."""
    around = neighbours(whole.contacts, len(whole.assembly))[block]
    there = np.isin(around.block, [*laid, *np.flatnonzero(whole.fixed).tolist()])
    return around.normal[there & (around.normal @ up > 0.0)]


def _from_two_sides(normal: Floats, up: Floats, down: bool) -> bool:
    """Whether (k, 3) normals of inclined joints point into a block from two sides; `down`: one at least from below."""
    rise = normal @ up
    across = normal - rise[:, None] * up
    inclined = (np.linalg.norm(across, axis=1) > INCLINED) & (np.abs(rise) > INCLINED)
    across, rise = across[inclined], rise[inclined]
    return bool(len(across) and (across @ across.T).min() < 0.0 and (not down or (rise > 0.0).any()))
