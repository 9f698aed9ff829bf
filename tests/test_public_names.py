"""Every room's `__all__` is sorted and is exactly what stands there."""

import importlib
import types
from pathlib import Path

import pytest

import cyclopean

ROOMS = sorted(f"cyclopean.{p.parent.name}" for p in Path(cyclopean.__file__).parent.glob("*/__init__.py"))


@pytest.mark.parametrize("room", ["cyclopean", *ROOMS])
def test_public_names(room: str) -> None:
    module = importlib.import_module(room)
    names = list(module.__all__)
    assert names == sorted(names, key=lambda n: (not n.isupper(), n.islower() or n[0].islower(), n)), "not sorted"
    for name in names:
        assert getattr(module, name) is not None
    reachable = {
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and not isinstance(value, types.ModuleType)
    }
    assert reachable <= set(names), f"public but not in __all__: {reachable - set(names)}"
