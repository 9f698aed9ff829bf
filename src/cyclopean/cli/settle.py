"""`settle`: a rubble wall of stones as they were found."""

import os
from collections import Counter
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Annotated

from cyclopean.api.inputs import StoneReading, inventory_of
from cyclopean.api.site import SiteOptions, site_folder, site_sheets
from cyclopean.cli.command import argument, command, some, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.site import written_site
from cyclopean.cli.terminal import long_work, warn
from cyclopean.cli.workers import beside
from cyclopean.design.rubble.places import Scores
from cyclopean.design.rubble.wall import SettleSettings
from cyclopean.errors import InputError
from cyclopean.options import option
from cyclopean.texts import first_few
from cyclopean.texts import scores as read_scores

if TYPE_CHECKING:
    from cyclopean.design.rubble.wall import RubbleWall
    from cyclopean.design.stones.inventory import Inventory

TAKEN = (
    "length height thickness wythes batter corner opening ends coursed through binders hearting pins copes inward"
    " dress all look_ahead margin friction lean yaws cell ways"
)


@dataclass(frozen=True, slots=True)
class Laying:
    """How the stones are laid, beside the settings."""

    scores: str | None = option(
        None, f"[{','.join(f'{name}={value:g}' for name, value in asdict(Scores()).items())}]", metavar="NAME=W,..."
    )
    standing: str | None = option(
        None, "Go on with the wall of this model, with the stones still at hand.", metavar="MODEL"
    )
    next: int | None = option(
        None, "Tell the N best stones to lay next, and lay the first.", "whole", metavar="N", least=1, most=100
    )
    workers: int | None = option(None, "Processes [2].", "whole", choices=("1", "2"))


@command(
    friction="is --mu now, as everywhere",
    weights="is --scores now; weights are those of forces, as in check",
    chinking="is --pins now: stones that would rock are steadied with small ones of the stock",
)
def settle(
    stones: Annotated[str, argument("STONES", "Folder of stones, or a file that holds them.", source=True)],
    files: Annotated[
        Files,
        written(
            out=("MODEL", "Required: Model file to write."),
            json=("F|-", "Write placements and figures; - prints them and nothing else."),
            report=("F", "Write a page: pictures, measures, and every stone."),
            drawing=("F", "Draw the wall from all sides, and cut."),
        ),
    ],
    settings: Annotated[SettleSettings, some(TAKEN)] = SettleSettings(),
    asked: Laying = Laying(),
    reading: StoneReading = StoneReading(),
    site: SiteOptions = SiteOptions(),
) -> int:
    """Lay found stones, uncut, into a dry rubble wall that stands at every stage."""
    out = files.to["out"]
    site_folder(site)
    if out.suffix.lower() != ".json":
        raise InputError(f"`out` {out}: unknown ending; use .json")
    if asked.scores is not None:
        given = read_scores("`scores`", asked.scores, tuple(asdict(settings.scores)))
        settings = replace(settings, scores=replace(settings.scores, **given))

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the products are small: threads would wait for each other
    from cyclopean import io
    from cyclopean.api.drawings import drawn
    from cyclopean.design.rubble.settle import settle as build
    from cyclopean.io.settled import settled_dict
    from cyclopean.view.settled_page import settled_page

    with long_work(f"laying {stones}") as stage:
        inventory, said = inventory_of(stones, reading)
        stands = None if asked.standing is None else io.read_model(asked.standing)[0]
        with beside((asked.workers or 2) - 1) as executor:
            wall = build(inventory, settings, stage, executor, stands, asked.next or 0)
        sheets = site_sheets(wall, site, progress=stage, stones=inventory.stones)
    for warning in (*said, *inventory.notes):
        warn(warning)
    there = files.to.get("json", out).absolute().parent
    data = settled_dict(
        wall,
        inventory,
        stones_path=os.path.relpath(stones, there),
        model_path=os.path.relpath(out, there),
        units=reading.units,
    )
    with io.together():
        files.write({
            "report": lambda: settled_page(wall, inventory),
            "out": lambda: lambda file: io.write_model(file, wall.assembly),
            "json": lambda: data,
            **drawn(wall),
        })  # fmt: skip
        site_line = written_site(site, sheets)
    files.tell(data, [*_lines(wall, inventory, files), *site_line])
    return 0


def _lines(wall: "RubbleWall", inventory: "Inventory", files: Files) -> list[str]:
    """Say what came out."""
    from cyclopean.view.settled_page import LISTED, answer_of, stands_of, told_measures

    what, missing = answer_of(wall, inventory)
    lines = [
        f"{what}{'; ' + missing[0].lower() + missing[1:].rstrip('. ') if missing else ''}",
        f"  {stands_of(wall, inventory).rstrip('.')}",
        *(f"  {name:<9} {said}" for name, said in (line.split(": ", 1) for line in told_measures(wall))),
    ]
    for k, laid in enumerate(wall.following, 1):
        x, y, z = laid.rotation @ inventory.stones[laid.stone].centroid + laid.shift
        lines.append(
            f"  next {k:<4} {inventory.stones[laid.stone].id} with its middle at {x:.3f}, {y:.3f}, {z:.3f} m; its"
            f" centre of mass stands {1e3 * laid.margin:.0f} mm inside what bears it"
        )
    roles = Counter(laid.role for laid in wall.laid)
    if set(roles) != {"stone"}:
        lines.append("  laid as   " + ", ".join(f"{count} {role}" for role, count in roles.most_common()))
    reasons: dict[str, list[str]] = {}
    for stone, reason in wall.left_over:
        reasons.setdefault(reason, []).append(inventory.stones[stone].id)
    for reason, names in sorted(reasons.items(), key=lambda one: -len(one[1])):
        lines.append(f"  put aside {len(names)}: {reason} ({first_few(names, LISTED)})")
    return lines + files.line(wide=8)
