"""Pages and pictures: the report of a check, stones and their cells, how a structure is built."""

from cyclopean.view.building import building_html
from cyclopean.view.page import report_html

__all__ = ["building_html", "report_html"]
