"""Files that the live page saves: the model as it stands, the report, the certificate; under names that are free."""

from collections.abc import Mapping
from pathlib import Path

from cyclopean.errors import InputError
from cyclopean.io import json_text, write_text
from cyclopean.io.model_json import model_dict
from cyclopean.view.page import report_html
from cyclopean.view.studio.session import Snapshot

KINDS: Mapping[str, str] = {"model": ".json", "report": ".html", "certificate": ".certificate.json"}
MOST = 9999  # files of one name, as long as numbers of four digits last


def written(kind: str, snapshot: Snapshot) -> str:
    """What a file of this kind says of a snapshot.

    Parameters
    ----------
    kind : {"model", "report", "certificate"}
        The model has its contacts, with the friction and supports of the page; gravity has no place in it.
    snapshot : Snapshot
        What the page shows.

    Raises
    ------
    InputError
        The verdict has not been proved yet, or cannot be.
    """
    result = snapshot.result
    if kind == "model":
        return json_text(model_dict(result.assembly, result.contacts))
    if snapshot.stage not in ("proved", "undecided"):
        raise InputError(f"no {kind} yet: the verdict is still provisional; wait until it is proved")
    if kind == "report":
        return report_html(result)
    if result.certificate is None:
        raise InputError("nothing is proved, so there is no certificate")
    return json_text(result.certificate)


def claimed(folder: Path, stem: str, ending: str) -> Path:
    """The first of `stem.studio.x`, `stem.studio-2.x` ... that is not there, as an empty file that now is.

    Whoever saves at the same moment gets the next: a name is looked for and taken in one step.

    Raises
    ------
    InputError
        There are too many; or the folder cannot be written into.
    """
    for k in range(1, MOST + 1):
        path = folder / f"{stem}.studio{'' if k == 1 else f'-{k}'}{ending}"
        try:
            path.open("xb").close()
        except FileExistsError:
            continue
        except FileNotFoundError:
            raise InputError("the folder does not exist any more; make it again") from None
        except OSError as error:
            raise InputError(f"{path.name}: cannot be written ({error.strerror})") from None
        return path
    raise InputError(f"the folder holds {MOST} files of this name; move some away")


def save(kind: str, snapshot: Snapshot, folder: Path, stem: str) -> tuple[Path, bytes]:
    """Write a file and return its path and content.

    Raises
    ------
    InputError
        As `written` and `claimed`, in words that do not tell where the folder is; or the disk is full.
    """
    text = written(kind, snapshot)
    path = claimed(folder, stem, KINDS[kind])
    try:
        write_text(path, text)
    except InputError as error:
        path.unlink(missing_ok=True)
        raise InputError(str(error).replace(str(path), path.name)) from None
    return path, text.encode()
