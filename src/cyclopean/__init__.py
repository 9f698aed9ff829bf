"""Dry-jointed stone: does it stand, and why? Equilibrium, certificates, geometry.

The names below are all that most scripts need; each is loaded when it is first asked for, so that `import cyclopean`
costs nothing. The rooms (`cyclopean.analysis`, `cyclopean.design`, `cyclopean.io`, ...) hold the rest.
"""

import typing

if typing.TYPE_CHECKING:
    from cyclopean.analysis import Result, Settings, check
    from cyclopean.assembly import Assembly, Block, Contacts, Load, detect
    from cyclopean.design import arch, dome, stack, vault, wall
    from cyclopean.design.construction.sequence import build_sequence
    from cyclopean.design.walls.pattern import PatternSettings
    from cyclopean.design.walls.polygonal import polygonal_wall
    from cyclopean.errors import CyclopeanError, InputError
    from cyclopean.io import read_model, result_dict, write_json, write_model, write_text
    from cyclopean.proof import verify, verify_file
    from cyclopean.view import report_html

__all__ = [
    "Assembly",
    "Block",
    "Contacts",
    "CyclopeanError",
    "InputError",
    "Load",
    "PatternSettings",
    "Result",
    "Settings",
    "arch",
    "build_sequence",
    "check",
    "detect",
    "dome",
    "polygonal_wall",
    "read_model",
    "report_html",
    "result_dict",
    "stack",
    "vault",
    "verify",
    "verify_file",
    "wall",
    "write_json",
    "write_model",
    "write_text",
]

__version__ = "0.1.0"

_HOME = {
    "analysis": "Result Settings check",
    "assembly": "Assembly Block Contacts Load detect",
    "design": "arch dome stack vault wall",
    "design.walls.pattern": "PatternSettings",
    "design.walls.polygonal": "polygonal_wall",
    "design.construction.sequence": "build_sequence",
    "errors": "CyclopeanError InputError",
    "io": "read_model result_dict write_json write_model write_text",
    "proof": "verify verify_file",
    "view": "report_html",
}


def __getattr__(name: str) -> typing.Any:
    import importlib

    room = next((room for room, names in _HOME.items() if name in names.split()), None)
    if room is None:
        raise AttributeError(f"module 'cyclopean' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"cyclopean.{room}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
