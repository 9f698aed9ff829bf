"""Output files: every path is looked at before the work begins, and nothing is written before it is done."""

import os
import stat
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from cyclopean.cli.terminal import as_option, say, say_json, warn
from cyclopean.errors import InputError

STANDARD_OUTPUT = "-"
MESHES = (".glb", ".obj", ".ply", ".stl")


@dataclass(frozen=True, slots=True)
class Files:
    """The files that a command writes, by option, and whether JSON alone goes to standard output."""

    to: Mapping[str, Path]
    only_json: bool = False

    @classmethod
    def planned(cls, asked: Mapping[str, str], sources: Iterable[str] = (), models: Collection[str] = ()) -> Self:
        """Look at the paths that were given, by option, and at what is read and must stay; refusals as `planned`.

        Raises
        ------
        InputError
            As `planned`; or DXF is to be written, and ezdxf is not installed.
        """
        if "dxf" in asked:
            from cyclopean.io.extras import extra

            extra("dxf", where="`dxf`: ")
        outputs = {as_option(name): text for name, text in asked.items()}
        held = tuple(as_option(name) for name in models)
        found = planned(outputs, models=held)
        for source in sources:
            planned(outputs, keep=source, models=held)
        to = {name: found[as_option(name)] for name in asked if as_option(name) in found}
        return cls(to, asked.get("json") == STANDARD_OUTPUT)

    def within(self, place: Path, names: Iterable[str], sources: Iterable[str]) -> "Files":
        """These, and files of given names in a folder; refusals as `planned`."""
        inside = {name: place / name for name in names}
        outputs = {f"--out {name}": str(path) for name, path in inside.items()}
        outputs |= {as_option(name): str(path) for name, path in self.to.items()}
        planned(outputs)
        for source in sources:
            planned(outputs, keep=source)
        return Files({**inside, **self.to}, self.only_json)

    def proof(self, certificate: object) -> Path | None:
        """Where the certificate is to be written, if there is one; a warning where one was asked for in vain."""
        file = self.to.get("certificate")
        if file is None or certificate is not None:
            return file
        old = "; the file that is there is of an earlier run" if file.is_file() else ""
        warn(f"`certificate` {file}: nothing was proved, so no certificate is written{old}")
        return None

    def points(self, proofs: Sequence[Mapping[str, Any] | None]) -> tuple[dict[str, Path], str]:
        """Files beside the certificate for points of a path, by name, and how many of them are proved, in words."""
        file, told = self.to.get("certificate"), f"{sum(one is not None for one in proofs)} of {len(proofs)} proved"
        if file is None:
            return {}, told
        there = {
            f"step-{k:02d}": file.with_name(f"{file.stem}-step-{k:02d}{file.suffix}")
            for k, found in enumerate(proofs)
            if found is not None
        }
        names = list(there.values())
        return there, f"{told}, in {names[0]} to {names[-1].name}" if names else told

    def write(self, contents: Mapping[str, Callable[[], Any]]) -> None:
        """Compose what was asked for, by option, then write all of it: text, plain data, or what writes itself."""
        from cyclopean import io
        from cyclopean.api.saving import write_content

        made = {name: compose() for name, compose in contents.items() if name in self.to}
        with io.together():
            for name, content in made.items():
                if content is not None:
                    write_content(self.to[name], content)

    def tell(self, data: Mapping[str, Any], lines: Iterable[str]) -> None:
        """Say what came out: as JSON where that is to be on standard output, else line by line."""
        if self.only_json:
            say_json(data)
        else:
            say("\n".join(lines))

    def line(self, but: Collection[str] = (), wide: int = 7) -> list[str]:
        """The line that names the files written, its first word so many columns wide."""
        names = [str(path) for name, path in self.to.items() if name not in but]
        return [f"  {'written':{wide}}  {', '.join(names)}"] if names else []


def planned(
    outputs: Mapping[str, str | None], *, keep: str | None = None, models: Collection[str] = ()
) -> dict[str, Path]:
    """Check the output files of one command.

    Parameters
    ----------
    outputs : mapping of str to str
        Option and the path given for it; None, and `-` (standard output) for `--json`, are left out of the answer.
    keep : str, optional
        The input file, which no output may overwrite; or a folder of stones, to which no mesh file may be added either.
    models : collection of str
        Options that name model files, which are no meshes.

    Returns
    -------
    dict of str to Path
        Option and where to write.

    Raises
    ------
    InputError
        A folder that does not exist, a path that is no file or may not be written, a file named twice, the input, or a
        mesh file where it would be read as a stone the next time, or where a model is written.
    """
    found: dict[str, Path] = {}
    for option, text in outputs.items():
        if text is None or (text == STANDARD_OUTPUT and option == "--json"):
            continue
        path = _writable(option, text)
        if keep is not None and _same(path, Path(keep)):
            raise InputError(f"{option} {text}: this is the input file; choose another name")
        mesh = path.suffix.lower() in MESHES
        inside = os.path.realpath(path.parent), os.path.dirname(os.path.realpath(path))  # it, or a link to it
        if mesh and keep is not None and os.path.isdir(keep) and os.path.realpath(keep) in inside:
            raise InputError(f"{option} {text}: lies among the stones and would be read as one; choose another folder")
        if mesh and option in models:
            raise InputError(f"{option} {text}: a model file ends in .json; a mesh holds no contacts (use convert)")
        for other, taken in found.items():
            if _same(path, taken):
                raise InputError(f"{option} {text}: {other} writes to the same file")
        found[option] = path
    return found


def folder(option: str, text: str | None, default: str) -> Path:
    """Find the folder to write to; only the default one is made when it is not there.

    Raises
    ------
    InputError
        The folder does not exist, is not a folder, or may not be written.
    """
    if text == "":
        raise InputError(f"{option}: '' is no folder; . is this one")
    path = Path(default if text is None else text)
    try:
        if text is None:
            path.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{option} {path}: {_why(error)}") from None
    if not path.is_dir():
        raise InputError(f"{option} {path}: {'is not a folder' if os.path.lexists(path) else 'no such folder'}")
    if not os.access(path, os.W_OK | os.X_OK):
        raise InputError(f"{option} {path}: no permission to write there")
    return path


def seen_from(page: Path | None, file: Path | None) -> str | None:
    """Name a file as seen from the folder of another one, or from here where that is standard output."""
    if file is None:
        return None
    return os.path.relpath(file, os.curdir if page is None else page.parent).replace(os.sep, "/")


def _writable(option: str, text: str) -> Path:
    if not text or text.startswith("-"):
        raise InputError(f"{option}: '{text}' is no file name (one that begins with - is written ./-)")
    path = Path(text)
    try:
        mode = _mode(path)
        if mode is not None and stat.S_ISDIR(mode):
            raise InputError(f"{option} {text}: is a folder; name a file in it")
        if text.endswith(("/", os.sep)):
            raise InputError(f"{option} {text}: is the name of a folder, not of a file")
        folder = Path(os.path.realpath(path)).parent  # a link may point elsewhere
        if mode is None and not folder.is_dir():
            raise InputError(f"{option} {text}: the folder '{path.parent}' does not exist; make it first")
    except (OSError, ValueError) as error:  # too long a name, a null character, a loop of links
        raise InputError(f"{option} {text}: {_why(error)}") from None
    replaced = mode is None or stat.S_ISREG(mode)
    if (replaced and not os.access(folder, os.W_OK | os.X_OK)) or (mode is not None and not os.access(path, os.W_OK)):
        raise InputError(f"{option} {text}: no permission to write there")
    return path


def _mode(path: Path) -> int | None:
    """Kind and permissions of what is there, or None where nothing is; a loop of links is an error."""
    try:
        return path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None


def _same(path: Path, other: Path) -> bool:
    """Whether two names are one file, links followed; devices may be written to twice."""
    try:
        if path.exists() and other.exists():
            return path.samefile(other) and path.is_file()
        return os.path.realpath(path) == os.path.realpath(other)
    except (OSError, ValueError):  # the input is no path: its reader says so
        return False


def _why(error: OSError | ValueError) -> str:
    return (getattr(error, "strerror", None) or str(error)).lower()
