"""Pages and pictures: the report of a check, stones and their cells, how a structure is built.

Names are imported when they are first asked for: a check that draws nothing needs none of them.
"""

import typing

from cyclopean.lazy_exports import lazy_exports as _lazy_exports

if typing.TYPE_CHECKING:
    from cyclopean.view.building import building_html
    from cyclopean.view.page import report_html

__all__ = ["building_html", "report_html"]

__getattr__, __dir__ = _lazy_exports(__name__, {"building": "building_html", "page": "report_html"})
