"""A server for programs that ask over HTTP: Grasshopper, by Hops.

Files by concern: `parameters` says what a component is, `components` are the components, `protocol` puts requests and
answers into the JSON of Hops, `solving` answers one request, `worker_pool` does that in processes that can be ended,
`server` speaks HTTP. Only `server` needs starlette and uvicorn, only `io.rhino_json` rhino3dm (extra `rhino`).
"""

import typing

from cyclopean.lazy_exports import lazy_exports as _lazy_exports

if typing.TYPE_CHECKING:
    from cyclopean.service.server import Options, serve

__all__ = ["Options", "serve"]


__getattr__, __dir__ = _lazy_exports(__name__, {"server": "Options serve"})
