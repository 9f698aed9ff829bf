"""Models let go in MuJoCo, and the convex parts of stones that are not convex.

MuJoCo collides convex bodies only. A stone is split into patches of its surface, and each patch becomes a part: the
hull of the patch and of the same patch drawn half the way to the stone's centroid. A patch is halved until its part
stands out of the stone by no more than a hundredth of the stone's size, measured on what exact solids say is outside.
"Size" is the cube root of a volume.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from cyclopean.arrays import Floats, Ints
from cyclopean.assembly import Assembly, supports
from cyclopean.geometry import triangles
from cyclopean.geometry.frames import unit
from cyclopean.geometry.solids import Solid, difference, mesh_of, solid_of

DENSITY = 2400.0  # kg/m3
PARTS = 40  # at the least, of a stone that is not convex
OUT = 0.01  # of the stone's size: how far a part may stand out of the stone
TURN = 0.35  # of the stone's size: what a whole turn of the normal counts in telling patches apart
INNER = 0.5  # share of the way to the centroid at which a part ends
SHALLOW = 0.05  # the same where a part of one triangle stands out
FINE = 0.02  # of the stone's size: spacing of the points at which what stands out is measured
NEAR = 12  # triangles looked at for the distance of a point
FLAT = 1e-9  # of the cubed size: a part of less volume is none


@dataclass(frozen=True)
class Rules:
    """How bodies meet in the simulation."""

    step: float  # s
    option: str
    contact: str
    damped: int = 0  # steps in which velocities lose a fifth, until bodies that stand in others by a hair have parted
    flag: str = ""
    level: bool = False  # the first block is level ground without end


# Contacts as stiff as the step allows, for hulls
STIFF = Rules(
    1e-3,
    'impratio="20" noslip_iterations="20" iterations="100" tolerance="1e-10"',
    'solref="0.004 1" solimp="0.99 0.999 0.0001"',
    flag='<flag multiccd="enable"/>',
)
# For thousands of parts, which stand out of their stones by a hundredth
SOFT = Rules(2e-3, 'impratio="5" iterations="30"', 'solref="0.01 1" solimp="0.9 0.97 0.001"', 100, level=True)

XML = """
<mujoco>
  <compiler balanceinertia="true"/>
  <option timestep="{step}" gravity="{gravity}" cone="elliptic" integrator="implicitfast" {option}>{flag}</option>
  <size memory="2G"/>
  <default><geom condim="3" friction="{mu} 0 0" {contact}/><mesh inertia="convex"/></default>
  <asset>{meshes}</asset>
  <worldbody>{bodies}</worldbody>
</mujoco>
"""


def numbers(values: Floats) -> str:
    return " ".join(f"{x:.17g}" for x in np.ravel(values))


def simulation(
    model: Assembly, parts: Sequence[Sequence[Floats]], mu: float, gravity: Floats, rules: Rules, seconds: float
) -> Iterator[tuple[float, Floats, Floats]]:
    """Let the free blocks go; every tenth of a second the time, turn (n, 3, 3) and place (n, 3) of each block.

    Parameters
    ----------
    model : Assembly
    parts : sequence of sequence of (v, 3) Floats
        Corners of the convex parts of each block (m).
    mu : float
        Coefficient of friction.
    gravity : (3,) Floats
        m/s2.
    rules : Rules
    seconds : float
        Simulated.
    """
    import mujoco

    world = mujoco.MjModel.from_xml_string(_xml(model, parts, mu, gravity, rules))
    state = mujoco.MjData(world)
    every = round(0.1 / rules.step)
    for step in range(1, round(seconds / rules.step) + 1):
        mujoco.mj_step(world, state)
        if step <= rules.damped:
            state.qvel *= 0.8
        if step % every == 0:
            yield step * rules.step, state.xmat[1:].reshape(-1, 3, 3).copy(), state.xpos[1:].copy()


def _xml(model: Assembly, parts: Sequence[Sequence[Floats]], mu: float, gravity: Floats, rules: Rules) -> str:
    """The model as MuJoCo reads it, each body about its centroid, with the mass of the stone and not of its parts."""
    fixed, _ = supports(model)
    mass, meshes, bodies = model.mass, [], []
    for k, corners in enumerate(parts):
        centre, tensor = mass.centroid[k], DENSITY * mass.inertia[k]
        names = [f"m{k}.{i}" for i in range(len(corners))]
        meshes += [f'<mesh name="{n}" vertex="{numbers(c - centre)}"/>' for n, c in zip(names, corners, strict=True)]
        shape = "".join(f'<geom type="mesh" mesh="{name}"/>' for name in names)
        if rules.level and k == 0:
            top = model.blocks[0].vertices[:, 2].max() - centre[2]
            shape = f'<geom type="plane" size="5 5 .1" pos="0 0 {top:.17g}"/>'
        whole = numbers(tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
        free = f'<freejoint/><inertial pos="0 0 0" mass="{DENSITY * mass.volume[k]:.17g}" fullinertia="{whole}"/>'
        bodies.append(f'<body name="b{k}" pos="{numbers(centre)}">{"" if fixed[k] else free}{shape}</body>')
    return XML.format(
        step=rules.step, option=rules.option, contact=rules.contact, flag=rules.flag, gravity=numbers(gravity),
        mu=mu, meshes="".join(meshes), bodies="".join(bodies),
    )  # fmt: skip


def hulls(model: Assembly) -> list[list[Floats]]:
    """Every block as one part: for models of convex blocks."""
    return [[block.vertices] for block in model.blocks]


@dataclass(frozen=True, eq=False)
class Parts:
    """Convex parts of one stone."""

    corners: tuple[Floats, ...]  # (v, 3) m each
    out: float  # of the stone's size: how far one of them stands out of the stone, at most
    covered: float  # share of the stone's surface that lies in a part's own patch


def parts_of(vertices: Floats, corner: Ints, most: float = OUT) -> Parts:
    """Fine convex parts of a closed triangle mesh: at least PARTS where it is not convex itself."""
    solid = solid_of(vertices, corner)
    edge = vertices[corner]
    double = np.cross(edge[:, 1] - edge[:, 0], edge[:, 2] - edge[:, 0])
    area = np.linalg.norm(double, axis=1) / 2.0
    size = float(np.cbrt(abs(np.einsum("ti,ti->t", edge[:, 0], double).sum()) / 6.0))
    stone = _Stone(vertices, corner, solid, size, _middle(edge, double), edge.mean(axis=1))
    whole = ConvexHull(vertices)
    if whole.volume - solid.volume() <= 1e-6 * solid.volume():
        return Parts((vertices[whole.vertices],), 0.0, 1.0)
    place = np.hstack([stone.at, TURN * size * unit(double)])
    todo, done, lost = [np.arange(len(corner))], [], 0.0
    while todo:
        patch = max(todo, key=len) if len(todo) + len(done) < PARTS else todo[-1]
        todo = [p for p in todo if p is not patch]
        few = len(todo) + len(done) + 1 < PARTS
        part = None if few and len(patch) > 1 else stone.part(patch, INNER)
        if len(patch) == 1 and (part is None or part[1] > most * size):
            part = stone.part(patch, SHALLOW) or part  # the way to the centroid leads out of the stone
        if len(patch) > 1 and (part is None or part[1] > most * size):
            todo += _halves(patch, place)
        elif part is None:
            lost += float(area[patch].sum())
        else:
            done.append(part)
    return Parts(tuple(c for c, _ in done), max(o for _, o in done) / size, 1.0 - lost / float(area.sum()))


def _middle(edge: Floats, double: Floats) -> Floats:
    """Centroid of the solid within triangles."""
    weight = np.einsum("ti,ti->t", edge[:, 0], np.cross(edge[:, 1], edge[:, 2]))
    return np.asarray(weight @ edge.sum(axis=1) / (4.0 * weight.sum()))


def _halves(patch: Ints, place: Floats) -> list[Ints]:
    """A patch in two, across its longest direction in place and normal."""
    at = place[patch] - place[patch].mean(axis=0)
    along = at @ np.linalg.svd(at, full_matrices=False)[2][0]
    order = np.argsort(along, kind="stable")
    return [patch[order[: len(patch) // 2]], patch[order[len(patch) // 2 :]]]


@dataclass(frozen=True, eq=False)
class _Stone:
    """A stone that is being split."""

    vertices: Floats
    corner: Ints
    solid: Solid
    size: float
    middle: Floats
    at: Floats  # (t, 3) middle of each triangle

    def part(self, patch: Ints, inner: float) -> tuple[Floats, float] | None:
        """Corners of the part of a patch, and how far it stands out (m); None where it has no volume."""
        on = self.vertices[np.unique(self.corner[patch])]
        point = np.concatenate([on, on + inner * (self.middle - on)])
        try:
            hull = ConvexHull(point)
        except QhullError:
            return None
        if not hull.volume > FLAT * self.size**3:
            return None
        corners = point[hull.vertices]
        return corners, self._out(corners)

    def _out(self, corners: Floats) -> float:
        """How far a part stands out of the stone (m), from points spaced by FINE on what is outside."""
        from manifold3d import Manifold

        outside = difference(Manifold.hull_points(corners), self.solid)
        if not outside.volume() > FLAT * self.size**3:
            return 0.0
        point = mesh_of(outside.refine_to_length(FINE * self.size))[0]
        near = cKDTree(self.at).query(point, min(NEAR, len(self.at)))[1]
        return float(_distance(point[:, None], self.vertices[self.corner[near]]).min(axis=1).max())


def _distance(point: Floats, tri: Floats) -> Floats:
    """Distance of points (..., 1, 3) to triangles (..., 3, 3)."""
    side = tri[..., [1, 2, 0], :] - tri
    arm = point[..., None, :] - tri
    along = np.einsum("...i,...i", arm, side) / np.einsum("...i,...i", side, side)
    to_side = np.linalg.norm(arm - np.clip(along, 0.0, 1.0)[..., None] * side, axis=-1).min(axis=-1)
    normal = unit(np.cross(side[..., 0, :], side[..., 1, :]))
    within = (np.einsum("...i,...i", np.cross(normal[..., None, :], side), arm) >= 0.0).all(axis=-1)
    return np.where(within, np.abs(np.einsum("...i,...i", arm[..., 0, :], normal)), to_side)


def model_parts(model: Assembly, most: float = OUT, kept: Path | None = None) -> list[Parts]:
    """Fine parts of every block of a model; those of a stone met before are read from folder `kept`."""
    corner, face = triangles(model.mesh)
    body, start = model.mesh.face_body[face], model.mesh.vertex_start
    return [
        _kept_parts(block.vertices, corner[body == k] - start[k], most, kept) for k, block in enumerate(model.blocks)
    ]


def _kept_parts(vertices: Floats, corner: Ints, most: float, kept: Path | None) -> Parts:
    """Parts of a stone, made once: a stone is told by its triangles and edges, and lies elsewhere in every wall."""
    if kept is None:
        return parts_of(vertices, corner, most)
    edge = np.linalg.norm(vertices[corner] - vertices[corner[:, [1, 2, 0]]], axis=2)
    shape = corner.tobytes() + np.round(edge, 6).tobytes() + repr((most, PARTS, INNER, SHALLOW)).encode()
    path = kept / f"{sha256(shape).hexdigest()[:24]}.npz"
    origin = vertices[corner[0]]
    along, across = origin[1] - origin[0], np.cross(origin[1] - origin[0], origin[2] - origin[0])
    frame = unit(np.array([along, np.cross(across, along), across])).T
    if not path.exists():
        made = parts_of((vertices - origin[0]) @ frame, corner, most)
        count = [len(c) for c in made.corners]
        np.savez(path, at=np.concatenate(made.corners), count=count, told=[made.out, made.covered])
    with np.load(path) as found:
        at = found["at"] @ frame.T + origin[0]
        out, covered = found["told"].tolist()
        return Parts(tuple(np.split(at, np.cumsum(found["count"])[:-1])), out, covered)
