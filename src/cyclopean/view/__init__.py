"""The report page, its pictures, and the index of several reports."""

from cyclopean.view.building import building_html
from cyclopean.view.contents import IndexEntry, index_entry, index_html
from cyclopean.view.page import report_html

__all__ = ["IndexEntry", "building_html", "index_entry", "index_html", "report_html"]
