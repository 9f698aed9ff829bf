"""A server for programs that ask over HTTP: Grasshopper, by Hops.

Files by concern: `parameters` says what a component is, `components` are the components, `protocol` puts requests and
answers into the JSON of Hops, `solving` answers one request, `crew` does that in processes that can be ended, `server`
speaks HTTP. Only `server` needs starlette and uvicorn, only `cyclopean.io.rhino_json` rhino3dm (extra `rhino`).
"""

import typing

if typing.TYPE_CHECKING:
    from cyclopean.service.server import Options, serve

__all__ = ["Options", "serve"]


def __getattr__(name: str) -> typing.Any:
    if name not in __all__:
        raise AttributeError(f"module 'cyclopean.service' has no attribute '{name}'")
    import importlib

    return getattr(importlib.import_module("cyclopean.service.server"), name)
