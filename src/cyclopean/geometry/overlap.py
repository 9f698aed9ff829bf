"""Where planar regions of different bodies lie face to face: candidates by boxes and planes, exact polygon overlay."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cyclopean.arrays import Floats, Ints
from cyclopean.geometry.common_area import common_areas
from cyclopean.geometry.coplanar import PlanarRegions
from cyclopean.geometry.frames import cross_2d, frames_from_normals, unit
from cyclopean.geometry.packed import extents, following, offsets, ragged, ragged_batches

__all__ = ["Overlaps", "facing_regions", "region_overlaps"]

GRID = 1e-3  # tolerances: of the grid that decides where they differ
MAX_ANGLE = 0.1  # rad: faces that lean more from each other are not meant to touch


@dataclass(frozen=True, slots=True, eq=False)
class Overlaps:
    """Polygons without holes (m of them, P points) in which two regions touch."""

    pair: Ints  # (m,) which pair of regions
    start: Ints  # (m + 1,) offsets into point
    point: Floats  # (P, 3) m, on the mid-plane, counter-clockwise about the first region's normal
    apart: Floats  # (m, 2) m: least and greatest distance from the first region to the second; negative = they overlap


def facing_regions(
    regions: PlanarRegions, pairs: tuple[Ints, Ints], reach: float | Floats, angle: float = MAX_ANGLE
) -> tuple[Ints, Ints]:
    """Regions (one of body i, one of body j, for the given pairs of bodies) that could touch.

    Kept are those whose boxes come within reach (m; or (m,), one for each pair), whose normals are opposed to within
    the angle (rad), and whose planes come within reach of each other somewhere in the regions.
    """
    none = np.zeros(0, np.int64)
    if not len(regions) or not len(pairs[0]):
        return none, none
    (low, high), (body_low, body_high) = regions.boxes(), regions.body_boxes()
    radius = np.linalg.norm(np.maximum(high - regions.point, regions.point - low), axis=1)
    i, j = pairs
    reach = np.broadcast_to(np.asarray(reach, float), len(i))
    pair_a, region_a = _near(regions.body_start, i, (low, high), (body_low[j], body_high[j]), reach)
    pair_b, region_b = _near(regions.body_start, j, (low, high), (body_low[i], body_high[i]), reach)
    start_b = np.searchsorted(pair_b, np.arange(len(pairs[0]) + 1))
    found: list[tuple[Ints, Ints]] = [(none, none)]
    for entry, position in ragged_batches(start_b, pair_a):
        a, b, within = region_a[entry], region_b[position], reach[pair_a[entry]][:, None]
        opposed = np.einsum("ki,ki->k", regions.normal[a], regions.normal[b]) < -np.cos(angle)
        a, b, within = a[opposed], b[opposed], within[opposed]
        near_box = np.all((low[a] <= high[b] + within) & (low[b] <= high[a] + within), axis=1)
        a, b, within = a[near_box], b[near_box], within[near_box]
        tilt = np.linalg.norm(regions.normal[a] + regions.normal[b], axis=1)
        apart = np.abs(np.einsum("ki,ki->k", regions.point[b] - regions.point[a], regions.normal[a]))
        close = apart <= within[:, 0] + tilt * radius[b]
        found.append((a[close], b[close]))
    return np.concatenate([a for a, _ in found]), np.concatenate([b for _, b in found])


def _near(
    start: Ints, body: Ints, boxes: tuple[Floats, Floats], other: tuple[Floats, Floats], reach: Floats
) -> tuple[Ints, Ints]:
    """Pairs and regions of `body`, with `boxes`, that come within reach of the other body's box, in order."""
    (low, high), (box_low, box_high) = boxes, other
    pair, region = ragged(start, body)
    within = reach[pair][:, None]
    near = np.all((low[region] <= box_high[pair] + within) & (box_low[pair] <= high[region] + within), axis=1)
    return pair[near], region[near]


def region_overlaps(
    regions: PlanarRegions, a: Ints, b: Ints, tolerance: float, gap: float | Floats | None = None
) -> Overlaps:
    """Exact intersection of regions a[k] and b[k], whose normals are opposed, in their common plane.

    Each pair is laid into a frame of its own, about the middle of the smaller region and normal to the mean of the
    two normals. Kept are the parts over which the two planes stay within the gap (m; or one for each pair; by default
    the tolerance) of each other and whose mean width (2 area / perimeter) exceeds the tolerance (m). Points come to
    lie on the mid-plane; those on a straight line between their neighbours, within the gap, are dropped; a part with
    holes is cut through them into parts without.
    """
    import shapely

    if not len(a):
        return Overlaps(np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros((0, 3)), np.zeros((0, 2)))
    most = np.broadcast_to(np.asarray(tolerance if gap is None else gap, float), len(a))
    pairs = _Pairs.of(regions, a, b)
    one, two = pairs.drawn(a), pairs.drawn(b)
    (low, high), (low2, high2) = one.boxes(), two.boxes()
    overlapping = np.all(np.minimum(high, high2) - np.maximum(low, low2) > tolerance, axis=1)  # most do not
    if not overlapping.all():
        found = region_overlaps(regions, a[overlapping], b[overlapping], tolerance, most[overlapping])
        return replace(found, pair=np.flatnonzero(overlapping)[found.pair])
    part, index = _wide_parts(*_polygons(_common(one, two, tolerance)), tolerance)
    outline = shapely.get_exterior_ring(part)
    xy, whose = shapely.get_coordinates(outline, return_index=True)
    closing = np.concatenate([whose[1:] != whose[:-1], [True]])[: len(whose)]
    xy, whose = xy[~closing], whose[~closing]
    start = offsets(np.bincount(whose, minlength=len(part)))
    here = np.arange(len(xy))
    xy = xy[np.where(shapely.is_ccw(outline)[whose], here, start[whose] + start[whose + 1] - 1 - here)]
    loose = np.maximum(
        2.0 * most[index] if gap is not None else np.zeros(len(index)), tolerance
    )  # two outlines drawn so imprecisely
    xy, start = _without_collinear(xy, start, loose)
    return pairs.lifted(index, xy, start, most)


@dataclass(frozen=True, slots=True, eq=False)
class _Drawing:
    """Polygons in the plane, one for each pair, in order."""

    xy: Floats  # (k, 2) m
    start: Ints  # (n + 1,) corners of each polygon, all rings together
    ring_start: Ints  # (r + 1,) corners of each ring
    ring_polygon: Ints  # (r,)

    def boxes(self) -> tuple[Floats, Floats]:
        """(n, 2) lower and (n, 2) upper corners."""
        return extents(self.xy, self.start)

    def shapes(self) -> Any:
        """Shapely polygons, repaired where a ring touches itself."""
        import shapely

        indices = np.repeat(np.arange(len(self.ring_polygon)), np.diff(self.ring_start))
        polygon = shapely.polygons(shapely.linearrings(self.xy, indices=indices), indices=self.ring_polygon)
        broken = ~shapely.is_valid(polygon)
        polygon[broken] = shapely.make_valid(polygon[broken])
        return polygon


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Pairs of regions (n), each with a frame about a point between the two."""

    regions: PlanarRegions
    a: Ints  # (n,)
    b: Ints  # (n,)
    frame: Floats  # (n, 3, 3) normal first
    origin: Floats  # (n, 3) m

    @classmethod
    def of(cls, regions: PlanarRegions, a: Ints, b: Ints) -> "_Pairs":
        frame = frames_from_normals(unit(regions.normal[a] - regions.normal[b]))
        smaller = np.where(regions.area[a] <= regions.area[b], a, b)
        return cls(regions, a, b, frame, regions.point[smaller])

    def drawn(self, region: Ints) -> _Drawing:
        """One region of each pair, laid into its frame."""
        pair, ring = ragged(self.regions.ring_start, region)
        number, position = ragged(self.regions.corner_start, ring)
        away = self.regions.vertex[self.regions.corner[position]] - self.origin[pair[number]]
        xy = np.einsum("ki,kji->kj", away, self.frame[pair[number], 1:])
        start = offsets(np.diff(self.regions.region_corner_start)[region])
        return _Drawing(xy, start, offsets(np.diff(self.regions.corner_start)[ring]), pair)

    def lifted(self, pair: Ints, xy: Floats, start: Ints, most: Floats) -> Overlaps:
        """Put polygons (m) on the mid-plane of their pairs; drop those over which the planes gape or cross too far."""
        if not len(pair):
            return Overlaps(pair, np.zeros(1, np.int64), np.zeros((0, 3)), np.zeros((0, 2)))
        which = np.repeat(pair, np.diff(start))
        flat = self.origin[which] + np.einsum("kj,kji->ki", xy, self.frame[which, 1:])
        up = self.frame[which, 0]
        heights = []
        for side in (self.a[which], self.b[which]):
            normal = self.regions.normal[side]
            down = np.einsum("ki,ki->k", flat - self.regions.point[side], normal)
            heights.append(-down / np.einsum("ki,ki->k", up, normal))
        between = heights[1] - heights[0]
        apart = np.stack([low_high.reduceat(between, start[:-1]) for low_high in (np.minimum, np.maximum)], 1)
        count = np.diff(start)
        middle = np.add.reduceat(heights[0] + heights[1], start[:-1]) / (2.0 * count)
        kept = np.flatnonzero(np.abs(apart).max(axis=1) <= most[pair])
        point = flat + np.repeat(middle, count)[:, None] * up
        return Overlaps(pair[kept], offsets(count[kept]), point[ragged(start, kept)[1]], apart[kept])


def _common(one: _Drawing, two: _Drawing, tolerance: float) -> Any:
    """Shapely intersections.

    With edges that nearly lie on each other, or meet nearly at a corner, GEOS now and then finds nothing, or a whole
    polygon, depending on how they lie in its axes. So the areas are found in another way too, and where they differ the
    corners are put on a grid, which is slow and right.
    """
    import shapely

    a, b = one.shapes(), two.shapes()
    common = shapely.intersection(a, b)
    around = np.maximum(shapely.length(a), shapely.length(b))
    areas = common_areas(*((side.xy, following(side.ring_start), side.start) for side in (one, two)))
    doubted = np.abs(shapely.area(common) - areas) > 0.1 * tolerance * around
    common[doubted] = shapely.intersection(a[doubted], b[doubted], grid_size=GRID * tolerance)
    return common


def _polygons(shape: Any) -> tuple[Any, Ints]:
    """Polygons among the parts of arbitrary shapes, and the shape each comes from."""
    import shapely

    part, index = shapely.get_parts(shape, return_index=True)
    nested, inner = shapely.get_parts(part, return_index=True)  # a collection may hold a multi-polygon
    keep = (shapely.get_type_id(nested) == shapely.GeometryType.POLYGON) & ~shapely.is_empty(nested)
    return nested[keep], np.asarray(index[inner[keep]], np.int64)


def _width(shape: Any) -> Any:
    """Mean width 2 area / perimeter (m): that of a strip, half the side of a square."""
    import shapely

    return 2.0 * shapely.area(shape) / np.maximum(shapely.length(shape), 1e-300)


def _wide_parts(part: Any, index: Ints, tolerance: float) -> tuple[Any, Ints]:
    """Parts wider than the tolerance, cut where they have holes wider than that; narrower holes are filled."""
    import shapely

    wide = shapely.area(part) * 2.0 > tolerance * shapely.length(shapely.get_exterior_ring(part))
    part, index = part[wide], index[wide]
    pierced = shapely.get_num_interior_rings(part) > 0
    if not pierced.any():
        return part, index
    parts, indices = [part[~pierced]], [index[~pierced]]
    for polygon, k in zip(part[pierced], index[pierced], strict=True):
        pieces = [piece for piece in _cut_at_holes(polygon, tolerance) if _width(piece) > tolerance]
        parts.append(np.array(pieces, object))
        indices.append(np.full(len(pieces), k))
    order = np.argsort(np.concatenate(indices), kind="stable")
    return np.concatenate(parts)[order], np.concatenate(indices)[order]


def _cut_at_holes(polygon: Any, tolerance: float) -> list[Any]:
    """Pieces without holes: straight cuts through the middle of a hole, along its longest side, until none is left."""
    import shapely

    todo, done = [polygon], []
    while todo:
        shape = todo.pop()
        holes = [hole for hole in map(shapely.Polygon, shape.interiors) if _width(hole) > tolerance]
        if not holes:
            done.append(shapely.Polygon(shape.exterior))
            continue
        middle, along = _first_cut(holes)
        across = np.array([-along[1], along[0]])
        reach = 2.0 * (float(shape.length) + float(np.abs(middle).max()))
        ends = [middle - reach * along, middle + reach * along]
        for sign in (1.0, -1.0):
            far = [end + sign * reach * across for end in ends[::-1]]
            todo.extend(_polygons(np.array([shape.intersection(shapely.Polygon([*ends, *far]))]))[0])
    return done[::-1]


def _first_cut(holes: list[Any]) -> tuple[Floats, Floats]:
    """Middle of the largest hole and unit direction of its longest side; of equals the one most along, then up, +u.

    Ties are broken by rounded figures, so that neither the order of the faces nor the last digit decides.
    """
    import shapely

    scale = np.sqrt(sum(float(hole.area) for hole in holes))
    middle = np.array([shapely.get_coordinates(hole.centroid)[0] for hole in holes])
    key = [np.round([np.sqrt(hole.area) / scale, *m / scale], 9) for hole, m in zip(holes, middle, strict=True)]
    largest = max(range(len(holes)), key=lambda k: tuple(key[k]))
    side = np.diff(shapely.get_coordinates(holes[largest].exterior), axis=0)
    length, along = np.linalg.norm(side, axis=1), unit(side)
    rank = np.round(np.column_stack([length / scale, np.abs(along[:, 0]), along[:, 0] * along[:, 1]]), 9)
    return middle[largest], along[np.lexsort(rank.T[::-1])[-1]]


def _without_collinear(xy: Floats, start: Ints, tolerance: Floats) -> tuple[Floats, Ints]:
    """Rings without the points that lie within the tolerance (m, one a ring) of the line through their neighbours.

    Of two neighbours only the straighter one goes in a round, so that a round moves the outline by no more than the
    tolerance; rounds go on until nothing moves. A triangle stays as it is.
    """
    while len(xy):
        index, after = np.arange(len(xy)), following(start)
        before = np.argsort(after)
        chord, arm = xy[after] - xy[before], xy - xy[before]
        length = np.linalg.norm(chord, axis=1)
        cross = np.abs(cross_2d(chord, arm))
        height = np.where(length > 0.0, cross / np.where(length > 0.0, length, 1.0), 0.0)
        ring = np.repeat(np.arange(len(start) - 1), np.diff(start))
        loose = (height <= tolerance[ring]) & (np.diff(start) > 3)[ring]
        if not loose.any():
            break
        rank = np.zeros(len(xy), np.int64)
        rank[np.lexsort((index, height))] = index
        rank[~loose] = len(xy)
        drop = loose & (rank < rank[before]) & (rank < rank[after])
        left = np.diff(start) - np.bincount(ring[drop], minlength=len(start) - 1)
        drop &= (left >= 3)[ring]
        if not drop.any():
            break
        start = offsets(np.bincount(ring[~drop], minlength=len(start) - 1))
        xy = xy[~drop]
    return xy, start
