"""All components, by the path of their address."""

from cyclopean.service.components.building import SEQUENCE, SETTLE
from cyclopean.service.components.checking import CHECK
from cyclopean.service.components.limiting import LIMIT
from cyclopean.service.components.matching import CARVE, MATCH
from cyclopean.service.components.walls import POLYGONAL_WALL
from cyclopean.service.parameters import Component

COMPONENTS: dict[str, Component] = {
    component.path: component for component in (CHECK, LIMIT, POLYGONAL_WALL, MATCH, CARVE, SEQUENCE, SETTLE)
}
