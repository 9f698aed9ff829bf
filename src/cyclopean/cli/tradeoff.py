"""`match --tradeoff`: what is written of its walls, and what is said."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopean.api.stones import MatchOptions
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.api.stones import StoneTradeoff
    from cyclopean.cli.outputs import Files
    from cyclopean.design.matching.tradeoff import Alternative, Tradeoff, TradeoffSettings

DATA, CURVE = "tradeoff.json", "tradeoff.svg"
FILES = {"wall": "wall-{}.json", "match": "match-{}.json", "picture": "wall-{}.svg"}  # of each wall, by its number


def wanted_walls(
    count: int | None, depths: tuple[float, float] | None, weight: float | None, options: MatchOptions
) -> "TradeoffSettings | None":
    """What is asked of a trade-off; None where none is asked for.

    Raises
    ------
    InputError
        Options that say otherwise what a trade-off tries by itself, or that have no say without one.
    """
    from cyclopean.design.matching.tradeoff import TradeoffSettings

    if count is None:
        if depths is not None:
            raise InputError.of("depths", None, "has no say without `tradeoff`; add it, or leave this out")
        return None
    if options.negotiate > 0.0:
        raise InputError.of("negotiate", None, "a `tradeoff` tries shares from 0 to 1; leave out one of the two")
    if options.sawn:
        raise InputError.of("sawn", None, "a `tradeoff` draws walls anew, with other stones; leave out one of the two")
    if options.supports:
        raise InputError.of("supports", None, "has no say in a `tradeoff`; the ground of a drawn wall is its support")
    if weight is not None:
        raise InputError.of("weight", None, "has no say in a `tradeoff`, which finds it at one gap; give `gap` instead")
    return TradeoffSettings(count, depths, options.rounds)


def names_of(count: int) -> list[str]:
    """Files of so many walls."""
    return [DATA, CURVE, *(name.format(k) for k in range(1, count + 1) for name in FILES.values())]


def contents_of(
    found: "StoneTradeoff", matches: Callable[..., Mapping[str, Any]]
) -> tuple[dict[str, Any], dict[str, Callable[[], Any]]]:
    """The trade-off as plain data, and what each file holds; `matches` gives a match, by its number,
    its wall, and what was asked of it.
    """
    from cyclopean.io.matches import tradeoff_dict
    from cyclopean.view.tradeoff_page import alternative_svg, tradeoff_html, tradeoff_svg

    trade, count = found.tradeoff, range(1, len(found) + 1)
    names = [{what: name.format(k) for what, name in FILES.items()} for k in count]
    pictures = [alternative_svg(one, f"wall {k}") for k, one in enumerate(trade.alternatives, 1)]
    data = tradeoff_dict(trade, names)

    contents: dict[str, Callable[[], Any]] = {
        DATA: lambda: data,
        CURVE: lambda: tradeoff_svg(trade),
        "json": lambda: data,
        "report": lambda: tradeoff_html(trade, pictures),
    }
    for k, (one, row) in enumerate(zip(trade.alternatives, names, strict=True)):
        kept = matches(k, row["wall"], gap=trade.gap, negotiate=one.asked.share)
        contents |= _contents_of_one(one, row, kept, pictures[k])
    return data, contents


def _contents_of_one(
    one: "Alternative", names: Mapping[str, str], match: Mapping[str, Any], picture: str
) -> dict[str, Callable[[], Any]]:
    """What the files of one wall hold."""
    from cyclopean import io
    from cyclopean.view.svg import true_size

    drawing = io.drawing_dict(one.wall)
    return {
        names["wall"]: lambda: lambda file: io.write_model(file, one.wall.assembly, drawing=drawing),
        names["match"]: lambda: match,
        names["picture"]: lambda: true_size(picture),
    }


def summary(trade: "Tradeoff", place: Path, files: "Files") -> list[str]:
    """Say what came out, the walls that none beats with a star."""
    lines = [first_line(trade)]
    for k, one in enumerate(trade.alternatives):
        star, asked, fault = "*" if k in trade.non_dominated else " ", one.asked, one.fault(trade.gap)
        made = "as drawn" if not asked.redrawn else f"seed {asked.seed}, coursing {asked.coursing:.2f}"
        made += f", depth {asked.depth:.3g} m" if asked.redrawn else ""
        made += ", laid out for J" if asked.improved else ""
        made += f", cells moved by {asked.share:.2f}" if asked.share else ""
        lines.append(
            f" {star}{k + 1:>3}  Lambda {one.imposition:.4f}, gap {one.gap:.4f}, J {one.interlock:.3f}, {one.verdict}"
            f"{', too much void' if fault.startswith('gap') else ''}; {made}"
        )
    written = f"{DATA}, {CURVE} and, of each wall, {', '.join(name.format('N') for name in FILES.values())}"
    inside = {f"{place / name}" for name in names_of(len(trade))}
    also = [str(path) for path in files.to.values() if str(path) not in inside and path.parent != place]
    return [*lines, f"  written  in {place}: {written}{''.join(f'; {name}' for name in also)}"]


def first_line(trade: "Tradeoff") -> str:
    """The line for whoever reads one line only."""
    best = [trade.alternatives[k] for k in trade.non_dominated]
    head = f"{len(trade)} walls at gap {trade.gap:g}"
    if not best:
        return (
            f"{head}: none of them is shown to stand with so little void; give more or larger stones, or a larger --gap"
        )
    least, most = (
        f"{100.0 * one.imposition:.1f} % carved away with J {one.interlock:.3f}" for one in (best[0], best[-1])
    )
    if len(best) == 1:
        return f"{head}: wall {trade.non_dominated[0] + 1} beats all others, {least}"
    return f"{head}: from {least} to {most}; {len(best)} of them are not beaten by another"
