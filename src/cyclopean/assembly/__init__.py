"""Blocks, contacts, loads and supports; contacts found and contacts checked."""

from cyclopean.assembly.blocks import (
    DIRECTIONS,
    Action,
    Assembly,
    Block,
    FrictionPair,
    Settlement,
    held_directions,
    supports,
)
from cyclopean.assembly.checking import bearing, bearing_cones, check_contacts
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.detection import Detection, detect
from cyclopean.assembly.field_forces import resolved_fields, surcharge_loads, with_soil
from cyclopean.assembly.field_loads import Earth, Fill, Water, earth_coefficient
from cyclopean.assembly.healing import Healing, heal
from cyclopean.assembly.joint_wear import worn
from cyclopean.assembly.loading import Loading, load_cases, loading, resolved_loads, surface_loads_at_points
from cyclopean.assembly.loads import DEAD, SELF, BodyLoad, Combination, Load, SurfaceLoad
from cyclopean.assembly.materials import paired_friction
from cyclopean.assembly.mending import MendedAssembly, mended
from cyclopean.assembly.near_misses import Forgiven, NearMisses, grounded, meant
from cyclopean.assembly.parts import part
from cyclopean.assembly.patches import Patch, rough_contacts
from cyclopean.assembly.precision import length_tolerance
from cyclopean.assembly.road import Road
from cyclopean.assembly.slips import slips
from cyclopean.assembly.steep_beds import SteepBed, steep_beds
from cyclopean.assembly.survey import Survey, Volumes, size_classes, survey

__all__ = [
    "DEAD",
    "DIRECTIONS",
    "SELF",
    "Action",
    "Assembly",
    "Block",
    "BodyLoad",
    "Combination",
    "Contacts",
    "Detection",
    "Earth",
    "Fill",
    "Forgiven",
    "FrictionPair",
    "Healing",
    "Load",
    "Loading",
    "MendedAssembly",
    "NearMisses",
    "Patch",
    "Road",
    "Settlement",
    "SteepBed",
    "SurfaceLoad",
    "Survey",
    "Volumes",
    "Water",
    "bearing",
    "bearing_cones",
    "check_contacts",
    "detect",
    "earth_coefficient",
    "grounded",
    "heal",
    "held_directions",
    "length_tolerance",
    "load_cases",
    "loading",
    "meant",
    "mended",
    "paired_friction",
    "part",
    "resolved_fields",
    "resolved_loads",
    "rough_contacts",
    "size_classes",
    "slips",
    "steep_beds",
    "supports",
    "surcharge_loads",
    "surface_loads_at_points",
    "survey",
    "with_soil",
    "worn",
]
