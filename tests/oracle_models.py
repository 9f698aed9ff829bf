"""Seeded random structures for the audit: as the oracle sees them, and as `cyclopean.model/1` for the program.

Plane cases are polygons in (x, z), cut or built, extruded along y; their files are turned, moved, half triangulated,
with contacts listed or left to be detected. Space cases are convex solids cut by planes, or boxes. `Case.dumped` and
`loaded` keep a case in a file: {"kind", "family", "mu", "gravity", "model", "case" or absent, ...}.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from oracle import Body, G, Joint, Structure

DENSITY = 2400.0
SMALLEST = 3e-5  # of the model: edges and overlaps shorter than this are not drawn, they could count as none
PLANE_HELD = ["y", "rx", "rz"]  # what keeps the motion of a block in the plane


@dataclass(frozen=True, eq=False)
class Plane:
    """Polygons (k, 2) in (x, z), counter-clockwise with z up, `depth` m thick."""

    parts: tuple[np.ndarray, ...]
    fixed: tuple[bool, ...]
    density: tuple[float, ...]
    depth: float
    joints: tuple[tuple[int, int, np.ndarray, np.ndarray], ...]  # a, b, both ends (2, 2), normal from a into b


@dataclass(frozen=True, eq=False)
class Space:
    """Convex solids: vertices (k, 3) and faces, counter-clockwise seen from outside."""

    parts: tuple[tuple[np.ndarray, tuple[tuple[int, ...], ...]], ...]
    fixed: tuple[bool, ...]
    density: tuple[float, ...]
    joints: tuple[tuple[int, int, np.ndarray, np.ndarray], ...]  # a, b, polygon (m, 3), normal from a into b


@dataclass(frozen=True, eq=False)
class Case:
    """A question: what is asked, of which structure, and how its file is written."""

    kind: str  # "rbe", "cra", "limit"
    family: str
    shape: Plane | Space
    mu: float
    pull: np.ndarray  # (d,) gravity in the shape's own axes
    push: np.ndarray | None = None  # (d,) of limits
    eta: float = 10.0  # in eps
    beta: float = 0.01
    document: Mapping[str, Any] = field(default_factory=dict)  # cyclopean.model/1
    gravity: tuple[float, float, float] = (0.0, 0.0, -G)  # as the file has its axes
    live: tuple[float, float, float] | None = None
    plane_only: bool = True  # whether supports keep motions in the plane

    def structure(self) -> Structure:
        """What the oracle is asked about."""
        corners = [x for block in self.document.get("blocks", ()) for vertex in block["vertices"] for x in vertex]
        rounding = float(np.spacing(np.max(np.abs(corners), initial=0.0)))
        return replace(structure_of(self.shape, self.mu, self.pull), rounding=rounding)


# --- mass, and where blocks touch ------------------------------------------------------------------------------------


def polygon_mass(corner: np.ndarray) -> tuple[float, np.ndarray]:
    """Area and centroid of a polygon (k, 2), about its first corner."""
    own = corner - corner[0]
    turned = np.roll(own, -1, axis=0)
    twice = own[:, 0] * turned[:, 1] - own[:, 1] * turned[:, 0]
    area = twice.sum() / 2.0
    return float(area), corner[0] + ((own + turned) * twice[:, None]).sum(axis=0) / (6.0 * area)


def solid_mass(vertex: np.ndarray, faces: Iterable[Sequence[int]]) -> tuple[float, np.ndarray]:
    """Volume and centroid of a closed solid, from tetrahedra about its first vertex."""
    own = vertex - vertex[0]
    volume, moment = 0.0, np.zeros(3)
    for face in faces:
        for j in range(1, len(face) - 1):
            a, b, c = own[face[0]], own[face[j]], own[face[j + 1]]
            six = float(a @ np.cross(b, c))
            volume += six / 6.0
            moment += six / 24.0 * (a + b + c)
    return volume, vertex[0] + moment / volume


def structure_of(shape: Plane | Space, mu: float, gravity: np.ndarray) -> Structure:
    """Masses and joints as the oracle wants them."""
    bodies = []
    for k, part in enumerate(shape.parts):
        if isinstance(shape, Plane):
            measure, centre = polygon_mass(part)
            size, thickness = np.linalg.norm(np.ptp(part, axis=0)), shape.depth
        else:
            measure, centre = solid_mass(*part)
            size, thickness = np.linalg.norm(np.ptp(part[0], axis=0)), 1.0
        bodies.append(Body(measure * thickness * shape.density[k] * G, centre, float(size), shape.fixed[k]))
    joints = [Joint(a, b, points, normal) for a, b, points, normal in shape.joints]
    return Structure(tuple(bodies), tuple(joints), mu, np.asarray(gravity, float))


def convex(corner: np.ndarray) -> bool:
    """Whether a polygon (k, 2) turns left at every corner, once round."""
    edge = np.roll(corner, -1, axis=0) - corner
    after = np.roll(edge, -1, axis=0)
    left = np.arctan2(edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0], np.sum(edge * after, axis=1))
    return bool(np.all(left > -1e-9) and left.sum() < 3.0 * np.pi)


def plane_joints(parts: Sequence[np.ndarray], fixed: Sequence[bool], tolerance: float, least: float) -> list | None:
    """Segments along which two polygons touch; None where one is longer than nothing but shorter than `least`."""
    found = []
    for a in range(len(parts)):
        for b in range(a + 1, len(parts)):
            if fixed[a] and fixed[b]:
                continue
            for p, q in zip(parts[a], np.roll(parts[a], -1, axis=0), strict=True):
                length = float(np.linalg.norm(q - p))
                along = (q - p) / length
                normal = np.array([along[1], -along[0]])  # out of a
                for r, s in zip(parts[b], np.roll(parts[b], -1, axis=0), strict=True):
                    if (s - r) @ along >= 0.0 or max(abs((r - p) @ normal), abs((s - p) @ normal)) > tolerance:
                        continue
                    low, high = max(0.0, (s - p) @ along), min(length, (r - p) @ along)
                    if high - low <= tolerance:
                        continue
                    if high - low < least:
                        return None
                    found.append((a, b, np.array([p + low * along, p + high * along]), normal))
    return found


def clipped(polygon: np.ndarray, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The part of a convex polygon (k, d) on the side to which the normal does not point."""
    height = (polygon - point) @ normal
    result = []
    for k in range(len(polygon)):
        j = (k + 1) % len(polygon)
        if height[k] <= 0.0:
            result.append(polygon[k])
        if height[k] * height[j] < 0.0:
            t = height[k] / (height[k] - height[j])
            result.append(polygon[k] + t * (polygon[j] - polygon[k]))
    return np.array(result).reshape(-1, polygon.shape[1])


def area_vector(polygon: np.ndarray) -> np.ndarray:
    """Newell's vector of a polygon (k, 3): twice its area along its normal."""
    own = polygon - polygon[0]
    return np.cross(own, np.roll(own, -1, axis=0)).sum(axis=0)


def space_joints(parts: Sequence, fixed: Sequence[bool], tolerance: float, least: float) -> list | None:
    """Convex patches in which faces of two solids touch; None where one is narrower than `least` but not nothing."""
    face_of, plane, corners = [], [], []
    for k, (vertex, faces) in enumerate(parts):
        for face in faces:
            polygon = vertex[list(face)]
            normal = area_vector(polygon)
            face_of.append(k)
            plane.append(np.append(normal / np.linalg.norm(normal), 0.0))
            plane[-1][3] = plane[-1][:3] @ polygon[0]
            corners.append(polygon)
    sheet, owner = np.array(plane), np.array(face_of)
    held = np.array(fixed)[owner]
    facing = (sheet[:, :3] @ sheet[:, :3].T < -1.0 + 1e-9) & (np.abs(sheet[:, None, 3] + sheet[None, :, 3]) < tolerance)
    facing &= (owner[:, None] < owner[None, :]) & ~(held[:, None] & held[None, :])
    found = []
    for i, j in np.argwhere(facing):
        normal, patch = sheet[i, :3], corners[i]
        for p, q in zip(corners[j], np.roll(corners[j], -1, axis=0), strict=True):
            if len(patch) >= 3:
                outward = np.cross(q - p, -normal)
                patch = clipped(patch, p, outward / np.linalg.norm(outward))
        if len(patch) < 3:
            continue
        around = np.linalg.norm(np.roll(patch, -1, axis=0) - patch, axis=1).sum()
        width = float(np.linalg.norm(area_vector(patch))) / around if around > tolerance else 0.0
        if width <= tolerance:
            continue
        if width < least:
            return None
        found.append((int(owner[i]), int(owner[j]), patch, normal))
    return found


# --- files -----------------------------------------------------------------------------------------------------------


def prism_faces(count: int) -> list[list[int]]:
    """Faces of a polygon of `count` corners extruded along y, front loop first."""
    sides = [[(k + 1) % count, k, count + k, count + (k + 1) % count] for k in range(count)]
    return [list(range(count)), list(range(2 * count - 1, count - 1, -1)), *sides]


def solids(shape: Plane | Space) -> list[tuple[np.ndarray, list[list[int]]]]:
    """Vertices and faces of every block, in space."""
    if isinstance(shape, Space):
        return [(vertex, [list(face) for face in faces]) for vertex, faces in shape.parts]
    result = []
    for part in shape.parts:
        loops = [np.column_stack([part[:, 0], np.full(len(part), y), part[:, 1]]) for y in (0.0, shape.depth)]
        result.append((np.concatenate(loops), prism_faces(len(part))))
    return result


def patches(shape: Plane | Space) -> list[tuple[int, int, np.ndarray]]:
    """Contact polygons in space, counter-clockwise about the normal from a into b."""
    result = []
    for a, b, points, normal in shape.joints:
        if isinstance(shape, Space):
            polygon, outward = points, normal
        else:
            (px, pz), (qx, qz), depth = points[0], points[1], shape.depth
            polygon = np.array([(px, 0.0, pz), (qx, 0.0, qz), (qx, depth, qz), (px, depth, pz)])
            outward = np.array([normal[0], 0.0, normal[1]])
        result.append((a, b, polygon if area_vector(polygon) @ outward > 0.0 else polygon[::-1]))
    return result


def turn(rng: np.random.Generator) -> np.ndarray:
    """A random rotation (3, 3)."""
    q = rng.normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def space(vector: np.ndarray) -> np.ndarray:
    """A vector of the plane in space."""
    return vector if len(vector) == 3 else np.array([vector[0], 0.0, vector[1]])


def triangulated(rng: np.random.Generator, faces: list[list[int]]) -> list[list[int]]:
    """Half of the faces cut into triangles from their first corner."""
    result = []
    for face in faces:
        fan = len(face) > 3 and rng.random() < 0.5
        result += [[face[0], face[j], face[j + 1]] for j in range(1, len(face) - 1)] if fan else [face]
    return result


def written(case: Case, rng: np.random.Generator, plain: bool = False) -> Case:
    """The case with a file: turned, moved (10 km too), half triangulated, contacts listed or not; all by chance."""
    rotation, offset = np.eye(3), np.zeros(3)
    extent = max(float(np.ptp(np.concatenate([v for v, _ in solids(case.shape)]), axis=0).max()), 1e-9)
    held = isinstance(case.shape, Plane) and case.kind == "cra" and case.plane_only
    if not plain and not held and rng.random() < 0.5:
        rotation = turn(rng)
    if not plain and rng.random() < 0.5:
        # 10 km away coordinates are good to 2e-12 m: not for models in which that is not small
        far = rng.random() < 0.3 and extent * SMALLEST > 1e-6
        offset = rng.uniform(-1.0, 1.0, 3) * (1e4 if far else 10.0 * extent)
    listed, fans = rng.random() < 0.5, not plain and rng.random() < 0.5
    blocks = []
    for k, (vertex, faces) in enumerate(solids(case.shape)):
        blocks.append(
            {
                "id": f"b{k}",
                "vertices": (vertex @ rotation.T + offset).tolist(),
                "faces": triangulated(rng, faces) if fans else faces,
                "density": case.shape.density[k],
                "fixed": case.shape.fixed[k],
            }
        )
    document: dict[str, Any] = {"schema": "cyclopean.model/1", "units": "m", "name": "case", "blocks": blocks}
    if listed:
        document["contacts"] = [
            {"a": f"b{a}", "b": f"b{b}", "polygon": (polygon @ rotation.T + offset).tolist()}
            for a, b, polygon in patches(case.shape)
        ]
    if held:
        free = [k for k, whole in enumerate(case.shape.fixed) if not whole]
        document["supports"] = [{"block": f"b{k}", "held": PLANE_HELD} for k in free]
    live = None if case.push is None else tuple((rotation @ space(case.push)).tolist())
    gravity = tuple((rotation @ space(case.pull)).tolist())
    return replace(case, document=document, gravity=gravity, live=live)


# --- keeping a case in a file ----------------------------------------------------------------------------------------


def dumped(case: Case) -> dict[str, Any]:
    """The case as JSON; `loaded` reads it, and the cases of the fixtures."""
    row: dict[str, Any] = {
        "kind": case.kind,
        "family": case.family,
        "mu": case.mu,
        "gravity": list(case.gravity),
        "eta": case.eta,
        "beta": case.beta,
        "plane_only": case.plane_only,
        "model": dict(case.document),
    }
    if case.live is not None:
        row["live"] = list(case.live)
    shape = case.shape
    own: dict[str, Any] = {
        "fix": list(shape.fixed),
        "dens": list(shape.density),
        "g": case.pull.tolist(),
        "push": None if case.push is None else case.push.tolist(),
    }
    if isinstance(shape, Plane):
        own |= {"T": shape.depth, "parts": [part.tolist() for part in shape.parts]}
        own["contacts"] = [[a, b, *points.tolist(), normal.tolist()] for a, b, points, normal in shape.joints]
    else:
        own["solids"] = [[vertex.tolist(), [list(face) for face in faces]] for vertex, faces in shape.parts]
        own["contacts"] = [[a, b, points.tolist(), normal.tolist()] for a, b, points, normal in shape.joints]
    return row | {"case": own}


def loaded(row: Mapping[str, Any]) -> Case:
    """A case from what `dumped` wrote, from a case of the fixtures, or from a model and its options alone."""
    own = row.get("case") or {"g": row["g"] if "g" in row else row["gravity"]}
    own = dict(own)
    shape: Plane | Space
    if "parts" in own:
        joints = [(a, b, np.array([p, q]), np.array(n)) for a, b, p, q, n in own["contacts"]]
        parts = tuple(np.array(part) for part in own["parts"])
        shape = Plane(parts, tuple(own["fix"]), tuple(own["dens"]), own["T"], tuple(joints))
    elif "solids" in own:
        joints = [(a, b, np.array(points), np.array(n)) for a, b, points, n in own["contacts"]]
        bodies = tuple((np.array(v), tuple(tuple(face) for face in faces)) for v, faces in own["solids"])
        shape = Space(bodies, tuple(own["fix"]), tuple(own["dens"]), tuple(joints))
    else:
        shape = space_of(row["model"])
    live = row.get("live", row.get("push"))
    push = own.get("push")
    if push is None and live is not None:
        push = live if len(own["g"]) == 3 else [live[0], live[2]]
    return Case(
        row["kind"],
        str(row.get("family", row.get("style", ""))),
        shape,
        float(row["mu"]),
        np.array(own["g"], float),
        None if push is None else np.array(push, float),
        float(row.get("eta") or 10.0),
        float(row.get("beta") or 0.01),
        row["model"],
        tuple(row.get("gravity") or space(np.array(own["g"], float)).tolist()),
        None if live is None else tuple(live),
        bool(row.get("plane_only", bool(row["model"].get("supports")))),
    )


def space_of(document: Mapping[str, Any]) -> Space:
    """The solids of a model file whose faces are convex, and its contacts: listed, or where faces touch."""
    blocks = document["blocks"]
    names = [block["id"] for block in blocks]
    parts = tuple(
        (np.array(block["vertices"], float), tuple(tuple(face) for face in block["faces"])) for block in blocks
    )
    fixed = tuple(bool(block.get("fixed")) for block in blocks)
    density = tuple(float(block.get("density") or DENSITY) for block in blocks)
    if document.get("contacts"):
        joints = []
        for row in document["contacts"]:
            polygon = np.array(row["polygon"], float)
            normal = area_vector(polygon)
            a, b = names.index(row["a"]), names.index(row["b"])
            joints.append((a, b, polygon, normal / np.linalg.norm(normal)))
    else:
        extent = float(np.ptp(np.concatenate([vertex for vertex, _ in parts]), axis=0).max())
        joints = space_joints(parts, fixed, 1e-9 * extent, 0.0) or []
    return Space(parts, fixed, density, tuple(joints))


# --- shapes in the plane ---------------------------------------------------------------------------------------------


def cut(polygon: np.ndarray, point: np.ndarray, normal: np.ndarray) -> list[np.ndarray]:
    """Both parts of a convex polygon (k, 2); the corners that the cut makes are the same numbers in both."""
    height = (polygon - point) @ normal
    if np.all(height >= 0.0) or np.all(height <= 0.0):
        return [polygon]
    sides: tuple[list, list] = ([], [])
    for k in range(len(polygon)):
        j = (k + 1) % len(polygon)
        for side, sign in zip(sides, (1.0, -1.0), strict=True):
            if sign * height[k] >= 0.0:
                side.append(polygon[k])
        if height[k] * height[j] < 0.0:
            t = height[k] / (height[k] - height[j])
            corner = polygon[k] + t * (polygon[j] - polygon[k])
            sides[0].append(corner)
            sides[1].append(corner)
    return [np.array(side) for side in sides]


def rectangle(low: Sequence[float], high: Sequence[float]) -> np.ndarray:
    """Counter-clockwise."""
    (x, z), (X, Z) = low, high
    return np.array([(x, z), (X, z), (X, Z), (x, Z)], float)


def unit(angle: float) -> np.ndarray:
    """A unit vector of the plane."""
    return np.array([np.cos(angle), np.sin(angle)])


Built = tuple[list[np.ndarray], list[bool]]


def cut_by_lines(rng: np.random.Generator) -> Built:
    """A block cut by lines, right through or in one stone alone (T-joints); some stones become supports."""
    parts = [rectangle((0.0, 0.0), (1.0, rng.uniform(0.5, 1.5)))]
    for _ in range(int(rng.integers(2, 6))):
        normal = unit(rng.choice([np.pi / 2, 0.0]) + rng.normal() * rng.choice([0.0, 0.15, 0.6]))
        chosen = int(rng.integers(len(parts)))
        box = parts[chosen]
        point = box.min(axis=0) + rng.uniform(0.15, 0.85, 2) * np.ptp(box, axis=0)
        through = rng.random() < 0.4
        pieces = [cut(p, point, normal) if through or k == chosen else [p] for k, p in enumerate(parts)]
        parts = [piece for pair in pieces for piece in pair]
        if len(parts) > 9:
            break
    return parts, supports(rng, parts)


def supports(rng: np.random.Generator, parts: list[np.ndarray]) -> list[bool]:
    """Which stones are supports: those at the bottom, at a side or both, at the top, or any."""
    points = np.concatenate(parts)
    low, high = points.min(axis=0), points.max(axis=0)
    edge = [
        [abs(p[:, axis].min() - low[axis]) < 1e-12 or axis == 2 for axis in (0, 1)]
        + [abs(p[:, axis].max() - high[axis]) < 1e-12 for axis in (0, 1)]
        for p in parts
    ]
    touching = np.array(edge)  # left, bottom, right, top
    style = rng.choice(["bottom", "sides", "side", "top", "any"], p=[0.5, 0.2, 0.1, 0.1, 0.1])
    if style == "any":
        fixed = rng.random(len(parts)) < 0.4
    else:
        sides = {"bottom": [1], "sides": [0, 2], "side": [0], "top": [3]}[style]
        fixed = touching[:, sides].any(axis=1)
    if fixed.all() or not fixed.any():
        chosen = int(rng.integers(len(parts)))
        fixed[chosen] = not fixed[chosen]
    return fixed.tolist()


def sliver_cuts(rng: np.random.Generator) -> Built:
    """A block with cuts so close to each other, or to a corner, that slivers and chips arise."""
    parts, fixed = [rectangle((0.0, 0.0), (1.0, rng.uniform(0.4, 1.2)))], []
    for _ in range(int(rng.integers(1, 4))):
        chosen = int(rng.integers(len(parts)))
        box = parts[chosen]
        point = box.min(axis=0) + rng.uniform(0.2, 0.8, 2) * np.ptp(box, axis=0)
        normal, width = unit(rng.uniform(0.0, 2 * np.pi)), 10.0 ** rng.uniform(-4, -1)
        if rng.random() < 0.5:
            pieces = cut(box, point, normal)
            pieces = [q for piece in pieces for q in cut(piece, point + width * normal, normal)]
        else:  # a chip off a corner
            corner = box[int(rng.integers(len(box)))]
            inward = box.mean(axis=0) - corner
            pieces = cut(box, corner + width * inward, inward / np.linalg.norm(inward))
        parts[chosen : chosen + 1] = pieces
    fixed = supports(rng, parts)
    return parts, fixed


def fan(rng: np.random.Generator) -> Built:
    """Voussoirs about a centre, springers fixed; now and then one of them is thin."""
    count = int(rng.integers(3, 9))
    start, end = rng.uniform(-0.1, 0.4), np.pi - rng.uniform(-0.1, 0.4)
    share = rng.uniform(0.3, 1.0, count)
    if rng.random() < 0.3:
        share[int(rng.integers(1, count - 1))] *= 10.0 ** rng.uniform(-3, -1)
    angle = start + (end - start) * np.concatenate([[0.0], np.cumsum(share) / share.sum()])
    inner, outer = 1.0, 1.0 + rng.uniform(0.08, 0.5)
    rays = np.array([unit(a) for a in angle])
    parts = [np.array([inner * p, outer * p, outer * q, inner * q]) for p, q in pairwise(rays)]
    fixed = [k in (0, count - 1) for k in range(count)]
    if rng.random() < 0.15:
        fixed[-1] = False
    return parts, fixed


def wedge(rng: np.random.Generator) -> Built:
    """Stones hanging by friction or squeezed between two supports whose faces lean."""
    count, height = int(rng.integers(1, 5)), rng.uniform(0.2, 1.5)
    lean = rng.choice([0.0, rng.uniform(-0.2, 0.2), rng.uniform(0.0, 0.8)])
    share = rng.uniform(0.3, 1.0, count) * 10.0 ** np.where(rng.random(count) < 0.2, rng.uniform(-3, -1, count), 0.0)
    low = np.concatenate([[0.0], np.cumsum(share) / share.sum()])
    tilt = lean * (1.0 - 2.0 * low) + rng.normal(0.0, 0.05, count + 1) * rng.choice([0.0, 1.0]) * share.min()
    top = low - tilt * height * 0.5
    edges = [(-0.5, -0.5), *zip(low, top, strict=True), (1.5, 1.5)]
    order = [(x0, x1, X0, X1) for (x0, X0), (x1, X1) in pairwise(edges)]
    parts = [np.array([(x0, 0.0), (x1, 0.0), (X1, height), (X0, height)]) for x0, x1, X0, X1 in order]
    return parts, [True, *[False] * count, True]


def ratio(rng: np.random.Generator) -> float:
    """Of sizes: 1:10 to 1:10^4."""
    return float(10.0 ** -rng.uniform(1.0, 4.0))


def small_on_big(rng: np.random.Generator) -> Built:
    """Small stones on a big one: tipping over its edge, sliding down its side, or stacked on it."""
    small = ratio(rng)
    over = 0.5 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-4, -0.5)
    slope = rng.choice([0.0, rng.uniform(0.0, 0.9)])
    width, height = small, small * rng.uniform(0.2, 3.0)
    big = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0 - 0.4 * slope), (0.0, 1.0)])
    along = big[2] - big[3]
    along /= np.linalg.norm(along)
    up = np.array([-along[1], along[0]])
    if slope == 0.0:
        start = big[2] - (1.0 - over) * width * along  # hangs over the edge by `over` of its width
    else:
        start = big[3] + 0.5 * (big[2] - big[3])
    parts = [rectangle((-0.5, -0.5), (1.5, 0.0)), big]
    for k in range(int(rng.integers(1, 3))):
        foot = start + up * height * k
        parts.append(np.array([foot, foot + width * along, foot + width * along + height * up, foot + height * up]))
    return parts, [True, *[False] * (len(parts) - 1)]


def pins(rng: np.random.Generator) -> Built:
    """A big cube on pins, perhaps others beside it, and a small stone that hangs over the edge of another."""
    small = ratio(rng)
    tall = small * rng.uniform(0.5, 2.0)
    # feet of the cube, symmetrical or not: sometimes all on one side, and it tips
    feet = np.sort(rng.uniform(0.0, 1.0 - small, 2)) if rng.random() < 0.5 else np.array([0.0, 1.0 - small])
    if feet[1] - feet[0] < 2.0 * small:
        feet = np.array([0.1, 0.9 - small])
    parts = [rectangle((-1.0, -1.0), (3.0, 0.0))]
    parts += [rectangle((x, 0.0), (x + small, tall)) for x in feet]
    parts.append(rectangle((0.0, tall), (1.0, tall + rng.uniform(0.5, 1.5))))
    if rng.random() < 0.7:
        over = 0.5 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-4, -0.5)
        x = 1.5
        parts.append(rectangle((x, 0.0), (x + small, small)))
        parts.append(rectangle((x + over * small, small), (x + over * small + small, 2.0 * small)))
    return parts, [True, *[False] * (len(parts) - 1)]


def wall_with_chips(rng: np.random.Generator) -> Built:
    """Courses of stones in bond on a floor, with thin or narrow ones among them."""
    courses, z = int(rng.integers(1, 4)), 0.0
    parts = [rectangle((-0.2, -0.3), (1.2, 0.0))]
    for _ in range(courses):
        count = int(rng.integers(1, 4))
        share = rng.uniform(0.3, 1.0, count) * np.where(rng.random(count) < 0.3, ratio(rng), 1.0)
        x = np.concatenate([[0.0], np.cumsum(share) / share.sum()])
        height = rng.uniform(0.1, 0.5) * (ratio(rng) if rng.random() < 0.2 else 1.0)
        parts += [rectangle((x[k], z), (x[k + 1], z + height)) for k in range(count)]
        z += height
    return parts, [True, *[False] * (len(parts) - 1)]


def squeezed_beside_big(rng: np.random.Generator) -> Built:
    """A small beam between two upright supports, a boulder on the floor beside it."""
    small = 10.0 ** -rng.uniform(0.0, 3.0)
    half, height = small * rng.uniform(0.3, 1.5), small * rng.uniform(0.2, 1.0)
    parts = [
        rectangle((-half - 1.0, 0.0), (-half, 1.0)),
        rectangle((half, 0.0), (half + 1.0, 1.0)),
        rectangle((-half, 0.3), (half, 0.3 + height)),
        rectangle((3.0, -1.0), (5.0, 0.0)),
        rectangle((3.2, 0.0), (4.2, rng.uniform(0.5, 2.0))),
    ]
    return parts, [True, True, False, True, False]


PLANE_FAMILIES: dict[str, Callable[[np.random.Generator], Built]] = {
    "cut": cut_by_lines,
    "slivers": sliver_cuts,
    "fan": fan,
    "wedge": wedge,
    "small on big": small_on_big,
    "pins": pins,
    "wall": wall_with_chips,
    "squeezed": squeezed_beside_big,
}
MIXED = ("slivers", "small on big", "pins", "wall", "squeezed", "small in space", "pins in space")  # sizes mixed


def plane_shape(rng: np.random.Generator, family: str) -> Plane:
    """A shape of the family, drawn again until it has free blocks, joints, and none too small to be one."""
    while True:
        parts, fixed = PLANE_FAMILIES[family](rng)
        extent = float(np.ptp(np.concatenate(parts), axis=0).max())
        sides = np.concatenate([np.linalg.norm(np.roll(p, -1, axis=0) - p, axis=1) for p in parts])
        if all(fixed) or sides.min() < SMALLEST * extent or not all(map(convex, parts)):
            continue
        joints = plane_joints(parts, fixed, 1e-12 * extent, SMALLEST * extent)
        if not joints:
            continue
        scale = 10.0 ** rng.uniform(-1, 1)
        density = np.where(rng.random(len(parts)) < 0.2, rng.uniform(500.0, 8000.0, len(parts)), DENSITY)
        return Plane(
            tuple(scale * p for p in parts),
            tuple(map(bool, fixed)),
            tuple(density.tolist()),
            float(scale * rng.choice([0.3, 1.0])),
            tuple((a, b, scale * points, normal) for a, b, points, normal in joints),
        )


# --- shapes in space -------------------------------------------------------------------------------------------------


def box(low: Sequence[float], high: Sequence[float]) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
    """An upright box."""
    (x, y, z), (X, Y, Z) = low, high
    corners = [(x, y, z), (X, y, z), (X, Y, z), (x, Y, z), (x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)]
    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    return np.array(corners, float), faces


def cut_solid(solid: tuple, point: np.ndarray, normal: np.ndarray) -> list[tuple]:
    """Both parts of a convex solid; the corners that the cut makes are the same numbers in both."""
    vertex, faces = solid
    height = (vertex - point) @ normal
    if np.all(height >= 0.0) or np.all(height <= 0.0):
        return [solid]
    corner: dict[tuple[int, int], int] = {}
    points = list(vertex)
    halves: tuple[list, list] = ([], [])
    rim: dict[int, int] = {}  # along the lid of the upper half
    for face in faces:
        loops: tuple[list[int], list[int]] = ([], [])
        leaving = entering = -1
        for k, i in enumerate(face):
            j = face[(k + 1) % len(face)]
            loops[0 if height[i] >= 0.0 else 1].append(i)
            if (height[i] >= 0.0) != (height[j] >= 0.0):
                key = (min(i, j), max(i, j))
                if key not in corner:
                    s, e = key
                    t = height[s] / (height[s] - height[e])
                    corner[key] = len(points)
                    points.append(vertex[s] + t * (vertex[e] - vertex[s]))
                loops[0].append(corner[key])
                loops[1].append(corner[key])
                if height[i] >= 0.0:
                    leaving = corner[key]
                else:
                    entering = corner[key]
        for half, loop in zip(halves, loops, strict=True):
            if len(loop) >= 3:
                half.append(tuple(loop))
        if leaving >= 0:
            rim[entering] = leaving
    lid = [next(iter(rim))]
    while (following := rim[lid[-1]]) != lid[0]:
        lid.append(following)
    halves[0].append(tuple(lid))
    halves[1].append(tuple(reversed(lid)))
    result = []
    for half in halves:
        used = sorted({i for face in half for i in face})
        number = {i: k for k, i in enumerate(used)}
        result.append((np.array([points[i] for i in used]), tuple(tuple(number[i] for i in face) for face in half)))
    return result


def cut_by_planes(rng: np.random.Generator) -> tuple[list, list[bool]]:
    """A block cut by planes, right through or in one stone alone."""
    parts = [box((0.0, 0.0, 0.0), (1.0, rng.uniform(0.5, 1.0), rng.uniform(0.5, 1.2)))]
    steep = rng.choice([0.05, 0.3, 1.0])
    for _ in range(int(rng.integers(2, 5))):
        normal = np.eye(3)[int(rng.choice([0, 1, 2], p=[0.3, 0.2, 0.5]))] + rng.normal(0.0, steep, 3)
        normal /= np.linalg.norm(normal)
        chosen = int(rng.integers(len(parts)))
        corners = parts[chosen][0]
        point = corners.min(axis=0) + rng.uniform(0.2, 0.8, 3) * np.ptp(corners, axis=0)
        through = rng.random() < 0.3
        pieces = [cut_solid(p, point, normal) if through or k == chosen else [p] for k, p in enumerate(parts)]
        parts = [piece for pair in pieces for piece in pair]
        if len(parts) > 7:
            break
    corners = [vertex for vertex, _ in parts]
    low, high = np.min([v.min(axis=0) for v in corners], axis=0), np.max([v.max(axis=0) for v in corners], axis=0)
    style = rng.choice(["bottom", "sides", "top"], p=[0.6, 0.25, 0.15])
    fixed = []
    for v in corners:
        bottom, top = abs(v[:, 2].min() - low[2]) < 1e-12, abs(v[:, 2].max() - high[2]) < 1e-12
        side = abs(v[:, 0].min() - low[0]) < 1e-12 or abs(v[:, 0].max() - high[0]) < 1e-12
        fixed.append({"bottom": bottom, "sides": side, "top": top}[style])
    if all(fixed) or not any(fixed):
        chosen = int(rng.integers(len(fixed)))
        fixed[chosen] = not fixed[chosen]
    return parts, fixed


def small_in_space(rng: np.random.Generator) -> tuple[list, list[bool]]:
    """A small stone on a big one: it hangs over an edge or a corner, or slides when gravity leans."""
    small = ratio(rng)
    over = 0.5 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-3, -0.5)
    aside = rng.choice([-0.5, 0.3, 0.45])
    x, y = 1.0 - (1.0 - over) * small, 1.0 - (1.0 - aside) * small if aside > 0 else 0.4
    big = box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    stone = box((x, y, 1.0), (x + small, y + small, 1.0 + small * rng.uniform(0.3, 2.0)))
    return [box((-0.5, -0.5, -0.5), (1.5, 1.5, 0.0)), big, stone], [True, False, False]


def pins_in_space(rng: np.random.Generator) -> tuple[list, list[bool]]:
    """A cube on three or four pins, or on pins that leave a corner without."""
    small = 10.0 ** -rng.uniform(1.0, 3.0)
    places = [(0.0, 0.0), (1.0 - small, 0.0), (0.0, 1.0 - small), (1.0 - small, 1.0 - small)]
    places = [places[k] for k in rng.permutation(4)[: int(rng.integers(3, 5))]]
    shift = rng.uniform(0.0, 0.3, 2) * rng.choice([0.0, 1.0])
    parts = [box((-0.5, -0.5, -0.5), (2.0, 2.0, 0.0))]
    parts += [box((x, y, 0.0), (x + small, y + small, small)) for x, y in places]
    parts.append(box((*shift, small), (1.0 + shift[0], 1.0 + shift[1], 1.0 + small)))
    return parts, [True, *[False] * (len(parts) - 1)]


SPACE_FAMILIES: dict[str, Callable[[np.random.Generator], tuple[list, list[bool]]]] = {
    "cut in space": cut_by_planes,
    "small in space": small_in_space,
    "pins in space": pins_in_space,
}


def space_shape(rng: np.random.Generator, family: str) -> Space:
    """As `plane_shape`."""
    while True:
        parts, fixed = SPACE_FAMILIES[family](rng)
        corners = np.concatenate([vertex for vertex, _ in parts])
        extent = float(np.ptp(corners, axis=0).max())
        sides = [
            np.linalg.norm(v[list(f)] - v[list(np.roll(f, -1))], axis=1).min() for v, faces in parts for f in faces
        ]
        if all(fixed) or min(sides) < SMALLEST * extent:
            continue
        joints = space_joints(parts, fixed, 1e-12 * extent, SMALLEST * extent)
        if not joints:
            continue
        scale = 10.0 ** rng.uniform(-1, 1)
        density = np.where(rng.random(len(parts)) < 0.2, rng.uniform(500.0, 8000.0, len(parts)), DENSITY)
        return Space(
            tuple((scale * vertex, faces) for vertex, faces in parts),
            tuple(map(bool, fixed)),
            tuple(density.tolist()),
            tuple((a, b, scale * points, normal) for a, b, points, normal in joints),
        )


# --- cases -----------------------------------------------------------------------------------------------------------


RBE_SHARES = {
    "cut": 0.18,
    "slivers": 0.1,
    "fan": 0.1,
    "wedge": 0.1,
    "small on big": 0.12,
    "pins": 0.1,
    "wall": 0.1,
    "cut in space": 0.1,
    "small in space": 0.05,
    "pins in space": 0.05,
}
LIMIT_SHARES = {"cut": 0.25, "slivers": 0.1, "fan": 0.15, "wedge": 0.1, "small on big": 0.15, "pins": 0.1, "wall": 0.15}
CRA_SHARES = {
    "cut": 0.25,
    "slivers": 0.05,
    "fan": 0.1,
    "wedge": 0.2,
    "small on big": 0.15,
    "pins": 0.05,
    "wall": 0.1,
    "squeezed": 0.1,
}
SHARES = {"rbe": RBE_SHARES, "cra": CRA_SHARES, "limit": LIMIT_SHARES}
MOST_POINTS = 24  # of a coupled case


def friction(rng: np.random.Generator) -> float:
    """0 to 1.5, none at all in a twelfth."""
    if rng.random() < 1 / 12:
        return 0.0
    return float(rng.uniform(0.05, 1.5) if rng.random() < 0.5 else rng.choice([0.2, 0.3, 0.5, 0.6, 0.7, 0.84]))


def leaning(rng: np.random.Generator, dimension: int) -> np.ndarray:
    """Gravity, straight down in half of all cases, else leaning by up to 35 degrees."""
    angle = 0.0 if rng.random() < 0.5 else float(np.radians(rng.uniform(0.0, 35.0)))
    if dimension == 2:
        return G * np.array([rng.choice([-1, 1]) * np.sin(angle), -np.cos(angle)])
    heading = rng.uniform(0.0, 2 * np.pi)
    return G * np.array([np.sin(angle) * np.cos(heading), np.sin(angle) * np.sin(heading), -np.cos(angle)])


def drawn(kind: str, seed: int, family: str | None = None) -> Case:
    """Case number `seed` of a kind."""
    rng = np.random.default_rng([seed, {"rbe": 1, "cra": 2, "limit": 3}[kind]])
    shares = SHARES[kind]
    chosen = str(rng.choice(list(shares), p=np.array(list(shares.values())) / sum(shares.values())))
    chosen = chosen if family is None else family
    while True:
        shape = plane_shape(rng, chosen) if chosen in PLANE_FAMILIES else space_shape(rng, chosen)
        if kind != "cra" or sum(len(points) for _, _, points, _ in shape.joints) <= MOST_POINTS:
            break
    dimension = 2 if isinstance(shape, Plane) else 3
    case = Case(kind, chosen, shape, friction(rng), leaning(rng, dimension))
    if kind == "limit":
        heading = rng.uniform(0.0, 2 * np.pi) if rng.random() < 0.5 else rng.choice([0.0, np.pi])
        case = replace(case, push=unit(heading))
    if kind == "cra":
        usual = rng.random() < 0.7
        eta, beta = (10.0, 0.01) if usual else (float(rng.choice([3.0, 30.0, 100.0])), float(rng.choice([0.001, 0.1])))
        case = replace(case, eta=eta, beta=beta, plane_only=bool(rng.random() < 0.9))
    return written(case, rng)
