"""Names of a room that are imported when they are first asked for (PEP 562)."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

__all__ = ["lazy_exports"]


def lazy_exports(room: str, home: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package, from its modules and the names, between spaces, that each gives."""
    module_of = {name: module for module, names in home.items() for name in names.split()}

    def found(name: str) -> Any:
        if name not in module_of:
            raise AttributeError(f"module '{room}' has no attribute '{name}'")
        value = getattr(import_module(f"{room}.{module_of[name]}"), name)
        if name in sys.modules[room].__all__:  # what is not, such as a hook of another program, stays out of sight
            setattr(sys.modules[room], name, value)
        return value

    return found, lambda: sorted({*vars(sys.modules[room]), *module_of})
