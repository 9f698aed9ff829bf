"""The trade-off between carving and interlock: who beats whom, what a wall of the plan is, and the same by any hands.

By hand: of (Lambda, J) = (0.2, 0.7), (0.3, 0.9), (0.3, 0.8), (0.4, 0.9) and (0.2, 0.7) again, the second beats the
third (J) and the fourth (Lambda); the first and the last are the same, and neither beats the other.

Mutants killed: "less than" for "no less than" in one of the two; a wall that falls, or is half empty, in the front; the
verdict, the depth or the seed of the plan not kept; the share of the third wall.
"""

import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean.api.inputs import StoneReading
from cyclopean.api.keywords import TradeoffKeywords
from cyclopean.api.stones import StoneTradeoff
from cyclopean.cli.tradeoff import first_line
from cyclopean.cli.workers import beside
from cyclopean.design.matching.match import MatchSettings, match_stones
from cyclopean.design.matching.tradeoff import Tradeoff, TradeoffSettings, _drawing, _judged, _plan, tradeoff, unbeaten
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.walls.interlock import interlock
from cyclopean.design.walls.pattern import PatternSettings
from cyclopean.design.walls.polygonal import verdict
from cyclopean.errors import InputError
from cyclopean.io.checkpoints import Checkpoints
from cyclopean.view.tradeoff_page import tradeoff_svg
from laws import examples

FAST = MatchSettings(gap=0.35, climbs=0, points=64, shortlist=3, starts=1)
WANTED = TradeoffSettings(4, (0.25, 0.35), rounds=1)


@pytest.fixture(scope="module")
def stock():
    return quarry(8, 2, (0.02, 0.09), detail=1)


@pytest.fixture(scope="module")
def wall():
    return cyclopean.polygonal_wall(PatternSettings(0.9, 0.7, 2, 2, 5, courses=2), depth=0.3, mu=0.7)


@pytest.fixture(scope="module")
def made(stock, wall) -> Tradeoff:
    return tradeoff(stock, wall, WANTED, FAST)


def test_who_beats_whom_by_hand():
    carved, locked = np.array([0.2, 0.3, 0.3, 0.4, 0.2]), np.array([0.7, 0.9, 0.8, 0.9, 0.7])
    assert unbeaten(carved, locked).tolist() == [True, True, False, False, True]
    assert unbeaten(carved[:0], locked[:0]).tolist() == []


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12), st.randoms())
@settings(max_examples=examples(60), deadline=None)
def test_the_front_beats_all_others_and_none_of_itself(points, chance):
    def beats(a, b):
        return a != b and a[0] <= b[0] and a[1] >= b[1]

    best = unbeaten(*np.array(points, float).T)
    front = [p for p, kept in zip(points, best, strict=True) if kept]
    assert not any(beats(a, b) for a in front for b in front)
    assert all(any(beats(a, p) for a in front) for p, kept in zip(points, best, strict=True) if not kept)
    order = list(range(len(points)))
    chance.shuffle(order)
    assert unbeaten(*np.array([points[k] for k in order], float).T).tolist() == best[order].tolist()


def test_walls_are_what_the_plan_says(made, stock, wall):
    assert len(made) == 4
    first = made.alternatives[0]
    assert all(np.array_equal(a.vertices, b.vertices) for a, b in zip(first.wall.assembly.blocks, wall.assembly.blocks,
                                                                       strict=True))  # fmt: skip
    alone = match_stones(stock, first.cells, FAST)
    assert [(p.stone, p.cell, p.shared) for p in first.match.placements] == [
        (p.stone, p.cell, p.shared) for p in alone.placements
    ]
    for k, one in enumerate(made.alternatives):
        assert one.interlock == interlock(one.wall.pattern).score
        assert one.verdict == verdict(one.wall.assembly)
        shared = sum(p.shared for p in one.match.placements)
        assert one.gap == pytest.approx(1.0 - shared / one.wall.assembly.mass.volume[1:].sum(), abs=1e-9)
        assert one.imposition == pytest.approx(1.0 - shared / sum(stock[p.stone].volume for p in one.match.placements))
        assert one.wall.thickness.depth == one.asked.depth
        assert one.wall.pattern.settings.seed == one.asked.seed
        assert (one.asked.depth == 0.3 and one.asked.seed == wall.pattern.settings.seed) == (not one.asked.redrawn)
        assert (k in made.non_dominated) <= (not one.fault(made.gap))
    assert [one.asked.share for one in made.alternatives[:2]] == [0.0, 1.0]
    assert len({one.asked.depth for one in made.alternatives}) > 2


def test_the_plan_begins_with_the_drawing_and_stays_in_its_ranges(wall):
    poor = cyclopean.polygonal_wall(PatternSettings(0.9, 0.7, 2, 2, 3, courses=2), depth=0.3)
    assert (interlock(poor.pattern).score, interlock(wall.pattern).score) == (0.0, 1.0)
    for drawn, many in ((poor, 4), (wall, 2)):  # there is nothing to lay out better where J is 1
        plan = list(_plan(_drawing(drawn, WANTED), TradeoffSettings(40, (0.25, 0.35))))
        ends = [(0, False), (1, False), (0, True), (1, True)]
        assert [(one.share, one.improved) for one in plan[:many]] == ends[:many]
        assert [one.redrawn for one in plan] == [False] * many + [True] * (40 - many)
        assert len({one.seed for one in plan}) == 41 - many
        for name, low, high in (("share", 0.0, 1.0), ("coursing", 0.15, 0.65), ("depth", 0.25, 0.35)):
            values = np.sort([getattr(one, name) for one in plan[many:]])
            assert low <= values[0] < low + 0.1 * (high - low)
            assert high - 0.1 * (high - low) < values[-1] <= high
            assert np.diff(values).max() < 0.15 * (high - low)


def test_what_falls_or_is_half_empty_beats_nobody(made):
    good = made.alternatives[made.non_dominated[0]]
    better = replace(good, match=replace(good.match, imposition=0.0), interlock=2.0)
    for faulty in (replace(better, verdict="unstable"), replace(better, verdict="undecided"),
                   replace(better, match=replace(better.match, gap_of_wall=FAST.gap + 0.02))):  # fmt: skip
        assert _judged([faulty, good], FAST, ()).non_dominated == (1,)
    assert _judged([better, good], FAST, ()).non_dominated == (0,)
    assert first_line(_judged([good, better], FAST, ())) == (
        "2 walls at gap 0.35: wall 2 beats all others, 0.0 % carved away with J 2.000"
    )
    none = _judged([replace(good, verdict="unstable")], FAST, ())
    assert none.non_dominated == ()
    assert "none of them is shown to stand with so little void" in first_line(none)
    assert tradeoff_svg(none).count("l10 10m0 -10l-10 10") == 2  # the wall, and in the legend
    apart = replace(good, match=replace(good.match, imposition=0.25), interlock=0.5), replace(better, interlock=0.1)
    said = "2 walls at gap 0.35: from 0.0 % carved away with J 0.100 to 25.0 % carved away with J 0.500; 2 of them are"
    assert first_line(_judged(apart, FAST, ())) == f"{said} not beaten by another"


def bits(found: Tradeoff) -> list[bytes]:
    return [
        part.tobytes()
        for one in found.alternatives
        for part in (
            *(block.vertices for block in one.wall.assembly.blocks),
            *(x for p in one.match.placements for x in (p.rotation, p.shift, np.array([p.stone, p.cell, p.shared]))),
            np.array([one.imposition, one.gap, one.interlock]),
        )
    ]


def test_others_do_it_to_the_same_bits_and_nothing_is_done_twice(made, stock, wall, tmp_path):
    with beside(2) as executor:
        shared = Checkpoints(tmp_path / "parts", executor)
        assert bits(tradeoff(stock, wall, WANTED, FAST, shared)) == bits(made)
    assert (shared.found, shared.made) == (0, 4)
    again = Checkpoints(tmp_path / "parts")
    assert bits(tradeoff(stock, wall, WANTED, FAST, again)) == bits(made)
    assert (again.found, again.made) == (4, 0)


def test_a_wall_that_cannot_be_drawn_is_left_out_and_said(stock, wall, monkeypatch):
    from cyclopean.design.matching import tradeoff as module

    def broken(settings, ratio=None):
        raise InputError("sliver: too many")

    monkeypatch.setattr(module, "draw_pattern", broken)
    found = tradeoff(stock, wall, TradeoffSettings(3, rounds=1), FAST)
    assert (len(found), len(found.notes)) == (2, 1)
    assert found.notes[0].startswith("one wall of 3 is left out (seed 6): sliver: too many")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"walls": 1}, "walls 1: expected a whole number from 2 to 500"),
        ({"rounds": 0}, "rounds: expected a whole number of at least 1"),
        ({"depths": (0.3, 0.2)}, "depths: expected a least depth above 0 and no greater one"),
        ({"weight": 2.0}, "weight: has no say in a trade-off"),
    ],
)
def test_refusals(stock, wall, options, said):
    with pytest.raises(cyclopean.InputError, match=said):
        cyclopean.tradeoff(stock, wall, **options)


def test_keywords_are_those_of_the_settings():
    kept = {field.name for kind in (MatchSettings, TradeoffSettings, StoneReading) for field in fields(kind)}
    assert set(TradeoffKeywords.__annotations__) == kept - {"weight", "walls"}


def test_a_wall_that_was_not_drawn_is_refused(stock):
    with pytest.raises(cyclopean.InputError, match=r"tradeoff: the wall: does not say how it was drawn"):
        cyclopean.tradeoff(stock, cyclopean.wall(2, 2), 3)


def test_files_words_and_what_carve_makes_of_them(run, made, stock, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("out").mkdir()
    from cyclopean.design.stones.inventory import Inventory
    from cyclopean.io import write_stones

    write_stones("stones.obj", Inventory(tuple(stock)))
    asked = []

    def traded(inventory, wall, settings, wanted, *_):
        asked.append((wall, settings.gap, wanted))
        return StoneTradeoff(made, inventory.stones)

    monkeypatch.setattr("cyclopean.cli.match.traded", traded)
    status, out, _ = run("match", "stones.obj", "wall.json", "--out", "out", "--tradeoff", 4, "--gap", 0.35,
                         "--rounds", 1, "--depths", "0.25,0.35", "--report", "page.html", "--units", "m")  # fmt: skip
    assert (status, asked) == (0, [("wall.json", 0.35, WANTED)])
    assert out.startswith("4 walls at gap 0.35: ")
    assert sum(line.startswith(" *") for line in out.splitlines()) == len(made.non_dominated)
    data = json.loads(Path("out/tradeoff.json").read_text(encoding="utf-8"))
    assert [row["non_dominated"] for row in data["alternatives"]] == [k in made.non_dominated for k in range(4)]
    assert [row["J"] for row in data["alternatives"]] == [one.interlock for one in made.alternatives]
    for row in data["alternatives"]:
        kept = json.loads(Path("out", row["match"]).read_text(encoding="utf-8"))
        assert (kept["Lambda"], kept["wall"]) == (row["Lambda"], row["wall"])
        assert (kept["settings"]["gap"], kept["settings"]["negotiate"]) == (0.35, row["asked"]["negotiate"])
        assert Path("out", row["picture"]).read_text(encoding="utf-8").startswith("<svg")
    curve = Path("out/tradeoff.svg").read_text(encoding="utf-8")
    page = Path("page.html").read_text(encoding="utf-8")
    assert curve in page
    assert all(f">{k}</text>" in curve for k in range(1, 5))
    status, out, _ = run("carve", "out/match-4.json", "--out", "out")
    assert status == 0
    assert f"Lambda {made.alternatives[3].imposition:.4f}" in out


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        (("--tradeoff", "1"), "--tradeoff 1: expected a whole number from 2 to 500"),
        (("--tradeoff", "4", "--negotiate", "1"), "--negotiate: a --tradeoff tries shares from 0 to 1"),
        (("--tradeoff", "4", "--weight", "2"), "--weight: has no say in a --tradeoff"),
        (("--tradeoff", "4", "--supports", "below=1"), "--supports: has no say in a --tradeoff"),
        (("--tradeoff", "4", "--depths", "2"), "--depths: '2' should be two numbers"),
        (("--depths", "0.2,0.3"), "--depths: has no say without --tradeoff"),
    ],
)
def test_refused_commands(run, tmp_path, monkeypatch, extra, said):
    monkeypatch.chdir(tmp_path)
    status, out, err = run("match", "stones.obj", "wall.json", "--out", ".", *extra)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert said in err
    assert list(tmp_path.iterdir()) == []
