"""Geometry that knows nothing of stone: frames, polygon meshes, mass properties, planar regions and their overlaps."""

from cyclopean.geometry.arrangement import arrangement
from cyclopean.geometry.boxes import box_pairs
from cyclopean.geometry.coplanar import PlanarRegions, flattened, planar_regions
from cyclopean.geometry.frames import crossed, frames_from_normals, newell_normals, rotations
from cyclopean.geometry.overlap import Overlaps, facing_regions, region_overlaps
from cyclopean.geometry.packed import components, following, offsets, ragged, ragged_batches
from cyclopean.geometry.penetration import convex_bodies, penetration_depths
from cyclopean.geometry.polyhedra import (
    MassProperties,
    Polyhedra,
    face_normals,
    face_warp,
    mass_properties,
    mesh_faults,
    pack,
    triangles,
)
from cyclopean.geometry.power_diagram import power_diagram
from cyclopean.geometry.shells import detached_pieces
from cyclopean.geometry.subdivision import Subdivision, dissolved, merged, subdivide

__all__ = [
    "MassProperties",
    "Overlaps",
    "PlanarRegions",
    "Polyhedra",
    "Subdivision",
    "arrangement",
    "box_pairs",
    "components",
    "convex_bodies",
    "crossed",
    "detached_pieces",
    "dissolved",
    "face_normals",
    "face_warp",
    "facing_regions",
    "flattened",
    "following",
    "frames_from_normals",
    "mass_properties",
    "merged",
    "mesh_faults",
    "newell_normals",
    "offsets",
    "pack",
    "penetration_depths",
    "planar_regions",
    "power_diagram",
    "ragged",
    "ragged_batches",
    "region_overlaps",
    "rotations",
    "subdivide",
    "triangles",
]
