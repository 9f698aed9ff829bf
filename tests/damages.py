"""Ways to damage a certificate.

A `Damage` takes a copy of a certificate and changes it in place; it answers whether it changed anything. Of
certificates of coupled analysis those in `FATAL` leave nothing that could be a proof, of whatever model; those in
`PERHAPS` may, and then a second opinion has to say so. `OF_EQUILIBRIUM` are refused of any model by rigid-block
equilibrium, `OF_LIMITS` of bounds of a multiplier. Last, any value may be replaced by any of its `substitutes`.
"""

import copy
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from cyclopean.proof import seal
from second_opinion import rebuilt

Certificate = dict[str, Any]
Damage = Callable[[Certificate, np.random.Generator], bool]


def any_of(items: Any, rng: np.random.Generator) -> Any:
    return items[int(rng.integers(len(items)))]


def rows_of(c: Certificate) -> Iterator[list[float]]:
    """All rows of numbers of the proof itself."""
    pending = [c, *(leaf for leaf in leaves(c))]
    for part in pending:
        yield from part.get("forces", [])
        yield from part.get("mechanism", {}).values()


def nodes(c: Certificate) -> list[dict[str, Any]]:
    found, pending = [], [c["tree"]] if "tree" in c else []
    while pending:
        node = pending.pop()
        found.append(node)
        pending += branches(node)
    return found


def branches(node: dict[str, Any]) -> list[dict[str, Any]]:
    pairs = [node[k] for k in ("engaged", "unloaded", "slower", "faster") if k in node]
    return pairs + node.get("sectors", [])


def leaves(c: Certificate) -> list[dict[str, Any]]:
    return [node for node in nodes(c) if "point" not in node]


def splits(c: Certificate) -> list[dict[str, Any]]:
    return [node for node in nodes(c) if "point" in node]


def peak(rows: list[list[float]]) -> tuple[int, int]:
    flat = int(np.argmax(np.abs(np.array(rows))))
    return flat // len(rows[0]), flat % len(rows[0])


def loaded(c: Certificate) -> tuple[int, int, int]:
    """The point with the largest force: its number, its contact, its corner."""
    k = int(np.argmax(np.linalg.norm(np.array(c["forces"]), axis=1)))
    corner = k
    for i, joint in enumerate(c["contacts"]):
        if corner < len(joint["polygon"]):
            return k, i, corner
        corner -= len(joint["polygon"])
    raise AssertionError


def gaps(c: Certificate) -> np.ndarray:
    """(q, 3) relative displacements of a state, in its own unit."""
    system, names = rebuilt(c)
    rows = np.array([c["mechanism"][n] for n in names], float).reshape(-1, 6)
    return system.gap((rows * np.repeat([1.0, system.length_unit], 3)).ravel())


# --- fatal -----------------------------------------------------------------------------------------------------------


def field_missing(c: Certificate, rng: np.random.Generator) -> bool:
    del c[any_of([k for k in c if k != "seal"], rng)]
    return True


def not_a_number(c: Certificate, rng: np.random.Generator) -> bool:
    row = any_of(list(rows_of(c)), rng)
    row[int(rng.integers(len(row)))] = any_of([float("nan"), float("inf"), None, "1", True], rng)
    return True


def huge_exponent(c: Certificate, rng: np.random.Generator) -> bool:
    row = any_of(list(rows_of(c)), rng)
    row[int(rng.integers(len(row)))] = any_of([1e300, -1e200, 1e-300, 5e-324], rng)
    return True


def ends_swapped(c: Certificate, rng: np.random.Generator) -> bool:
    if not c["contacts"]:
        return False
    joint = any_of(c["contacts"], rng)
    joint["a"], joint["b"] = joint["b"], joint["a"]
    return True


def names_swapped(c: Certificate, rng: np.random.Generator) -> bool:
    """Two blocks exchange their names; one of them has a contact."""
    if not c["contacts"]:
        return False
    name = any_of(c["contacts"], rng)["a"]
    one = next(b for b in c["blocks"] if b["id"] == name)
    other = any_of([b for b in c["blocks"] if b is not one], rng)
    one["id"], other["id"] = other["id"], one["id"]
    return True


def point_moved_off(c: Certificate, rng: np.random.Generator) -> bool:
    if not c["contacts"]:
        return False
    size = float(np.max(np.ptp(np.concatenate([b["vertices"] for b in c["blocks"]]), axis=0)))
    any_of(any_of(c["contacts"], rng)["polygon"], rng)[int(rng.integers(3))] += 1.5 * size
    return True


def force_flipped(c: Certificate, rng: np.random.Generator) -> bool:
    if "forces" not in c:
        return False
    i, j = peak(c["forces"])
    c["forces"][i][j] *= -1
    return True


def force_scaled(c: Certificate, rng: np.random.Generator) -> bool:
    if "forces" not in c:
        return False
    k, _, _ = loaded(c)
    factor = any_of([0.0, 0.99, 1.001, 3.0], rng)
    c["forces"][k] = [factor * x for x in c["forces"][k]]
    return True


def point_moved_along(c: Certificate, rng: np.random.Generator) -> bool:
    """The most loaded point, a hundredth of the way to another corner: its force has another lever."""
    if "forces" not in c:
        return False
    _, i, corner = loaded(c)
    polygon = c["contacts"][i]["polygon"]
    other = polygon[corner - 1]
    polygon[corner] = [0.99 * x + 0.01 * y for x, y in zip(polygon[corner], other, strict=True)]
    return True


def friction_taken_away(c: Certificate, rng: np.random.Generator) -> bool:
    """Just below what the busiest point needs."""
    if "forces" not in c:
        return False
    system, _ = rebuilt(c)
    f = np.einsum("qij,qj->qi", system.frame, np.array(c["forces"])) / system.force_unit
    used = np.where(f[:, 0] > 1e-6, np.hypot(f[:, 1], f[:, 2]) / np.maximum(f[:, 0], 1e-6), 0.0)
    k = int(np.argmax(used))
    if not (used[k] > 1e-6):
        return False
    joint = [j for j in c["contacts"] for _ in j["polygon"]][k]
    joint["mu"] = 0.999 * float(used[k])
    return True


def displaced(c: Certificate, rng: np.random.Generator) -> bool:
    """A block is pushed across its most loaded joint by a hundredth of eps."""
    if c["kind"] != "cra-state":
        return False
    k, i, _ = loaded(c)
    joint = c["contacts"][i]
    name = joint["b"] if joint["b"] in c["mechanism"] else joint["a"]
    normal = rebuilt(c)[0].frame[k, 0]
    step = 0.01 * c["eps"] * any_of([-1.0, 1.0], rng)
    c["mechanism"][name][:3] = [x + step * n for x, n in zip(c["mechanism"][name][:3], normal, strict=True)]
    return True


def eps_smaller(c: Certificate, rng: np.random.Generator) -> bool:
    if c["kind"] != "cra-state":
        return False
    c["eps"] *= any_of([0.5, 0.999, 1e-3], rng)
    return True


def eps_larger(c: Certificate, rng: np.random.Generator) -> bool:
    if c["kind"] != "cra-state":
        return False
    c["eps"] *= any_of([1.001, 2.0, 1e3], rng)
    return True


def eta_below_reach(c: Certificate, rng: np.random.Generator) -> bool:
    if c["kind"] != "cra-state":
        return False
    d = gaps(c)
    reach = max(float(np.max(d[:, 0])), float(np.max(np.hypot(d[:, 1], d[:, 2]))))
    if not (reach > 1.1 * c["beta_min"]):
        return False
    c["eta"] = 0.999 * reach
    return True


def sliding_demanded(c: Certificate, rng: np.random.Generator) -> bool:
    """beta_min just above what the slowest rubbing point does."""
    if c["kind"] != "cra-state":
        return False
    system, _ = rebuilt(c)
    f = np.einsum("qij,qj->qi", system.frame, np.array(c["forces"])) / system.force_unit
    d = gaps(c)
    rubs = np.hypot(f[:, 1], f[:, 2]) > 1e-6 * np.maximum(1.0, np.abs(f[:, 0]))
    if not rubs.any():
        return False
    least = float(np.min(np.hypot(d[:, 1], d[:, 2])[rubs]))
    if not (1.01 * least < c["eta"]):
        return False
    c["beta_min"] = 1.001 * least
    return True


def motion_reversed(c: Certificate, rng: np.random.Generator) -> bool:
    if "mechanism" not in c or not c["contacts"]:
        return False
    c["mechanism"] = {name: [-x for x in row] for name, row in c["mechanism"].items()}
    return True


def proof_emptied(c: Certificate, rng: np.random.Generator) -> bool:
    for row in rows_of(c):
        row[:] = [0.0] * len(row)
    return True


def branch_dropped(c: Certificate, rng: np.random.Generator) -> bool:
    found = splits(c)
    if not found:
        return False
    node = any_of(found, rng)
    if "sectors" in node:
        node["sectors"].pop(int(rng.integers(len(node["sectors"]))))
    else:
        del node[any_of([k for k in node if isinstance(node[k], dict)], rng)]
    return True


def point_unknown(c: Certificate, rng: np.random.Generator) -> bool:
    found = splits(c)
    if not found:
        return False
    any_of(found, rng)["point"] = any_of([-1, 10**6, 0.5, "0"], rng)
    return True


FATAL: list[Damage] = [
    field_missing, not_a_number, huge_exponent, ends_swapped, names_swapped, point_moved_off, force_flipped,
    force_scaled, point_moved_along, friction_taken_away, displaced, eps_smaller, eps_larger, eta_below_reach,
    sliding_demanded, motion_reversed, proof_emptied, branch_dropped, point_unknown,
]  # fmt: skip


# --- perhaps harmless ------------------------------------------------------------------------------------------------


def mu_lowered(c: Certificate, rng: np.random.Generator) -> bool:
    """No harm to a mechanism or a tree: fewer forces are admitted. None to a state whose friction still fits."""
    if not c["contacts"]:
        return False
    any_of(c["contacts"], rng)["mu"] *= any_of([0.0, 0.5, 0.9], rng)
    return True


def mu_raised(c: Certificate, rng: np.random.Generator) -> bool:
    """No harm to a state: more forces are admitted."""
    if not c["contacts"]:
        return False
    any_of(c["contacts"], rng)["mu"] *= any_of([1.1, 2.0, 100.0], rng)
    return True


def eta_other(c: Certificate, rng: np.random.Generator) -> bool:
    """Wider is no harm to a state, narrower none to a tree: both admit the same displacements as before."""
    if "eta" not in c:
        return False
    c["eta"] *= any_of([0.5, 0.9, 1.5, 10.0, 100.0], rng)
    return True


def beta_other(c: Certificate, rng: np.random.Generator) -> bool:
    """Smaller is no harm to a state, larger none to a tree."""
    if "beta_min" not in c:
        return False
    c["beta_min"] *= any_of([0.1, 0.5, 2.0, 10.0], rng)
    return True


def eps_other(c: Certificate, rng: np.random.Generator) -> bool:
    """A tree with margin may bear it."""
    if c["kind"] != "cra-tree":
        return False
    c["eps"] *= any_of([0.01, 0.5, 0.999, 1.001, 2.0], rng)
    return True


def density_other(c: Certificate, rng: np.random.Generator) -> bool:
    """No harm to a support, which needs no weight, nor to a mechanism in which the block moves down as well."""
    any_of(c["blocks"], rng)["density"] *= any_of([0.5, 1.5, 10.0], rng)
    return True


def gravity_reversed(c: Certificate, rng: np.random.Generator) -> bool:
    c["gravity"] = [-g for g in c["gravity"]]
    return True


def point_moved_inside(c: Certificate, rng: np.random.Generator) -> bool:
    """No harm at an unloaded corner: within the patch nothing moves more than at its corners."""
    if not c["contacts"]:
        return False
    polygon = any_of(c["contacts"], rng)["polygon"]
    k = int(rng.integers(len(polygon)))
    polygon[k] = [0.9 * x + 0.1 * y for x, y in zip(polygon[k], polygon[k - 1], strict=True)]
    return True


def number_flipped(c: Certificate, rng: np.random.Generator) -> bool:
    row = any_of([r for r in rows_of(c) if any(r)], rng)
    k = int(np.argmax(np.abs(row)))
    row[k] *= -1
    return True


def number_shifted(c: Certificate, rng: np.random.Generator) -> bool:
    row = any_of([r for r in rows_of(c) if any(r)], rng)
    k = int(np.argmax(np.abs(row)))
    row[k] *= 1.0 + any_of([-0.1, -1e-4, 1e-4, 0.1], rng)
    return True


def branches_swapped(c: Certificate, rng: np.random.Generator) -> bool:
    found = splits(c)
    if not found:
        return False
    node = any_of(found, rng)
    if "sectors" in node:
        node["sectors"].reverse()
    else:
        one, other = [k for k in node if isinstance(node[k], dict)]
        node[one], node[other] = node[other], node[one]
    return True


def leaves_swapped(c: Certificate, rng: np.random.Generator) -> bool:
    found = leaves(c)
    if len(found) < 2:
        return False
    i, j = rng.choice(len(found), 2, replace=False)
    one, other = dict(found[i]), dict(found[j])
    for place, new in ((found[i], other), (found[j], one)):
        place.clear()
        place.update(new)
    return True


def split_left_out(c: Certificate, rng: np.random.Generator) -> bool:
    """One of its branches stands in its place."""
    found = splits(c)
    if not found:
        return False
    node = any_of(found, rng)
    new = any_of(branches(node), rng)
    node.clear()
    node.update(new)
    return True


def split_elsewhere(c: Certificate, rng: np.random.Generator) -> bool:
    found = splits(c)
    points = sum(len(joint["polygon"]) for joint in c["contacts"])
    if not found or points < 2:
        return False
    node = any_of(found, rng)
    node["point"] = any_of([k for k in range(points) if k != node["point"]], rng)
    return True


def ray_turned(c: Certificate, rng: np.random.Generator) -> bool:
    found = [node for node in splits(c) if "rays" in node]
    if not found:
        return False
    ray = any_of(any_of(found, rng)["rays"], rng)
    if rng.random() < 0.5:
        ray[:] = [-x for x in ray]
    else:
        ray[:] = [x + float(d) for x, d in zip(ray, 0.3 * rng.normal(size=3), strict=True)]
    return True


def leaf_halved(c: Certificate, rng: np.random.Generator) -> bool:
    """One of the two vectors of a leaf is lost."""
    found = [leaf for leaf in leaves(c) if len(leaf) == 2]
    if not found:
        return False
    leaf = any_of(found, rng)
    del leaf[any_of(["mechanism", "forces"], rng)]
    return True


def leaf_scaled(c: Certificate, rng: np.random.Generator) -> bool:
    """No harm to a leaf of one vector."""
    found = leaves(c)
    if not found:
        return False
    leaf = any_of(found, rng)
    factor = any_of([0.5, 0.999, 1.001, 2.0], rng)
    for row in [*leaf.get("forces", []), *leaf.get("mechanism", {}).values()]:
        row[:] = [factor * x for x in row]
    return True


def kind_other(c: Certificate, rng: np.random.Generator) -> bool:
    """A coupled state without its motion is a state of equilibrium; nothing else serves as another kind."""
    if c["kind"] != "cra-state":
        return False
    c["kind"] = any_of(["rbe-state", "rbe-mechanism", "cra-tree"], rng)
    bounds = {"eps", "eta", "beta_min"}
    wanted = {"rbe-state": {"forces"}, "rbe-mechanism": {"mechanism"}, "cra-tree": bounds}[c["kind"]]
    for key in ("forces", "mechanism", *bounds):
        if key not in wanted:
            del c[key]
    if c["kind"] == "cra-tree":
        c["tree"] = {"mechanism": {b["id"]: [0.0] * 6 for b in c["blocks"] if not b["fixed"]}}
    return True


PERHAPS: list[Damage] = [
    mu_lowered, mu_raised, eta_other, beta_other, eps_other, density_other, gravity_reversed, point_moved_inside,
    number_flipped, number_shifted, branches_swapped, leaves_swapped, split_left_out, split_elsewhere, ray_turned,
    leaf_halved, leaf_scaled, kind_other,
]  # fmt: skip


def damaged(certificate: Certificate, rng: np.random.Generator) -> tuple[Certificate, Damage]:
    """A copy with one damage, drawn among those that the certificate's kind can suffer."""
    while True:
        damage = any_of([*FATAL, *PERHAPS], rng)
        copied = copy.deepcopy(certificate)
        if damage(copied, rng):
            return copied, damage


# --- of equilibrium --------------------------------------------------------------------------------------------------


def witness(c: Certificate) -> list[list[float]]:
    return c["forces"] if "forces" in c else list(c["mechanism"].values())


def largest_flipped(c: Certificate, rng: np.random.Generator) -> bool:
    i, j = peak(witness(c))
    witness(c)[i][j] *= -1
    return True


def scaled(c: Certificate, rng: np.random.Generator) -> bool:
    """To nothing or beyond what counts. (Where forces have slack, others between are corrected, and prove it still.)"""
    if "mechanism" in c:
        return motion_reversed(c, rng)
    factor = any_of([0.0, 1e8], rng)
    c["forces"] = [[factor * x for x in row] for row in c["forces"]]
    return True


def mesh_opened(c: Certificate, rng: np.random.Generator) -> bool:
    any_of(c["blocks"], rng)["faces"].pop()
    return True


def mesh_turned_inside_out(c: Certificate, rng: np.random.Generator) -> bool:
    block = any_of(c["blocks"], rng)
    block["faces"] = [face[::-1] for face in block["faces"]]
    return True


def name_doubled(c: Certificate, rng: np.random.Generator) -> bool:
    c["blocks"][0]["id"] = c["blocks"][-1]["id"]
    return True


def witness_cut_short(c: Certificate, rng: np.random.Generator) -> bool:
    c["forces"].pop() if "forces" in c else c["mechanism"].popitem()
    return True


def last_digit(c: Certificate, rng: np.random.Generator) -> bool:
    """Only the seal tells."""
    vertex = any_of(any_of(c["blocks"], rng)["vertices"], rng)
    vertex[0] = float(np.nextafter(vertex[0], np.inf))
    return True


OF_EQUILIBRIUM: list[Damage] = [
    largest_flipped, scaled, gravity_reversed, ends_swapped, point_moved_off, mesh_opened, mesh_turned_inside_out,
    name_doubled, field_missing, not_a_number, huge_exponent, witness_cut_short,
]  # fmt: skip


# --- of limits -------------------------------------------------------------------------------------------------------


def raised(part: dict[str, Any], key: str, factor: float) -> None:
    part[key] = part[key] * factor


OF_LIMITS: dict[str, Callable[[Certificate], object]] = {
    "lower raised": lambda c: raised(c, "lower", 1.001),
    "upper cut": lambda c: raised(c, "upper", 0.999),
    "lower above upper": lambda c: raised(c, "upper", 0.5),
    "lower is text": lambda c: c.update(lower=str(c["lower"])),
    "upper is no number": lambda c: c.update(upper=float("inf")),
    "lower is true": lambda c: c.update(lower=True),
    "no lower": lambda c: c.pop("lower"),
    "no forces": lambda c: c.pop("forces"),
    "no upper": lambda c: c.pop("upper"),
    "no mechanism": lambda c: c.pop("mechanism"),
    "no side at all": lambda c: [c.pop(key) for key in ("lower", "forces", "upper", "mechanism")],
    "live gravity is no number": lambda c: c["live"]["gravity"].__setitem__(0, float("nan")),
    "no live": lambda c: c.pop("live"),
    "live without loads": lambda c: c["live"].pop("loads"),
    "live with more": lambda c: c["live"].update(tilt=3.0),
    "live gravity short": lambda c: c["live"]["gravity"].pop(),
    "live turned round": lambda c: turned(c["live"]),
    "live doubled": lambda c: grown(c["live"]),
    "a fall as mechanism": lambda c: c.update(mechanism={n: [0, 0, -1.0, 0, 0, 0] for n in c["mechanism"]}),
    "mechanism turned round": lambda c: c.update(mechanism={n: [-x for x in r] for n, r in c["mechanism"].items()}),
    "forces scaled": lambda c: c.update(forces=[[1.001 * x for x in row] for row in c["forces"]]),
    "one force pulls": lambda c: c["forces"].__setitem__(0, [-x for x in c["forces"][0]]),
    "less friction": lambda c: [joint.update(mu=0.9 * joint["mu"]) for joint in c["contacts"]],
    "a tree beside": lambda c: c.update(tree={}),
}


def turned(live: dict[str, Any]) -> None:
    live["gravity"] = [-x for x in live["gravity"]]
    for load in live["loads"]:
        load["force"] = [-x for x in load["force"]]


def grown(live: dict[str, Any]) -> None:
    live["gravity"] = [2 * x for x in live["gravity"]]
    for load in live["loads"]:
        load["force"] = [2 * x for x in load["force"]]


# --- of any value ----------------------------------------------------------------------------------------------------

REMOVE = object()


def places(value, path=()):
    """Every path into a JSON value."""
    yield path
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in children:
        yield from places(child, (*path, key))


def at(value, path):
    for key in path:
        value = value[key]
    return value


def changed(certificate, path, new):
    """A copy with another value at a path; what is beside the path is shared."""
    key, *rest = path
    result = certificate.copy()
    if rest:
        result[key] = changed(result[key], rest, new)
    elif new is REMOVE:
        del result[key]
    else:
        result[key] = new
    return result


def resealed(certificate):
    """Sealed again where that is possible (NaN and Infinity have no canonical JSON: then the seal is kept)."""
    try:
        return {**certificate, "seal": seal(certificate)}
    except (ValueError, TypeError, RecursionError):
        return certificate


def substitutes(old):
    """What a value of this type might be damaged into."""
    yield from (None, REMOVE, [], {}, "", True, "1.0", -1, math.nan, math.inf, -math.inf, 1e308, 5e-324, 10**5000)
    if isinstance(old, int | float) and not isinstance(old, bool) and abs(old) < 1e300:
        yield from (-old, old * 1.5, old + 1, str(old), [old], 1e150, 1e-200)
    if isinstance(old, str):
        yield from (old + "x", old.upper(), 0)
    if isinstance(old, list):
        yield from (old[:-1], [*old, 0], old[::-1], [old])
    if isinstance(old, dict):
        yield from ({**old, "note": 1}, list(old))
    if isinstance(old, bool):
        yield from (not old, int(old))


def differs(a, b):
    return a is REMOVE or type(a) is not type(b) or a != b
