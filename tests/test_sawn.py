"""Stones that are sawn new: which they are, that they get no stone, and that they stand in the wall as drawn.

Mutants killed by hand: cells numbered by the whole wall in a negotiation, sawn blocks left out of the carved wall,
voussoirs without their keystone.
"""

import json

import numpy as np
import pytest

import cyclopean
from cyclopean.design.matching.cells import cells_of
from cyclopean.design.matching.match import MatchSettings, match_stones
from cyclopean.design.matching.negotiation import Moving, negotiate
from cyclopean.design.matching.sawn import sawn_blocks
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.design.walls.openings import Opening
from cyclopean.errors import InputError
from cyclopean.io import write_stones

DOOR = Opening(0.6, 0.6, 0.75, head="arch")
QUICK = MatchSettings(points=256, shortlist=2, starts=1, climbs=0)


@pytest.fixture(scope="module")
def wall():
    return cyclopean.polygonal_wall(width=1.8, height=1.2, columns=5, rows=3, courses=3, openings=(DOOR,))


def new_in(wall, asked="voussoirs"):
    ids = [block.id for block in wall.assembly.blocks]
    return sawn_blocks(ids, np.array([b.fixed for b in wall.assembly.blocks]), wall.pattern.kind, asked)


def some_stones(wall, count):
    mean = float(np.mean(wall.assembly.mass.volume[1:]))
    return quarry(count, seed=2, volume=(mean, 2.0 * mean), detail=1)


def test_words_are_kinds_ids_and_patterns(wall):
    kinds = np.array(["ground", *wall.pattern.kind])
    assert new_in(wall).tolist() == np.flatnonzero((kinds == "voussoir") | (kinds == "keystone")).tolist()
    ids = [block.id for block in wall.assembly.blocks]
    first = [k for k, name in enumerate(ids) if name.startswith("c01-")]
    assert new_in(wall, " c01-* ,").tolist() == first
    assert new_in(wall, f"voussoirs,{ids[1]}").tolist() == sorted({1, *new_in(wall).tolist()})
    assert new_in(wall, "").tolist() == []
    for word in ("lintels", "granite", "ground"):
        with pytest.raises(InputError, match=f"^sawn {word}: no stone of the wall is one"):
            new_in(wall, word)
    with pytest.raises(InputError, match="does not say what its stones are for"):
        sawn_blocks(["a"], np.array([False]), (), "quoins")
    with pytest.raises(InputError, match="a support or sawn"):
        cells_of(wall.assembly, None, range(1, len(ids)))


def test_the_others_are_matched_as_if_the_sawn_were_held(wall):
    new, stones = new_in(wall), some_stones(wall, 20)
    held = np.isin(np.arange(len(wall.assembly)), [0, *new])
    asked, alike = (match_stones(stones, cells, QUICK) for cells in (
        cells_of(wall.assembly, None, new), cells_of(wall.assembly, held)
    ))  # fmt: skip
    assert asked.imposition == alike.imposition
    assert asked.gap_of_wall == alike.gap_of_wall
    assert [(p.stone, p.cell) for p in asked.placements] == [(p.stone, p.cell) for p in alike.placements]


def test_a_negotiation_leaves_them_out(wall):
    """Cells move, the arch stays where it was drawn, and every stone lies about the cell that it is for."""
    new, stones = new_in(wall), some_stones(wall, 24)
    done = negotiate(stones, wall, QUICK, Moving(rounds=2, sawn=tuple(new.tolist())))
    cells = cells_of(done.wall.assembly, None, new)
    assert {int(cells.block[p.cell]) for p in done.match.placements} <= set(range(1, len(wall.assembly))) - {*new}
    mass, before = done.wall.assembly.mass, wall.assembly.mass  # joints of the field end elsewhere on the ring
    np.testing.assert_allclose(mass.centroid[new], before.centroid[new], atol=1e-9)
    np.testing.assert_allclose(mass.volume[new], before.volume[new], rtol=1e-9)
    moved = [
        k for k in range(1, len(wall.assembly))
        if not np.array_equal(done.wall.assembly.mass.centroid[k], wall.assembly.mass.centroid[k])
    ]  # fmt: skip
    assert moved
    size = float(np.cbrt(cells.volume.mean()))
    for p in done.match.placements:
        centre = p.rotation @ stones[p.stone].centroid + p.shift
        assert np.linalg.norm(centre - cells.centre[p.cell]) < 0.5 * size
        assert p.shared > 0.4 * float(cells.volume[p.cell])


def test_carved_walls_hold_them_as_drawn(wall, tmp_path, monkeypatch, run):
    """From the command line and in memory: the files carry them from the match to the wall as it is built."""
    monkeypatch.chdir(tmp_path)
    cyclopean.save(wall, "wall.json")
    stones = some_stones(wall, 20)
    write_stones("stones.obj", Inventory(stones))
    (tmp_path / "m").mkdir()
    (tmp_path / "c").mkdir()
    status, out, _ = run("match", "stones.obj", "wall.json", "--out", "m", "--sawn", "voussoirs", "--points", "256")
    assert status == 0
    new = new_in(wall)
    assert f"sawn     {len(new)} stones new, as drawn" in out
    data = json.loads((tmp_path / "m" / "match.json").read_text())
    ids = [block.id for block in wall.assembly.blocks]
    assert [row["cell"] for row in data["sawn"]] == [ids[k] for k in new]
    volume = sum(row["volume"] for row in data["sawn"])
    assert volume == pytest.approx(float(wall.assembly.mass.volume[new].sum()), rel=1e-9)
    assert not {row["cell"] for row in data["placements"]} & {ids[k] for k in new}
    found = cyclopean.carve("m")
    assert found.built.sawn == tuple(ids[k] for k in new)
    built = {block.id: block for block in found.assembly.blocks}
    for k in new.tolist():
        np.testing.assert_allclose(built[ids[k]].vertices, wall.assembly.blocks[k].vertices, atol=1e-9)
        assert not built[ids[k]].fixed
    same = cyclopean.carve(cyclopean.match(stones, wall, sawn="voussoirs", points=256))
    assert same.built.sawn == found.built.sawn
    data["sawn"][0]["cell"] = "nobody"
    (tmp_path / "m" / "match.json").write_text(json.dumps(data))
    status, _, err = run("carve", "m", "--out", "c")
    assert status == 2
    assert "has no block 'nobody'" in err


def test_what_goes_not_together(run, wall, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cyclopean.save(wall, "wall.json")
    write_stones("stones.obj", Inventory(some_stones(wall, 3)))
    (tmp_path / "m").mkdir()
    for more, line in (
        (("--sawn", "lintels"), "--sawn lintels: no stone"),
        (("--tradeoff", "3", "--sawn", "c01-*"), "--sawn: a --tradeoff"),
    ):
        status, _, err = run("match", "stones.obj", "wall.json", "--out", "m", *more)
        assert status == 2
        assert line in err
