"""The report page, its pictures, and the index of several reports."""

from cyclopean.view.contents import IndexEntry, index_entry, index_html
from cyclopean.view.page import report_html

__all__ = ["IndexEntry", "index_entry", "index_html", "report_html"]
