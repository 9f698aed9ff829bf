"""Dry-jointed stone: does it stand, and why? Equilibrium, certificates, geometry.

The names below are all that most scripts need; each is loaded when it is first asked for, so that `import cyclopean`
costs nothing. The rooms (`cyclopean.analysis`, `cyclopean.design`, `cyclopean.io`, ...) hold the rest. Ten of them are
needed first: Assembly, read_model, check, limit, polygonal_wall, match, carve, settle, build_sequence and save.
"""

import sys
import typing

from cyclopean.lazy_exports import lazy_exports as _lazy_exports

if typing.TYPE_CHECKING:
    from cyclopean.analysis import LimitResult, Result, Settings
    from cyclopean.api import (
        StoneCarving,
        StoneMatch,
        StoneTradeoff,
        build_sequence,
        card,
        carve,
        check,
        interlock,
        limit,
        match,
        polygonal_wall,
        save,
        settle,
        site_set,
        tradeoff,
        verify,
        verify_file,
    )
    from cyclopean.assembly import Assembly, Block, Contacts, Load, detect
    from cyclopean.design import arch, dome, stack, vault, wall
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.errors import CyclopeanError, InputError
    from cyclopean.io import read_model, read_stones, result_dict, write_json, write_model, write_text
    from cyclopean.view import report_html

__all__ = [
    "Assembly",
    "Block",
    "Contacts",
    "CyclopeanError",
    "InputError",
    "LimitResult",
    "Load",
    "PatternSettings",
    "Result",
    "Settings",
    "StoneCarving",
    "StoneMatch",
    "StoneTradeoff",
    "arch",
    "build_sequence",
    "card",
    "carve",
    "check",
    "detect",
    "dome",
    "interlock",
    "limit",
    "match",
    "polygonal_wall",
    "read_model",
    "read_stones",
    "report_html",
    "result_dict",
    "save",
    "settle",
    "site_set",
    "stack",
    "tradeoff",
    "vault",
    "verify",
    "verify_file",
    "wall",
    "write_json",
    "write_model",
    "write_text",
]

__version__ = "0.1.0"

__getattr__, __dir__ = _lazy_exports(
    __name__,
    {
        "analysis": "LimitResult Result Settings",
        "api": "StoneCarving StoneMatch StoneTradeoff build_sequence card carve check interlock limit match"
        " polygonal_wall save settle site_set tradeoff verify verify_file",
        "api.notebook": "load_ipython_extension",
        "assembly": "Assembly Block Contacts Load detect",
        "design": "arch dome stack vault wall",
        "design.walls.pattern": "PatternSettings",
        "errors": "CyclopeanError InputError",
        "io": "read_model read_stones result_dict write_json write_model write_text",
        "view": "report_html",
    },
)


def _show_in_notebooks() -> None:
    """Where IPython runs, tell it how to show what these functions give."""
    shell = sys.modules["IPython"].get_ipython()
    if shell is not None:
        __getattr__("load_ipython_extension")(shell)


if "IPython" in sys.modules:
    _show_in_notebooks()
