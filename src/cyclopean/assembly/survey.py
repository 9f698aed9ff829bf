"""What is in a model, before anyone asks whether it stands."""

from dataclasses import dataclass

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly.blocks import Assembly, supports
from cyclopean.assembly.contacts import Contacts
from cyclopean.geometry import face_warp, mesh_faults

__all__ = ["Survey", "Volumes", "survey"]

# A face counts as flat when no corner is further than this share of the model's size from its plane.
_FLAT = 1e-6


@dataclass(frozen=True, slots=True)
class Volumes:
    """Volumes (m3) of the blocks whose meshes are sound."""

    count: int
    minimum: float
    lower_quartile: float
    median: float
    upper_quartile: float
    maximum: float
    total: float


@dataclass(frozen=True, slots=True)
class Survey:
    """The facts of a model; every field is plain."""

    name: str
    blocks: int
    supports: int
    support_rule: str  # "file", "lowest", or "none" where the file says that nothing is held
    contacts: int | None  # None = not given, to be detected
    points: int | None
    loads: int
    groups: int
    volumes: Volumes | None  # None where no mesh is sound
    outliers: tuple[str, ...]  # ids of blocks far larger or smaller than the rest (Tukey's fence)
    extent: tuple[float, float, float]  # m, sides of the bounding box
    size: float  # m, its diagonal
    faults: tuple[tuple[str, str], ...]  # (block id, what is wrong with its mesh)
    faces: int
    warped_faces: int  # faces that are not flat, fan-triangulated wherever a volume is taken
    warp: float  # m, furthest corner from the plane of its face
    without_density: int  # blocks for which a density will be assumed
    without_mu: int | None  # contacts for which mu will be assumed; None = contacts not given


def survey(assembly: Assembly, contacts: Contacts | None = None) -> Survey:
    """Count, measure and find fault.

    Parameters
    ----------
    assembly : Assembly
        The model.
    contacts : Contacts, optional
        Those detected; by default those of the model.
    """
    joined = assembly.contacts if contacts is None else contacts
    faults = mesh_faults(assembly.mesh)
    sound = np.ones(len(assembly), bool)
    sound[[i for i, _ in faults]] = False
    none = len(assembly) and all(b.fixed is False for b in assembly.blocks)  # a check refuses such a model
    held, used = ((), "none") if none else supports(assembly)
    warp = face_warp(assembly.mesh)
    vertex = assembly.mesh.vertex
    extent = np.ptp(vertex, axis=0) if len(vertex) else np.zeros(3)
    return Survey(
        name=assembly.name,
        blocks=len(assembly),
        supports=int(np.count_nonzero(held)),
        support_rule=used,
        contacts=None if joined is None else len(joined),
        points=None if joined is None else len(joined.point),
        loads=len(assembly.loads),
        groups=len({b.group for b in assembly.blocks} - {None}),
        volumes=_volumes(assembly.mass.volume[sound]),
        outliers=_outliers(assembly, sound),
        extent=(float(extent[0]), float(extent[1]), float(extent[2])),
        size=assembly.size,
        faults=tuple((assembly.blocks[i].id, what) for i, what in faults),
        faces=len(warp),
        warped_faces=int(np.count_nonzero(~(warp <= _FLAT * assembly.size))),
        warp=float(warp.max(initial=0.0)),
        without_density=sum(b.density is None for b in assembly.blocks),
        without_mu=None if joined is None else int(np.count_nonzero(np.isnan(joined.mu))),
    )


def _volumes(volume: Floats) -> Volumes | None:
    if not len(volume):
        return None
    low, first, middle, third, high = np.percentile(volume, [0, 25, 50, 75, 100]).tolist()
    return Volumes(len(volume), low, first, middle, third, high, float(volume.sum()))


def size_classes(volume: Floats) -> tuple[tuple[float, float, int], ...]:
    """Volumes (n,) in classes of equal width: from, to (m3), and how many; as many as Sturges' rule has, at most eight.

    Stones of one size make none.

    Examples
    --------
    >>> size_classes(np.array([1.0, 1.5, 3.0]))
    ((1.0, 1.6666666666666665, 2), (1.6666666666666665, 2.333333333333333, 0), (2.333333333333333, 3.0, 1))
    """
    if not len(volume) or not np.ptp(volume) > 1e-3 * float(np.median(volume)):
        return ()
    count, edge = np.histogram(volume, min(8, len(np.histogram_bin_edges(volume, "sturges")) - 1))
    return tuple(zip(edge[:-1].tolist(), edge[1:].tolist(), count.tolist(), strict=True))


def _outliers(assembly: Assembly, sound: Bools) -> tuple[str, ...]:
    """Ids of sound blocks beyond Tukey's fence, 1.5 interquartile ranges from the quartiles.

    Stones cut to one size have no range at all, so the fence is never nearer than a thousandth of the median.
    """
    volume = assembly.mass.volume
    chosen = np.flatnonzero(sound)
    if not len(chosen):
        return ()
    first, middle, third = np.percentile(volume[chosen], [25, 50, 75])
    reach = 1.5 * max(third - first, 1e-3 * middle)
    beyond = (volume[chosen] < first - reach) | (volume[chosen] > third + reach)
    return tuple(assembly.blocks[i].id for i in chosen[beyond])
