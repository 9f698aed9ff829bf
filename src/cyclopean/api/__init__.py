"""One call for each thing that a person does first; the rooms below hold the rest.

Every function here takes a file or an object where the rooms take objects only, and options as keywords where the rooms
take a settings object. What comes back is what the rooms give, so the two can be mixed at will.
"""

import typing

from cyclopean.lazy_exports import lazy_exports as _lazy_exports

if typing.TYPE_CHECKING:
    from cyclopean.api.checking import build_sequence, check
    from cyclopean.api.inputs import HasAssembly, Model, Stones
    from cyclopean.api.limiting import limit
    from cyclopean.api.notebook import card, load_ipython_extension
    from cyclopean.api.saving import save
    from cyclopean.api.site import site_set
    from cyclopean.api.stones import StoneCarving, StoneMatch, StoneTradeoff, carve, match, settle, tradeoff
    from cyclopean.api.verifying import verify, verify_file
    from cyclopean.api.walls import chosen_pattern, interlock, polygonal_wall

__all__ = [
    "HasAssembly",
    "Model",
    "StoneCarving",
    "StoneMatch",
    "StoneTradeoff",
    "Stones",
    "build_sequence",
    "card",
    "carve",
    "check",
    "chosen_pattern",
    "interlock",
    "limit",
    "load_ipython_extension",
    "match",
    "polygonal_wall",
    "save",
    "settle",
    "site_set",
    "tradeoff",
    "verify",
    "verify_file",
]

# Loaded when first asked for: a command that reads a file needs no analysis
__getattr__, __dir__ = _lazy_exports(
    __name__,
    {
        "checking": "build_sequence check",
        "inputs": "HasAssembly Model Stones",
        "limiting": "limit",
        "notebook": "card load_ipython_extension",
        "saving": "save",
        "site": "site_set",
        "stones": "StoneCarving StoneMatch StoneTradeoff carve match settle tradeoff",
        "verifying": "verify verify_file",
        "walls": "chosen_pattern interlock polygonal_wall",
    },
)
