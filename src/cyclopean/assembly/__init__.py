"""Blocks, contacts, loads and supports; contacts found and contacts checked."""

from cyclopean.assembly.blocks import Assembly, Block, Load, supports
from cyclopean.assembly.checking import check_contacts
from cyclopean.assembly.contacts import Contacts
from cyclopean.assembly.detection import Detection, detect, length_tolerance
from cyclopean.assembly.patches import Patch, rough_contacts
from cyclopean.assembly.survey import Survey, Volumes, survey

__all__ = [
    "Assembly",
    "Block",
    "Contacts",
    "Detection",
    "Load",
    "Patch",
    "Survey",
    "Volumes",
    "check_contacts",
    "detect",
    "length_tolerance",
    "rough_contacts",
    "supports",
    "survey",
]
