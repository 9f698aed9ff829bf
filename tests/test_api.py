"""The ten names: files and objects are the same to them, and keywords the same as settings."""

import inspect
import json
import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cyclopean
from cyclopean import analysis
from cyclopean.analysis import Live, LiveLoad
from cyclopean.api.checking import CheckOptions, SequenceOptions
from cyclopean.api.inputs import Reading, StoneReading
from cyclopean.api.keywords import (
    CheckKeywords,
    LimitKeywords,
    LineKeywords,
    MatchKeywords,
    SequenceKeywords,
    SettleKeywords,
)
from cyclopean.api.limiting import LimitOptions
from cyclopean.api.stones import MatchOptions
from cyclopean.cli import main
from cyclopean.design.construction import sequence as sequencing
from cyclopean.design.matching.match import MatchSettings
from cyclopean.design.rubble.settle import SettleSettings
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.walls.line_work import LineReading
from cyclopean.options import options_of
from laws import examples

TEN = "Assembly read_model check limit polygonal_wall match carve settle build_sequence save".split()
PAGE = Path(__file__).parents[1] / "docs" / "api.md"
ARCH = cyclopean.arch(8, span=2.0, thickness=0.3)


@pytest.fixture(scope="module")
def wall():
    return cyclopean.polygonal_wall(width=1.2, height=0.8, columns=3, rows=2, seed=3)


@pytest.fixture(scope="module")
def stones(wall):
    volume = wall.assembly.mass.volume[1:].mean()
    return quarry(8, seed=1, volume=(0.6 * volume, 3.0 * volume), detail=1)


@pytest.fixture(scope="module")
def found(wall, stones):
    return cyclopean.match(stones, wall, weight=2.0, points=128)


@pytest.fixture(scope="module")
def carved(found):
    return cyclopean.carve(found)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_ten_are_there_and_documented() -> None:
    assert set(TEN) <= set(cyclopean.__all__)
    rows = re.findall(r"^\| `(\w+)(?:\(.*?\))?` \|", PAGE.read_text().split("**Why these.**")[0], re.MULTILINE)
    assert rows == TEN
    said = PAGE.read_text()
    assert [name for name in cyclopean.__all__ if f"`{name}" not in said] == []
    listed = re.search(r"needed first: (.*)\.", " ".join((cyclopean.__doc__ or "").split()))
    assert listed is not None
    assert listed[1].replace(" and ", ", ").split(", ") == TEN


KINDS = {
    cyclopean.check: (CheckKeywords, analysis.Settings, Reading, CheckOptions),
    cyclopean.limit: (LimitKeywords, LimitOptions, analysis.Settings, Reading),
    cyclopean.build_sequence: (SequenceKeywords, analysis.Settings, Reading, SequenceOptions),
}


@pytest.mark.parametrize("function", KINDS, ids=lambda one: one.__name__)
def test_keywords_are_the_options_that_are_described_once(function) -> None:
    """The signature, the documentation and the types that a checker sees name the same options."""
    typed, *kinds = KINDS[function]
    shown = inspect.signature(function).parameters
    described = {name for kind in kinds for name in options_of(kind)}
    own = {"model", "settings", "live", "progress", "executor", "watch"}
    assert set(shown) - own == set(typed.__annotations__) <= described
    for name in set(shown) - own:
        assert f"        {name} : " in function.__doc__
    if function is cyclopean.check:
        assert described == set(typed.__annotations__)
    with pytest.raises(TypeError, match="unexpected keyword argument 'friction'"):
        function(ARCH, friction=0.7)


@pytest.mark.parametrize(
    ("keywords", "kept", "more"),
    [(MatchKeywords, MatchSettings, (MatchOptions, StoneReading)), (SettleKeywords, SettleSettings, (StoneReading,))],
)
def test_types_are_of_the_fields_of_the_settings(keywords, kept, more) -> None:
    named = {field.name for kind in (kept, *more) for field in fields(kind)}
    assert set(keywords.__annotations__) == named


def test_nothing_of_a_pattern_is_left_out() -> None:
    own = {"settings", "surface", "depth", "batter", "density", "mu", "warped", "improve"}
    keywords = set(inspect.signature(cyclopean.polygonal_wall).parameters) - {"drawing", "options"}
    assert set(LineKeywords.__annotations__) | {"drawing"} == {field.name for field in fields(LineReading)}
    assert keywords - own == {field.name for field in fields(cyclopean.PatternSettings)} - {"outline"}  # of a surface


def test_a_keyword_says_what_the_settings_say() -> None:
    by_keyword = cyclopean.check(ARCH, mu=0.7, density=2500.0, tilt=5)
    by_settings = cyclopean.check(ARCH, cyclopean.Settings(mu=0.7, density=2500.0, tilt=(5.0, 0.0)))
    assert by_keyword.certificate == by_settings.certificate == analysis.check(
        ARCH, cyclopean.Settings(mu=0.7, density=2500.0, tilt=(5.0, 0.0))
    ).certificate  # fmt: skip
    over = cyclopean.check(ARCH, cyclopean.Settings(mu=0.7, method="rbe"), mu=0.2)
    assert over.method == "rbe"
    assert set(over.contacts.mu) == {0.2}


@given(mu=st.floats(0.05, 2.0), height=st.floats(0.3, 3.0))
@settings(max_examples=examples(10), deadline=None)
def test_a_pushed_block_slides_or_tips(mu, height) -> None:
    """By hand: it slides at mu, tips at base / height; whichever is first."""
    block = cyclopean.stack(1, (1.0, 1.0, height))
    answer = cyclopean.limit(block, push=(1.0, 0.0, 0.0), mu=mu)
    assert answer.lower is not None
    assert answer.lower == pytest.approx(min(mu, 1.0 / height), rel=1e-5, abs=1e-5)


def test_limit_takes_each_kind_of_load() -> None:
    block = cyclopean.stack(1)
    name = block.blocks[-1].id
    weight = 2400.0 * 9.80665
    assert cyclopean.limit(block, tilt=0.0, mu=0.5).value == pytest.approx(0.5, rel=1e-5)
    assert cyclopean.limit(block, loads={name: (1.0, 0.0, 0.0)}, mu=0.5).value == pytest.approx(0.5 * weight, rel=1e-5)
    live = Live(loads=(LiveLoad(name, (1.0, 0.0, 0.0)),))
    assert cyclopean.limit(block, live, mu=0.5).value == pytest.approx(0.5 * weight, rel=1e-5)
    with pytest.raises(cyclopean.InputError, match="seconds -1: expected a positive number"):
        cyclopean.limit(block, push=(1.0, 0.0, 0.0), seconds=-1.0)
    with pytest.raises(cyclopean.InputError, match="exactly one"):
        cyclopean.limit(block, push=(1.0, 0.0, 0.0), tilt=0.0)
    with pytest.raises(cyclopean.InputError, match="live: says what grows"):
        cyclopean.limit(block, live, tilt=0.0)


def test_a_file_is_the_same_as_what_is_in_it(here) -> None:
    cyclopean.save(ARCH, "arch.json")
    by_path = cyclopean.check("arch.json", mu=0.7)
    assert by_path.certificate == cyclopean.check(ARCH, mu=0.7).certificate
    assert by_path.warnings == cyclopean.check(Path("arch.json"), mu=0.7).warnings == ()
    cyclopean.save(ARCH, "arch.obj")
    assumed = cyclopean.check("arch.obj", mu=0.7, supports="ids=springer-left,springer-right").warnings
    assert any("metres assumed" in line for line in assumed)
    small = cyclopean.check("arch.obj", mu=0.7, supports="ids=springer-left,springer-right", units="mm")
    assert small.assembly.size == pytest.approx(1e-3 * ARCH.size)
    assert cyclopean.build_sequence("arch.json", mu=0.7).order == cyclopean.build_sequence(ARCH, mu=0.7).order


def test_whatever_has_a_structure_can_be_asked_about(wall, found, carved) -> None:
    for thing in (wall, found, carved, cyclopean.check(wall, method="rbe")):
        assert cyclopean.check(thing, method="rbe").assembly is thing.assembly
    assert found.assembly is wall.assembly


def test_the_stages_have_their_own_time(monkeypatch) -> None:
    seen = []
    monkeypatch.setattr(sequencing, "build_sequence", lambda model, chosen, *_: seen.append(chosen) or made)
    made = cyclopean.Assembly(())
    cyclopean.build_sequence(ARCH)
    cyclopean.build_sequence(ARCH, seconds=3.0)
    cyclopean.build_sequence(ARCH, cyclopean.Settings())
    assert [chosen.seconds for chosen in seen] == [sequencing.SECONDS, 3.0, 60.0]


def test_what_a_match_says_is_exact(found, carved) -> None:
    assert found.imposition == found.match.imposition == pytest.approx(carved.total.imposition, abs=1e-9)
    assert found.gap == pytest.approx(carved.total.gap, abs=1e-9)
    assert len(carved.carved) == len(found.match)
    assert carved.assembly is carved.built.assembly


def test_stones_of_a_file_are_the_same(found, stones, wall, here) -> None:
    cyclopean.save(found, "match.json")
    again = cyclopean.match("stones.obj", "wall.json", weight=2.0, points=128, units="m")
    assert again.imposition == pytest.approx(found.imposition, abs=1e-12)
    assert cyclopean.match(Inventory(stones), wall, weight=2.0, points=128).imposition == found.imposition
    assert cyclopean.match(list(stones), wall, weight=2.0, points=128).imposition == found.imposition


def test_a_match_is_carved_from_its_file_too(found, carved, here) -> None:
    cyclopean.save(found, "match.json")
    assert cyclopean.carve(here).total == carved.total
    assert cyclopean.carve("match.json").total == carved.total
    assert main(["carve", ".", "--out", ".", "--method", "rbe"]) == 0, "the command reads it as well"
    cyclopean.save(cyclopean.stack(2), "wall.json")
    with pytest.raises(cyclopean.InputError, match=r"match\.json: the wall .* has changed"):
        cyclopean.carve(here)


def test_cells_can_move(stones, wall, here) -> None:
    cyclopean.save(wall, "drawn.json")
    moved = cyclopean.match(stones, wall, weight=2.0, points=64, negotiate=0.5, rounds=1)
    assert moved.drawn is not None
    assert moved.interlock == tuple(cyclopean.interlock(w).interlock.score for w in (wall, moved))
    assert moved.assembly.blocks[1].id == moved.drawn.assembly.blocks[1].id
    by_path = cyclopean.match(stones, "drawn.json", weight=2.0, points=64, negotiate=0.5, rounds=1)
    assert by_path.imposition == pytest.approx(moved.imposition, abs=1e-9)


def test_settle_lays_stones_and_warns(stones, here) -> None:
    cyclopean.save(cyclopean.Assembly(()), "nothing.json")
    quick = {"length": 0.8, "ways": 1, "yaws": 2}
    laid = cyclopean.settle(stones[:4], **quick)
    assert len(laid.laid) + len(laid.left_over) == 4
    from cyclopean.io import write_stones

    write_stones("stones.obj", Inventory(stones[:4]))
    with pytest.warns(UserWarning, match="metres assumed"):
        by_path = cyclopean.settle("stones.obj", **quick)
    assert [x.stone for x in by_path.laid] == [x.stone for x in laid.laid]


def test_every_ending_is_written_and_no_other(wall, found, carved, here) -> None:
    result = cyclopean.check(wall, method="rbe")
    things = {
        "model": (wall.assembly, ".json .obj .stl .ply .glb"),
        "drawn": (wall, ".json .glb"),
        "result": (result, ".json .html"),
        "limit": (cyclopean.limit(ARCH, tilt=0.0), ".json .html"),
        "proof": (result.certificate, ".json"),
        "order": (cyclopean.build_sequence(wall, method="rbe"), ".json .html .dot"),
        "match": (found, ".json .html"),
        "cut": (carved, ".csv .svg .json .glb"),
    }
    for name, (thing, endings) in things.items():
        for ending in endings.split():
            file = here / f"{name}{ending}"
            cyclopean.save(thing, file)
            assert file.stat().st_size > 100
        with pytest.raises(cyclopean.InputError, match=rf"{name}\.xyz: a \w+ is written as .*\.json"):
            cyclopean.save(thing, f"{name}.xyz")
    assert cyclopean.verify_file("proof.json").proved
    assert json.loads((here / "result.json").read_text())["verdict"] == result.verdict
    assert "drawing" in json.loads((here / "drawn.json").read_text()), "how it was drawn is kept"
    assert not list(here.glob("*.xyz"))


def test_what_cannot_be_written_is_refused(found, here) -> None:
    with pytest.raises(cyclopean.InputError, match="save: a ndarray cannot be written"):
        cyclopean.save(np.zeros(3), "array.json")
    with pytest.raises(cyclopean.InputError, match="give the match another name"):
        cyclopean.save(found, "wall.json")
    assert not (here / "stones.obj").exists(), "half of it was written"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w, s: cyclopean.check(w, mu=-1.0), r"^mu -1: expected a number >= 0$"),
        (lambda w, s: cyclopean.check(w, beta_min=-1.0), r"^beta_min"),
        (lambda w, s: cyclopean.check(w, method="cra", tension=1e5), r"^tension 100000: .*use method rbe$"),
        (lambda w, s: cyclopean.check(w, units="mm"), r"^units: 'mm' is for files"),
        (
            lambda w, s: cyclopean.check(3),
            r"^model: expected a file, an Assembly, a wall, or bodies: .* faces; got int$",
        ),
        (lambda w, s: cyclopean.check("missing.json"), r"^missing\.json: no such file"),
        (lambda w, s: cyclopean.polygonal_wall(width=-1.0), r"^width"),
        (lambda w, s: cyclopean.match(s, w, gap=0.2, weight=1.0), r"^weight: gap finds it"),
        (lambda w, s: cyclopean.match(s, w, rounds=2), r"^rounds: has no say"),
        (lambda w, s: cyclopean.match(s, w, negotiate=1.0, supports="ids=a"), r"^supports: has no say"),
        (
            lambda w, s: cyclopean.match(s, w.assembly, negotiate=1.0),
            r"^negotiate: .* cells can move only in a wall from",
        ),
        (lambda w, s: cyclopean.match([1, 2], w), r"^stones: expected a folder, .* got list$"),
        (lambda w, s: cyclopean.match(s, w, units="mm"), r"^units: 'mm' is for files"),
        (lambda w, s: cyclopean.match("missing", w), r"missing"),
        (lambda w, s: cyclopean.settle(s, length=-1.0), r"^length"),
        (lambda w, s: cyclopean.carve("missing"), r"missing"),
    ],
)
def test_refusals_name_the_keyword(call, message, wall, stones, here) -> None:
    with pytest.raises(cyclopean.InputError, match=message) as refused:
        call(wall, stones)
    assert "--" not in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_depth_below_zero_is_refused(found) -> None:
    with pytest.raises(cyclopean.InputError, match="least: nan is not a depth"):
        cyclopean.carve(found, least=float("nan"))
