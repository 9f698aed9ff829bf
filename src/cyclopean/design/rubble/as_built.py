"""A wall that stands already, and is gone on with: settled before, or scanned as built."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cyclopean.assembly import Assembly, Block, supports
from cyclopean.design.rubble.features import Body, body_of
from cyclopean.design.stones.stone import Stone
from cyclopean.errors import InputError
from cyclopean.geometry import triangles

__all__ = ["NOTHING", "AsBuilt", "course_of"]

LEVEL = 1e-3  # m: the ground that a wall stands on is level, and at height 0, to within that


@dataclass(frozen=True, slots=True, eq=False)
class AsBuilt:
    """What stands, from the lowest course up, as in its file."""

    blocks: tuple[Block, ...] = ()
    bodies: tuple[Body, ...] = ()
    course: int = 0  # the next one

    @classmethod
    def of(cls, wall: Assembly) -> "AsBuilt":
        """The free blocks of a wall, in order.

        Raises
        ------
        InputError
            The wall has no free block, or its ground is not level at height 0.
        """
        held, _ = supports(wall)
        free = [block for block, fixed in zip(wall.blocks, held.tolist(), strict=True) if not fixed]
        if not free:
            raise InputError(f"standing {wall.name}: has no free block; it is not a wall to go on with")
        ground = [block for block, fixed in zip(wall.blocks, held.tolist(), strict=True) if fixed]
        tops = [float(block.vertices[:, 2].max()) for block in ground]
        if tops and not abs(max(tops)) <= LEVEL:
            raise InputError(
                f"standing {wall.name}: its ground '{ground[int(np.argmax(tops))].id}' has its top at"
                f" {max(tops):.3g} m; put it at height 0"
            )
        bodies = []
        for block in free:
            mesh = Assembly((block,), None, ()).mesh
            corner, _ = triangles(mesh)
            bodies.append(body_of(mesh.vertex, corner, f"block '{block.id}'"))
        courses = [course for block in free if (course := course_of(block)) is not None]
        return cls(tuple(free), tuple(bodies), max(courses, default=-1) + 1)

    def at_hand(self, stones: Sequence[Stone]) -> list[Stone]:
        """Stones that are not in it."""
        used = {block.id for block in self.blocks}
        return [stone for stone in stones if stone.id not in used]

    @property
    def volumes(self) -> tuple[float, ...]:
        """m3 of each."""
        return tuple(body.volume for body in self.bodies)


def course_of(block: Block) -> int | None:
    """The course that a block of a wall lies in, by its group; None where that does not say."""
    kind, _, number = (block.group or "").partition("-")
    return int(number) if kind == "course" and number.isdigit() else None


NOTHING = AsBuilt()
