"""One request, answered: bytes in, status and bytes out. Nothing that a client sends gets out of here as an exception.

Runs in a process of its own (`worker_pool`), because the geometry of a request is read by a library in C++, and because
a solve may have to be ended.
"""

import json
import traceback
from typing import Any

from cyclopean.errors import CyclopeanError, InputError
from cyclopean.io.files import one_line
from cyclopean.service.components.catalogue import COMPONENTS
from cyclopean.service.inputs import input_name
from cyclopean.service.parameters import Context
from cyclopean.service.protocol import OutdatedError, answered, inputs_of, refusal, request_of

DONE, BAD_REQUEST, UNKNOWN, OUTDATED, INTERNAL, NO_MEMORY = 200, 400, 404, 500, 500, 503


def solved(path: str, body: bytes, context: Context) -> tuple[int, bytes]:
    """Answer one request.

    Parameters
    ----------
    path : str
        Of the component; "" where the request names it, as Hops does.
    body : bytes
        The request.
    context : Context
        What the component may do.

    Returns
    -------
    status : int
        Of HTTP. What is wrong with the values of a request has 200, as Hops expects.
    body : bytes
        JSON in ASCII.
    """
    try:
        status, answer = _solved(path, body, context)
        return status, encoded(answer)
    except MemoryError:
        return NO_MEMORY, encoded(refusal(["not enough memory for a model of this size"]))
    except Exception as error:  # noqa: BLE001  a fault of ours is told to the client, and the server goes on
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{last.filename.rpartition('cyclopean/')[2]}:{last.lineno}"
        said = f"internal error, please report it: {type(error).__name__}: {one_line(str(error), 200)} ({where})"
        return INTERNAL, encoded(refusal([said]))


def _solved(path: str, body: bytes, context: Context) -> tuple[int, dict[str, Any]]:
    try:
        request = request_of(body)
        name = path or request.get("pointer")
        if not isinstance(name, str):
            raise InputError('request: has no "pointer" to a component')
    except InputError as error:
        return BAD_REQUEST, refusal([str(error)])
    name = name.strip("/")
    component = COMPONENTS.get(name)
    if component is None:
        return UNKNOWN, refusal([f"there is no component '{one_line(name, 60)}'; GET / lists them"])
    try:
        values, units, assumed = inputs_of(component, request)
        answer = component.run(values, context)
        done = answered(component, answer, units, request)
    except OutdatedError as error:
        return OUTDATED, refusal(["Bad inputs", str(error)])
    except CyclopeanError as error:
        return DONE, refusal([error.spelt(input_name)])
    done["warnings"] = [*assumed, *done["warnings"]]
    return DONE, done


def encoded(answer: dict[str, Any]) -> bytes:
    """JSON in ASCII, whatever is in the text."""
    return json.dumps(answer, allow_nan=False, separators=(",", ":")).encode("ascii")
