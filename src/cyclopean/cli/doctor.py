"""`doctor`: what is installed, what is missing and how to get it, and does the core do its work here?"""

import os
import platform
import shutil
import sys
import tempfile
import time
from contextlib import redirect_stderr, redirect_stdout
from importlib import import_module, metadata
from io import StringIO
from json import dumps
from pathlib import Path
from typing import Annotated, Any

from cyclopean import __version__
from cyclopean.cli.command import command, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.terminal import say
from cyclopean.errors import CyclopeanError, InputError

# Name of the distribution, and of the module that it must give.
CORE = (
    ("numpy", "numpy"), ("scipy", "scipy.sparse"), ("clarabel", "clarabel"), ("rslab", "rslab"),
    ("shapely", "shapely"), ("manifold3d", "manifold3d"), ("viser", "viser"), ("typer", "typer"), ("rich", "rich"),
)  # fmt: skip
EXTRAS = {
    "osqp": (("osqp", "osqp"),),
    "check": (("mujoco", "mujoco"),),
    "cluster": (("distributed", "distributed"),),
    "rhino": (("rhino3dm", "rhino3dm"), ("starlette", "starlette"), ("uvicorn", "uvicorn")),
    "ifc": (("ifcopenshell", "ifcopenshell"),),
    "dxf": (("ezdxf", "ezdxf"),),
    "plot": (("matplotlib", "matplotlib"),),
    "pdf": (("reportlab", "reportlab.pdfgen.canvas"),),
    "peer": (("compas-cra", "compas_cra"),),
}
FOR_WHAT = {
    "osqp": "another solver",
    "check": "comparison with MuJoCo",
    "cluster": "match on a dask cluster",
    "rhino": "Rhino files, Grasshopper",
    "ifc": "IFC files",
    "dxf": "DXF files",
    "plot": "plots",
    "pdf": "sheets to build from",
    "peer": "comparison with compas_cra",
}
# What an import of a broken package has been seen to raise: a missing library is an OSError, a binary that was built
# against another numpy a ValueError, RuntimeError or AttributeError.
BROKEN = (ImportError, OSError, ValueError, RuntimeError, AttributeError, TypeError, SystemError)
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")


@command()
def doctor(files: Annotated[Files, written("json")] = Files({})) -> int:
    """Look at what is installed, what is missing, and whether the core does its work here.

    Exit status: 0 the core works, 1 something of it is broken (extras are never needed), 2 bad input.
    """
    data = _examined()
    for path in files.to.values():
        try:
            from cyclopean import io
        except BROKEN:  # what writes files is part of the core
            raise InputError(f"--json {path}: cannot be written, for the core is broken; use --json -") from None
        io.write_json(path, data)
    if files.only_json:
        say(dumps(data, indent=1, allow_nan=False))
    else:
        say("\n".join(_lines(data)))
    return 0 if data["works"] else 1


def _examined() -> dict[str, Any]:
    """Everything that is looked at."""
    core = [_package(*pair) for pair in CORE]
    test = _self_test()
    return {
        "schema": "cyclopean.doctor/1",
        "works": test["error"] is None and all(package["error"] is None for package in core),
        "cyclopean": __version__,
        "python": platform.python_version(),
        "executable": sys.executable,
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "core": core,
        "extras": {name: _extra(name) for name in EXTRAS},
        "self_test": test,
        "browser": next((found for name in BROWSERS if (found := shutil.which(name))), None),
        "cache": _cache(),
        "temporary": _temporary(),
        "threads": {"cores": _cores(), "set": {name: os.environ[name] for name in THREADS if name in os.environ}},
    }


def _extra(name: str) -> dict[str, Any]:
    """Packages of an extra, and how to get them."""
    packages = [_package(*pair) for pair in EXTRAS[name]]
    return {
        "there": all(package["error"] is None for package in packages),
        "for": FOR_WHAT[name],
        "install": f"pip install 'cyclopean[{name}]'",
        "packages": packages,
    }


def _package(name: str, module: str) -> dict[str, Any]:
    """Version of a package, and what is wrong with it; imported, for a version alone says little."""
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return {"name": name, "version": None, "error": "not installed"}
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):  # some print what they then raise
        error = _import_error(module)
    return {"name": name, "version": version, "error": error}


def _import_error(module: str) -> str | None:
    """What goes wrong when a module is imported."""
    try:
        import_module(module)
    except BROKEN as error:
        return f"{type(error).__name__}: {_short(str(error))}"
    return None


def _short(text: str, most: int = 160) -> str:
    line = " ".join(text.split())
    return line if len(line) <= most else f"{line[:most]}..."


def _self_test() -> dict[str, Any]:
    """A stack of three is proved to stand, and the proof checked."""
    began = time.perf_counter()
    try:
        from cyclopean.analysis import check
        from cyclopean.design import stack
        from cyclopean.proof import verify

        result = check(stack(3))
        proved = result.certificate is not None and verify(result.certificate).proved
        error = None if result.verdict == "stable" and proved else f"three cubes came out {result.verdict}"
    except (*BROKEN, CyclopeanError) as wrong:
        error = f"{type(wrong).__name__}: {_short(str(wrong))}"
    return {"error": error, "seconds": time.perf_counter() - began}


def _cache() -> dict[str, Any]:
    """Where scanned stones are kept once they are read, and how much of it there is."""
    try:
        from cyclopean.io.stone_cache import cache_folder
    except BROKEN:
        return {"folder": None, "files": 0, "bytes": 0}
    folder = cache_folder()
    sizes = []
    if folder is not None and folder.is_dir():
        for file in folder.glob("*.npz"):
            try:
                sizes.append(file.stat().st_size)
            except OSError:  # gone since
                continue
    return {"folder": None if folder is None else str(folder), "files": len(sizes), "bytes": sum(sizes)}


def _temporary() -> dict[str, Any]:
    """Folder for passing files, and whether one can be written there."""
    try:
        with tempfile.NamedTemporaryFile() as file:
            file.write(b"x")
            return {"folder": str(Path(file.name).parent), "writable": True}
    except OSError as error:
        return {"folder": error.filename, "writable": False}


def _cores() -> int:
    """Processors that this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return len(allowed(0)) if allowed is not None else os.cpu_count() or 1


def _lines(data: dict[str, Any]) -> list[str]:
    """Write the same for a person."""
    test = data["self_test"]
    lines = [
        f"cyclopean {data['cyclopean']} on Python {data['python']}, {data['system']}",
        f"  python     {data['executable']}",
        f"  core       {', '.join(_said(package) for package in data['core'])}",
    ]
    for package in data["core"]:
        if package["error"] is not None:
            name = package["name"]
            lines.append(f"  BROKEN     {name}: {package['error']}; pip install --force-reinstall {name}")
    for name, extra in data["extras"].items():
        lines.append(f"  {name:10} {_extra_line(extra)}")
    browser = data["browser"] or "none found; pages can be opened elsewhere, pictures cannot be taken of them"
    lines.append(f"  browser    {browser}")
    cache = data["cache"]
    kept = f"{cache['folder']}, {cache['files']} files, {cache['bytes'] / 1e6:.1f} MB" if cache["folder"] else "none"
    lines.append(f"  cache      {kept}")
    temporary = data["temporary"]
    lines.append(f"  temporary  {temporary['folder']}{'' if temporary['writable'] else ' CANNOT be written'}")
    threads = data["threads"]
    said = "".join(f", {name}={value}" for name, value in threads["set"].items())
    lines.append(f"  threads    {threads['cores']} cores{said}")
    how = "three cubes proved to stand and the proof checked" if test["error"] is None else f"FAILED: {test['error']}"
    lines.append(f"  self-test  {how}, {test['seconds']:.2f} s")
    lines.append("the core works" if data["works"] else "something of the core is BROKEN")
    return lines


def _said(package: dict[str, Any]) -> str:
    if package["version"] is None:
        return f"{package['name']} MISSING"
    return f"{package['name']} {package['version']}{'' if package['error'] is None else ' BROKEN'}"


def _extra_line(extra: dict[str, Any]) -> str:
    if extra["there"]:
        return f"{', '.join(_said(package) for package in extra['packages'])} ({extra['for']})"
    wrong = [p for p in extra["packages"] if p["error"] is not None]
    broken = [f"{p['name']} {p['version']} is broken ({p['error']})" for p in wrong if p["version"] is not None]
    why = "; ".join(broken) if broken else "missing"
    return f"{why}: {extra['install']} ({extra['for']})"
