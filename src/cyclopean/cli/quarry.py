"""`make stones`: an inventory of synthetic stones."""

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopean.cli.command import command
from cyclopean.cli.outputs import MESHES, folder, planned
from cyclopean.cli.terminal import long_work, say, warn
from cyclopean.errors import InputError
from cyclopean.options import Option
from cyclopean.texts import number

if TYPE_CHECKING:
    from cyclopean.design.stones.stone import Stone

MOST = 20_000_000  # vertices of all stones together: more do not fit into a common memory
UNITS = {"L": 1e-3, "l": 1e-3, "m3": 1.0}  # m3
BAND = re.compile(r"(?P<low>.+?)\.\.(?P<high>.+?)(?P<unit>L|l|m3)")


@command()
def stones(
    out: Annotated[str, Option("Folder (a file a stone), or a mesh or model file.", metavar="PLACE")],
    count: Annotated[int, Option("Number of stones.", "whole", metavar="N", least=1)] = 100,
    seed: Annotated[int, Option("Another seed, other stones.", "whole", metavar="N")] = 0,
    volume: Annotated[str, Option("Band of volumes, in L or m3.", metavar="LOW..HIGH")] = "30..200L",
    detail: Annotated[
        int, Option("Subdivisions of an icosahedron, 1 to 6: 42, 162, 642 ... vertices.", "whole", metavar="N")
    ] = 3,
) -> int:
    """Make synthetic stones with the shapes of real ones."""
    band, place = _band("`volume`", volume), _place(out)
    if count * 10 * 4 ** min(max(detail, 1), 20) > MOST:
        raise InputError(f"`count`, `detail`: more than {MOST:,} vertices; ask for fewer or coarser stones")

    from cyclopean.design.stones.quarry import quarry

    with long_work(f"making {count} stones"):
        made = quarry(count, seed, band, detail=detail)
        _write(place, made)
    total = sum(stone.volume for stone in made)
    say(f"{count} stone{'' if count == 1 else 's'}, {total:.3g} m3 in all; written {place}")
    return 0


def _place(text: str) -> Path:
    """Where to write: a folder that is there, or a file by its ending."""
    if os.path.isdir(text):
        return folder("--out", text, "")
    path = Path(text)
    suffix = path.suffix.lower()
    if suffix in (*MESHES, ".json"):
        return planned({"--out": text})["--out"]
    if os.path.lexists(text) or (suffix and not text.endswith(("/", os.sep))):
        raise InputError(f"--out {text}: unknown ending; use .json, {', '.join(MESHES)}, or a folder")
    raise InputError(f"--out {text}: no such folder; make it first, or name a file ({', '.join(MESHES)}, .json)")


def _write(place: Path, made: "tuple[Stone, ...]") -> None:
    """Write each stone to a file of its own, or all of them, laid out on the ground, to one."""
    from cyclopean import io
    from cyclopean.assembly import Assembly, Block, Contacts
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.design.stones.quarry import laid_out
    from cyclopean.io.stones import write_stones

    if place.is_dir():
        write_stones(place, Inventory(made))
        names = {f"{stone.id}.obj" for stone in made}
        others = sum(p.suffix.lower() in MESHES and p.name not in names for p in place.iterdir())
        if others:
            warn(f"{place}: also holds {others} other mesh file{'' if others == 1 else 's'}, left as they are")
    elif place.suffix.lower() == ".json":
        blocks = tuple(Block(s.id, s.vertices, tuple(map(tuple, s.triangles.tolist()))) for s in laid_out(made))
        io.write_model(place, Assembly(blocks, Contacts.of([], []), name=place.stem))
    else:
        write_stones(place, Inventory(laid_out(made)))


def _band(option: str, text: str) -> tuple[float, float]:
    """Read LOW..HIGH with a unit at the end, in m3."""
    found = BAND.fullmatch(text.strip())
    if found is None:
        raise InputError(f"{option}: '{text}' should be LOW..HIGH with the unit L or m3, such as 30..200L")
    unit = UNITS[found["unit"]]
    low, high = (number(option, part.strip()) * unit for part in (found["low"], found["high"]))
    if not low > 0.0:
        raise InputError(f"{option}: '{text}' begins at nothing; a stone has a volume above 0")
    if not low <= high:
        raise InputError(f"{option}: '{text}' ends below its beginning; give the smaller volume first")
    return low, high
