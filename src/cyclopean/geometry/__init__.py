"""Geometry that knows nothing of stone: frames, polygon meshes, mass properties, planar regions and their overlaps."""

from cyclopean.geometry.coplanar import PlanarRegions, planar_regions
from cyclopean.geometry.frames import frames_from_normals, newell_normals
from cyclopean.geometry.overlap import Overlaps, box_pairs, facing_regions, region_overlaps
from cyclopean.geometry.packed import ragged, ragged_batches
from cyclopean.geometry.penetration import convex_bodies, penetration_depths
from cyclopean.geometry.polyhedra import (
    MassProperties,
    Polyhedra,
    face_normals,
    mass_properties,
    mesh_faults,
    pack,
    triangles,
)

__all__ = [
    "MassProperties",
    "Overlaps",
    "PlanarRegions",
    "Polyhedra",
    "box_pairs",
    "convex_bodies",
    "face_normals",
    "facing_regions",
    "frames_from_normals",
    "mass_properties",
    "mesh_faults",
    "newell_normals",
    "pack",
    "penetration_depths",
    "planar_regions",
    "ragged",
    "ragged_batches",
    "region_overlaps",
    "triangles",
]
