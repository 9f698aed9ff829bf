"""Reading and writing inventories: folders, files of many, what is passed over, and the cache.

Mutants killed: a corrupt file ends the reading; units ignored, or not part of the cache's key; the cache trusted by
name, not by content; a broken pack raised; ids without the file's name.
"""

import os
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from cyclopean import design
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.stone import stone_of
from cyclopean.errors import InputError
from cyclopean.io import inventory_dict, read_stones, write_model, write_stones
from cyclopean.io import stones as module
from cyclopean.io.stone_cache import cache_folder
from fixtures_stones import NAMES, SCANS, boulder, box, needs_scans, obj, subdivided


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    """No test reads or writes the user's cache."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def yard(tmp_path):
    """A folder of three stones."""
    folder = tmp_path / "yard"
    folder.mkdir()
    for k in range(3):
        (folder / f"s{k}.obj").write_text(obj(*boulder(k)))
    return folder


@pytest.fixture
def opened(monkeypatch):
    """Names of the files that were really read, not taken from the cache."""
    names = []
    real = module._read
    monkeypatch.setattr(module, "_read", lambda file, *rest: (names.append(file.name), real(file, *rest))[1])
    return names


def same(one, two):
    arrays = ("vertices", "triangles", "centroid", "axes", "half")
    single = ("id", "volume", "hull_volume", "area", "density")
    return all(
        all(np.array_equal(getattr(a, n), getattr(b, n)) for n in arrays)
        and all(getattr(a, n) == getattr(b, n) for n in single)
        for a, b in zip(one.stones, two.stones, strict=True)
    )


def test_a_folder(yard):
    inventory, warnings = read_stones(yard)
    assert [stone.id for stone in inventory.stones] == ["s0", "s1", "s2"]
    assert (inventory.notes, inventory.refused, inventory.source) == ((), (), "yard")
    assert warnings == (f"{yard}: no file says its units; metres assumed (`units`)",)
    assert read_stones(yard, "m")[1] == ()
    for k, stone in enumerate(inventory.stones):
        wanted = stone_of("s", *boulder(k))
        assert stone.vertices.tolist() == wanted.vertices.tolist()
        assert stone.triangles.tolist() == wanted.triangles.tolist()
        assert (stone.volume, stone.hull_volume, stone.area) == (wanted.volume, wanted.hull_volume, wanted.area)


def test_files_of_other_kinds_are_passed_over_and_counted(yard):
    (yard / "photo.jpg").write_bytes(b"x")
    (yard / ".hidden.obj").write_bytes(b"x")
    (yard / "folder.obj").mkdir()
    inventory, _ = read_stones(yard, "m")
    assert len(inventory) == 3
    assert inventory.notes == (f"{yard}: passed over 3 entries that are no mesh file",)


def test_one_corrupt_file_is_named_and_the_rest_goes_on(yard):
    (yard / "s1.obj").write_text("v 1 2 three\nf 1 1 1\n")
    (yard / "s9.stl").write_bytes(b"")
    for _ in range(2):  # the second time out of the cache
        inventory, warnings = read_stones(yard, "m")
        assert [stone.id for stone in inventory.stones] == ["s0", "s2"]
        assert inventory.refused == (
            f"{yard}/s1.obj: line 1: a vertex needs three numbers, 'v x y z'",
            f"{yard}/s9.stl: the file is empty",
        )
        assert warnings == tuple(f"{line}; left out" for line in inventory.refused)
    with pytest.raises(InputError, match=r"s1\.obj: line 1: .*1 more cannot be used either"):
        read_stones(yard, "m", strict=True)


def test_no_stone_is_left(tmp_path):
    with pytest.raises(InputError, match="no stones in this folder"):
        read_stones(tmp_path)
    with pytest.raises(InputError, match="no such file"):
        read_stones(tmp_path / "missing")
    vertices, triangles = box()
    (tmp_path / "open.obj").write_text(obj(vertices, triangles[1:]))
    with pytest.raises(InputError, match=r"open\.obj: is open: a hole 3\.41 m round near .*; no stone is left"):
        read_stones(tmp_path)
    with pytest.raises(InputError, match="'furlong' is not a unit"):
        read_stones(tmp_path, "furlong")


def test_open_crossing_and_empty_stones_are_refused_by_name(yard):
    vertices, triangles = boulder()
    pulled = vertices.copy()
    pulled[3] *= -5.0
    (yard / "a.obj").write_text(obj(vertices, triangles[20:]))
    (yard / "b.obj").write_text(obj(pulled, triangles))
    (yard / "c.obj").write_text(obj(vertices * [1, 1, 0], triangles))
    inventory, _ = read_stones(yard, "m")
    assert [line.rpartition("/")[2].split(" ")[:3] for line in inventory.refused] == [
        ["a.obj:", "is", "open:"],
        ["b.obj:", "crosses", "itself"],
        ["c.obj:", "has", "no"],
    ]
    assert len(inventory) == 3


def test_repairs_are_told(yard):
    vertices, triangles = boulder(0, detail=3)
    (yard / "s1.obj").write_text(obj(vertices, triangles[1:, ::-1]))
    inventory, warnings = read_stones(yard, "m")
    assert len(inventory) == 3
    assert warnings == ()
    (note,) = inventory.notes
    assert note.startswith(f"{yard}/s1.obj: 1 tiny hole closed, 0.")
    assert note.endswith("m round; was inside out and was turned")


def test_many_in_one_file(tmp_path):
    one, two = boulder(0), boulder(1)
    many = obj(*one, name="low") + obj(*two, name="high", before=len(one[0]))
    (tmp_path / "many.obj").write_text(many)
    (tmp_path / "solo.obj").write_text(obj(*one, name="whatever"))
    inventory, _ = read_stones(tmp_path, "m")
    assert [stone.id for stone in inventory.stones] == ["many-low", "many-high", "solo"]
    alone, _ = read_stones(tmp_path / "many.obj", "m")
    assert [stone.id for stone in alone.stones] == ["low", "high"]
    assert alone.source == "many.obj"
    assert read_stones(tmp_path / "solo.obj", "m")[0].stones[0].id == "solo"


def test_pieces_of_one_nameless_mesh_are_stones(tmp_path):
    one, two = boulder(0), boulder(1)
    mesh = np.concatenate([one[0], two[0] + 2.0]), np.concatenate([one[1], two[1] + len(one[0])])
    (tmp_path / "soup.obj").write_text(obj(*mesh))
    inventory, _ = read_stones(tmp_path / "soup.obj", "m")
    assert [stone.id for stone in inventory.stones] == ["soup-0", "soup-1"]
    named = obj(*mesh, name="pair") + obj(*one, name="third", before=len(mesh[0]))
    (tmp_path / "named.obj").write_text(named)
    inventory, _ = read_stones(tmp_path / "named.obj", "m")
    assert [stone.id for stone in inventory.stones] == ["third"]
    assert inventory.refused == (f"{tmp_path}/named.obj: stone 'pair': is in 2 pieces; a stone is one",)


def test_stones_that_touch_in_one_mesh(tmp_path):
    wall = design.wall(3, 2)
    inventory = Inventory(tuple(stone_of(b.id, b.vertices, fans(b.faces)) for b in wall.blocks))
    write_stones(tmp_path / "wall.stl", inventory)
    again, _ = read_stones(tmp_path / "wall.stl", "m")
    assert [s.volume for s in again.stones] == pytest.approx([s.volume for s in inventory.stones], rel=1e-12)
    assert again.refused == ()


def fans(faces):
    return np.array([(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)])


def test_two_files_of_one_name(tmp_path):
    inventory = Inventory((stone_of("a", *boulder()),))
    write_stones(tmp_path / "a.obj", inventory)
    write_stones(tmp_path / "a.ply", inventory)
    found, _ = read_stones(tmp_path, "m")
    assert [stone.id for stone in found.stones] == ["a", "a-2"]
    assert found.notes == (f"{tmp_path}/a.ply: the name 'a' is taken; this stone is 'a-2'",)


def test_polygons_that_are_not_convex(tmp_path):
    hook = [(0, 0), (4, 0), (4, 3), (3, 3), (3, 1), (0, 1)]
    corner = [(*p, z) for z in (0, 1) for p in hook]
    faces = [(5, 4, 3, 2, 1, 0), (6, 7, 8, 9, 10, 11), *((k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k) for k in range(6))]
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in corner)
    text += "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces)
    for turn in range(6):  # whichever corner a face begins at
        rolled = [tuple(np.roll(f, turn)) for f in faces]
        lines = "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in rolled)
        (tmp_path / "hook.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in corner) + lines)
        inventory, _ = read_stones(tmp_path / "hook.obj", "m")
        assert inventory.stones[0].volume == pytest.approx(6.0, rel=1e-14)
        assert inventory.stones[0].area == pytest.approx(2 * 6 + 14, rel=1e-14)


def test_units(yard):
    metre = read_stones(yard, "m")[0].stones[0]
    milli = read_stones(yard, "mm")[0].stones[0]
    assert milli.volume == pytest.approx(1e-9 * metre.volume, rel=1e-12)  # and not out of the cache for metres


@pytest.mark.parametrize(
    ("scale", "said", "suspected"),
    [
        (1000.0, "m", "mm"),
        (100.0, "m", "cm"),
        (1.0, "mm", "m"),
        (3000.0, "cm", "mm"),
        (1.0, "m", None),
        (1e7, "m", "?"),
    ],
)
def test_a_slip_of_units_is_suspected_aloud(tmp_path, scale, said, suspected):
    (tmp_path / "s.obj").write_text(obj(scale * boulder()[0], boulder()[1]))
    _, warnings = read_stones(tmp_path, said)
    if suspected is None:
        assert warnings == ()
    elif suspected == "?":
        assert "which no stone is" in warnings[0]
    else:
        assert warnings[0].endswith(f": `units` {suspected}")
        assert read_stones(tmp_path, suspected)[1] == ()


def test_a_model_is_an_inventory_too(tmp_path):
    write_model(tmp_path / "wall.json", design.wall(3, 2, density=2000.0))
    inventory, warnings = read_stones(tmp_path / "wall.json")
    assert len(inventory) == len(design.wall(3, 2))
    assert warnings == ()
    assert {stone.density for stone in inventory.stones} == {2000.0}
    assert [stone.id for stone in inventory.stones] == [block.id for block in design.wall(3, 2).blocks]


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "glb"])
def test_written_to_one_file_and_read_again(tmp_path, suffix):
    inventory = Inventory(tuple(stone_of(f"stone {k}", boulder(k)[0] + 3 * k, boulder(k)[1]) for k in range(3)))
    write_stones(tmp_path / f"all.{suffix}", inventory)
    again, warnings = read_stones(tmp_path / f"all.{suffix}", None if suffix == "glb" else "m")
    assert warnings == ()
    assert again.notes == ()
    assert [stone.id for stone in again.stones] == [stone.id for stone in inventory.stones]
    single = 1e-5 if suffix == "glb" else 1e-12
    assert [s.volume for s in again.stones] == pytest.approx([s.volume for s in inventory.stones], rel=single)


def test_written_to_a_folder_and_read_again(tmp_path, yard):
    inventory, _ = read_stones(yard, "m")
    out = tmp_path / "out"
    with pytest.raises(InputError, match="out"):
        write_stones(out, inventory)  # a folder is never made
    out.mkdir()
    write_stones(out, inventory)
    assert same(read_stones(out, "m")[0], inventory)
    odd = Inventory((replace(inventory.stones[0], id="a/b:c"),))
    write_stones(out, odd)
    assert (out / "a_b_c.obj").exists()
    twins = Inventory((replace(inventory.stones[0], id="A"), replace(inventory.stones[1], id="a")))
    with pytest.raises(InputError, match="'A' and 'a' would have one file"):
        write_stones(out, twins)
    with pytest.raises(InputError, match="no stones to write"):
        write_stones(out, Inventory(()))


def test_the_cache_gives_the_same_to_the_bit(yard, opened):
    cold, _ = read_stones(yard, "m")
    assert opened == ["s0.obj", "s1.obj", "s2.obj"]
    warm, _ = read_stones(yard, "m")
    assert len(opened) == 3
    assert same(cold, warm)
    assert not warm.stones[0].vertices.flags.writeable
    assert same(read_stones(yard, "m", cache=False)[0], cold)
    assert len(opened) == 6


def test_only_what_changed_is_read_again(yard, opened):
    read_stones(yard, "m")
    opened.clear()
    (yard / "s1.obj").write_text(obj(*boulder(7)))
    (yard / "s3.obj").write_text(obj(*boulder(8)))
    os.replace(yard / "s0.obj", yard / "z.obj")
    inventory, _ = read_stones(yard, "m")
    assert opened == ["s1.obj", "s3.obj"]
    assert [stone.id for stone in inventory.stones] == ["s1", "s2", "s3", "z"]
    assert inventory.stones[0].volume == stone_of("s", *boulder(7)).volume


def damaged(pack):
    """The pack in ways that are no pack."""
    whole = pack.read_bytes()
    yield b""
    yield b"not a zip file"
    yield whole[: len(whole) // 2]
    middle = len(whole) // 2
    yield whole[:middle] + bytes(64) + whole[middle + 64 :]
    with np.load(pack) as data:
        arrays = dict(data)
    for name in arrays:
        np.savez(pack, **{n: a for n, a in arrays.items() if n != name})
        yield pack.read_bytes()
    changed = {
        "counts": arrays["counts"] + 1,
        "triangles": arrays["triangles"] + 10**6,
        "density": arrays["density"][:, None],
        "vertices": arrays["vertices"][:, :2],
        "text": np.frombuffer(b"[]", np.uint8),
    }
    for change in (*({name: array} for name, array in changed.items()), {"text": np.array([object()])}):
        np.savez(pack, **(arrays | change))
        yield pack.read_bytes()


def test_a_damaged_pack_is_ignored_and_written_anew(yard, tmp_path, opened):
    cold, _ = read_stones(yard, "m")
    (pack,) = (tmp_path / "cache").iterdir()
    sound = pack.read_bytes()
    for data in damaged(pack):
        pack.write_bytes(data)
        opened.clear()
        assert same(read_stones(yard, "m")[0], cold)
        assert len(opened) == 3
        assert zipfile.is_zipfile(pack)
        pack.write_bytes(sound)


def test_a_cache_that_cannot_be_written_is_done_without(yard, tmp_path, monkeypatch, opened):
    (tmp_path / "file").write_text("not a folder")
    for place in (tmp_path / "file", tmp_path / "file" / "below", ""):
        monkeypatch.setenv("CYCLOPEAN_CACHE", str(place))
        opened.clear()
        assert len(read_stones(yard, "m")[0]) == 3
        assert len(opened) == 3


def test_where_the_cache_is(monkeypatch, tmp_path):
    assert cache_folder() == tmp_path / "cache"
    monkeypatch.setenv("CYCLOPEAN_CACHE", "")
    assert cache_folder() is None
    monkeypatch.delenv("CYCLOPEAN_CACHE")
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_folder() == tmp_path / "xdg" / "cyclopean"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder() == tmp_path / ".cache" / "cyclopean"
    monkeypatch.setattr("sys.platform", "darwin")
    assert cache_folder() == tmp_path / "Library" / "Caches" / "cyclopean"


def test_a_face_that_names_one_vertex_twice_is_dropped(tmp_path):
    (tmp_path / "s.obj").write_text(obj(*box()) + "f 1 1 2\n")
    assert read_stones(tmp_path, "m")[0].notes == (f"{tmp_path}/s.obj: 1 face without area dropped",)


def test_what_is_told_of_an_inventory(yard):
    inventory, warnings = read_stones(yard)
    data = inventory_dict(inventory, warnings)
    assert data["schema"] == "cyclopean.inventory/1"
    assert (data["count"], data["source"], sum(data["classes"].values())) == (3, "yard", 3)
    assert data["volume"]["total"] == pytest.approx(sum(s.volume for s in inventory.stones))
    assert data["shape"]["elongation"][0] == pytest.approx(np.mean([s["elongation"] for s in data["stones"]]))
    assert data["stones"][1]["axes"] == inventory.stones[1].axes.tolist()
    assert "stones" not in inventory_dict(inventory, every=False)


@needs_scans
def test_the_scans_survive_being_written_divided_and_read(tmp_path):
    inventory, _ = read_stones(SCANS, "m")
    assert [stone.id for stone in inventory.stones] == NAMES
    assert inventory.refused == ()
    finer = Inventory(tuple(stone_of(s.id, *subdivided(s.vertices, s.triangles)) for s in inventory.stones[:4]))
    write_stones(tmp_path / "fine.ply", finer)
    again, _ = read_stones(tmp_path / "fine.ply", "m")
    for a, b in zip(inventory.stones, again.stones, strict=False):
        assert (b.volume, b.hull_volume, b.area) == pytest.approx((a.volume, a.hull_volume, a.area), rel=1e-10)
        assert b.half == pytest.approx(a.half, rel=1e-10)
