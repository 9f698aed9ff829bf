"""One call for each thing that a person does first; the rooms below hold the rest.

Every function here takes a file or an object where the rooms take objects only, and options as keywords where the rooms
take a settings object. What comes back is what the rooms give, so the two can be mixed at will.
"""

import typing

if typing.TYPE_CHECKING:
    from cyclopean.api.checking import build_sequence, check
    from cyclopean.api.inputs import HasAssembly, Model, Stones
    from cyclopean.api.limiting import limit
    from cyclopean.api.notebook import card, load_ipython_extension
    from cyclopean.api.saving import save
    from cyclopean.api.stones import StoneCarving, StoneMatch, carve, match, settle
    from cyclopean.api.verifying import verify, verify_file
    from cyclopean.api.walls import polygonal_wall

__all__ = [
    "HasAssembly",
    "Model",
    "StoneCarving",
    "StoneMatch",
    "Stones",
    "build_sequence",
    "card",
    "carve",
    "check",
    "limit",
    "load_ipython_extension",
    "match",
    "polygonal_wall",
    "save",
    "settle",
    "verify",
    "verify_file",
]

_HOME = {  # loaded when first asked for: a command that reads a file needs no analysis
    "checking": "build_sequence check",
    "inputs": "HasAssembly Model Stones",
    "limiting": "limit",
    "notebook": "card load_ipython_extension",
    "saving": "save",
    "stones": "StoneCarving StoneMatch carve match settle",
    "verifying": "verify verify_file",
    "walls": "polygonal_wall",
}


def __getattr__(name: str) -> typing.Any:
    import importlib

    module = next((module for module, names in _HOME.items() if name in names.split()), None)
    if module is None:
        raise AttributeError(f"module 'cyclopean.api' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"cyclopean.api.{module}"), name)
    globals()[name] = value
    return value
