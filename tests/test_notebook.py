"""What a notebook shows: cards in a kernel that really runs, and their refusals."""

import html
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import numpy as np
import pytest

import cyclopean
from cyclopean.api.notebook import SHOWN, card
from cyclopean.design.stones.inventory import Inventory
from cyclopean.design.stones.quarry import quarry
from cyclopean.view import notebook

NOTEBOOK = Path(__file__).parents[1] / "examples" / "wall_in_a_notebook.ipynb"
HEAVIEST = 100_000  # characters of a card


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """The notebook with its outputs, run by a kernel of this very environment."""
    nbclient = pytest.importorskip("nbclient", reason="notebooks are run by nbclient")
    kernels = pytest.importorskip("ipykernel.kernelspec", reason="notebooks are run by ipykernel")
    place = tmp_path_factory.mktemp("kernels")
    kernels.write_kernel_spec(place / "kernels" / "here")
    found = nbformat.read(NOTEBOOK, as_version=4)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JUPYTER_PATH", str(place))
        patch.setenv("IPYTHONDIR", str(place / "ipython"))
        patch.setenv("JUPYTER_RUNTIME_DIR", str(place / "runtime"))
        patch.setenv("PYDEVD_DISABLE_FILE_VALIDATION", "1")
        client = nbclient.NotebookClient(
            found, timeout=120, kernel_name="here", resources={"metadata": {"path": str(place)}}
        )
        client.execute()
    return found


def shown(cell) -> dict[str, str]:
    """What a cell gave, by kind."""
    return next((o["data"] for o in cell.outputs if o.output_type == "execute_result"), {})


def said(text: str) -> str:
    """What a card says, without its pictures."""
    return html.unescape(re.sub(r"<[^>]+>", " ", re.sub(r"<iframe.*?</iframe>", "", text, flags=re.DOTALL)))


@pytest.mark.filterwarnings("ignore")  # of the machinery that runs kernels, not of ours
def test_the_notebook_shows_every_step(executed) -> None:
    last = {cell.source.splitlines()[-1]: shown(cell) for cell in executed.cells if cell.cell_type == "code"}
    names = ["wall", "result", "tilted", "found", "carved", "built", "sequence"]
    assert set(names) <= last.keys()
    for name in names:
        assert "cyclopean-card" in last[name]["text/html"]
        assert "<iframe" in last[name]["text/html"]
        assert len(last[name]["text/html"]) < HEAVIEST
        assert last[name]["text/plain"].startswith("<"), "arrays would fill the page"
        assert len(last[name]["text/plain"]) < 300
    assert "Stable" in said(last["result"]["text/html"])
    assert "Unstable" in said(last["tilted"]["text/html"])
    assert "Stable" in said(last["built"]["text/html"])
    assert "Stands at every stage" in said(last["sequence"]["text/html"])
    assert "Lambda" in said(last["found"]["text/html"])


def test_the_notebook_writes_its_files(executed) -> None:
    printed = "".join(o.text for o in executed.cells[-1].outputs if o.output_type == "stream")
    assert printed == "built.html cutlist.csv proof.json\n"


def test_the_notebook_is_kept_without_outputs() -> None:
    stored = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(stored)
    for cell in stored.cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


@pytest.mark.parametrize("where", sorted(SHOWN))
def test_what_is_shown_is_where_it_is_said_to_be(where) -> None:
    module, name = where
    found = getattr(__import__(module, fromlist=[name]), name)
    assert (found.__module__, found.__qualname__) == where, "IPython looks classes up by these two names"


def test_without_ipython_nothing_is_loaded_and_with_it_cards_are_told() -> None:
    program = """
import sys, types
told = []
formatter = types.SimpleNamespace(for_type_by_name=lambda module, name, how: told.append((module, name)))
display = types.SimpleNamespace(formatters={"text/html": formatter, "text/plain": formatter})
shell = types.SimpleNamespace(display_formatter=display)
sys.modules["IPython"] = types.SimpleNamespace(get_ipython=lambda: shell)
import cyclopean
assert ("cyclopean.analysis.verdict", "Result") in told
assert not {"numpy", "viser", "cyclopean.view"} & sys.modules.keys()
told.clear(); cyclopean.load_ipython_extension(shell); assert told
"""
    subprocess.run([sys.executable, "-c", program], check=True)


def test_a_card_says_what_the_result_says() -> None:
    result = cyclopean.check(cyclopean.stack(3), mu=0.5)
    text = said(card(result))
    assert "Stable" in text
    assert result.reason in text
    assert "density 2400" in text
    assert "cra-state, checked" in text
    assert "mu 0.84" not in text, "it was given"
    assert repr(result) == f"<Result stable: {result.reason}>"
    for thing in (result, result.assembly, result.contacts, result.assembly.blocks[0]):
        assert len(repr(thing)) < 200
        assert "\n" not in repr(thing)
    assert len(text := card(result)) < HEAVIEST
    assert len(text) < len(card(result, scene=True)), "the scene comes by a call"


def test_nothing_of_a_model_gets_into_the_page_as_html() -> None:
    bad = "<script>alert(1)</script>"
    cube = cyclopean.stack(1).blocks[-1]
    model = cyclopean.Assembly((cyclopean.Block(bad, cube.vertices, cube.faces, fixed=True),), name=bad)
    for thing in (model, cyclopean.check(model), cyclopean.build_sequence(model)):
        text = card(thing)
        assert bad not in text
        for frame in re.findall(r'srcdoc="(.*?)"', text, re.DOTALL):
            assert bad not in html.unescape(frame)
            assert "Content-Security-Policy" in html.unescape(frame)


def test_a_model_of_which_nothing_is_held_is_shown_all_the_same() -> None:
    cube = cyclopean.stack(1).blocks[-1]
    free = cyclopean.Assembly((cyclopean.Block("b", cube.vertices, cube.faces, fixed=False),), name="floating")
    assert "0 held" in " ".join(said(card(free)).split())
    assert "0 blocks" in " ".join(said(card(cyclopean.Assembly((), name="nothing"))).split())


def test_a_drawing_that_is_too_heavy_is_left_out(monkeypatch) -> None:
    assert "&lt;svg" in card(cyclopean.stack(2))
    monkeypatch.setattr(notebook, "HEAVIEST", 1000)
    assert "&lt;svg" not in card(cyclopean.stack(2))


def test_stones_show_themselves() -> None:
    stones = quarry(3, seed=1, detail=1)
    text = card(Inventory(stones, notes=tuple(f"note {k}" for k in range(7)), source="my quarry"))
    assert "my quarry" in said(text)
    assert "and 3 more notes" in said(text)
    assert repr(Inventory(stones, source="my quarry")) == "<Inventory 'my quarry', 3>"
    assert "0 stones" in " ".join(said(card(Inventory(()))).split())


def test_other_things_have_no_card() -> None:
    with pytest.raises(cyclopean.InputError, match="card: a ndarray has none"):
        card(np.zeros(3))
