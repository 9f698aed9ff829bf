"""The same question to the command line, to Python and to Grasshopper has the same answer, to the last digit."""

import json

import pytest

import cyclopean
from cyclopean.analysis import Settings
from cyclopean.api.checking import CheckOptions, SequenceOptions
from cyclopean.api.limiting import LimitOptions
from cyclopean.io import json_text, limit_dict, result_dict
from cyclopean.options import options_of

for name in ("rhino3dm", "starlette", "uvicorn"):
    pytest.importorskip(name, reason=f"{name} of the extra rhino is not installed")

from cyclopean.service.components.catalogue import COMPONENTS  # noqa: E402
from cyclopean.service.inputs import input_name  # noqa: E402
from cyclopean.service.parameters import Context  # noqa: E402
from cyclopean.service.solving import solved  # noqa: E402
from hops_cases import one, request, vector  # noqa: E402
from laws import quick  # noqa: E402

RAISED = Context(seconds=75.0)  # of which 0.8 are for the search: 60 s, as elsewhere
LOADED = {
    "loads": [{"block": "v05", "force": [0.0, 0.0, -3000.0], "case": "snow"}],
    "combinations": [{"name": "winter", "factors": {"self": 1.0, "snow": 1.5}}],
}
SINKS = "springer-right:0.01,0,0"

# Options as they are typed, and as Python writes them; Grasshopper is given the same numbers, and texts where it has no
# type for what is meant.
CASES = [
    ({}, {}),
    ({"mu": "0.6"}, {"mu": 0.6}),
    ({"mu": "0.3"}, {"mu": 0.3}),  # too little: it slides
    ({"density": "2000", "method": "rbe"}, {"density": 2000.0, "method": "rbe"}),
    ({"margins": False}, {"margins": False}),
    *([] if quick() else [({"margins": True}, {"margins": True})]),  # takes as long as all the rest
    ({"supports": "ids=springer-left,springer-right"}, {"supports": "ids=springer-left,springer-right"}),
    ({"gravity": "0.5,0,-9.8"}, {"gravity": (0.5, 0.0, -9.8)}),
    ({"tilt": "5,180"}, {"tilt": (5.0, 180.0)}),
    ({"tilt": "20"}, {"tilt": 20}),
    ({"tolerance": "1e-5"}, {"tolerance": 1e-5}),
    ({"weights": "1,2"}, {"weights": (1.0, 2.0)}),
    ({"cone": "inscribed:8"}, {"cone": "inscribed:8"}),
    ({"solver": "clarabel", "method": "rbe"}, {"solver": "clarabel", "method": "rbe"}),
    ({"combination": "winter"}, {"combination": "winter"}),
    ({"factor": ["snow=4", "self=0.9"]}, {"factors": {"snow": 4.0, "self": 0.9}}),
    ({"tension": "20000"}, {"tension": 20000.0}),
    ({"cohesion": "5000", "mu": "0.7"}, {"cohesion": 5000.0, "mu": 0.7}),
    ({"settlement": [SINKS]}, {"settlement": {"springer-right": (0.01, 0.0, 0.0)}}),
    ({"settlement": [SINKS], "steps": "2"}, {"settlement": {"springer-right": (0.01, 0.0, 0.0)}, "steps": 2}),
    ({"penalty": True, "mu": "0.7"}, {"penalty": True, "mu": 0.7}),
    (
        {"eps": "2", "eta": "30", "beta_min": "0.05", "nodes": "50"},
        {"eps": 2.0, "eta": 30.0, "beta_min": 0.05, "nodes": 50},
    ),
    (
        {"vary": ["mu=0.3:0.5"], "samples": "4", "seed": "3", "method": "rbe"},
        {"vary": ("mu=0.3:0.5",), "samples": 4, "seed": 3, "method": "rbe"},
    ),
]


@pytest.fixture
def model(tmp_path, monkeypatch):
    """File of an arch with a load case and a combination."""
    monkeypatch.chdir(tmp_path)
    cyclopean.write_model("arch.json", cyclopean.arch(6, span=3.0, thickness=0.3))
    document = json.loads((tmp_path / "arch.json").read_text())
    (tmp_path / "arch.json").write_text(json.dumps(document | LOADED))
    return tmp_path / "arch.json"


def typed(options) -> list[str]:
    """Options as words of the command line."""
    words = []
    for name, value in options.items():
        word = name.replace("_", "-")
        if isinstance(value, bool):
            words.append(f"--{word}" if value else f"--no-{word}")
        else:
            words += [f"--{word}={text}" for text in (value if isinstance(value, list) else [value])]
    return words


def connected(options, said) -> dict:
    """Options as inputs: numbers and vectors, and texts for the rest."""
    inputs = {}
    for name, value in said.items():
        text = options.get("factor" if name == "factors" else "load" if name == "loads" else name)
        if name == "tilt":
            inputs |= {"Tilt": float(text.partition(",")[0]), "Azimuth": float(text.partition(",")[2] or 0.0)}
        else:
            vectorial = isinstance(value, tuple) and name in ("gravity", "push")
            plain = isinstance(value, bool | int | float)
            inputs[input_name(name)] = vector(*value) if vectorial else value if plain else text
    return inputs


def untimed(document):
    """A result without the times that it took."""
    if isinstance(document, dict):
        return {key: untimed(value) for key, value in document.items() if key != "seconds"}
    return [untimed(value) for value in document] if isinstance(document, list) else document


def served(component, inputs):
    """What the component answers."""
    status, body = solved(component, json.dumps(request(component, inputs, "Meters")).encode(), RAISED)
    answer = json.loads(body)
    assert (status, answer["errors"]) == (200, [])
    return json.loads(one(answer, "Result"))


@pytest.mark.parametrize(("options", "said"), CASES, ids=lambda case: ",".join(case) or "nothing")
def test_a_check_is_the_same_from_everywhere(run, model, options, said) -> None:
    if options and "margins" not in options:  # they have cases of their own
        options, said = options | {"margins": False}, said | {"margins": False}
    status, out, _ = run("check", model, *typed(options), "--json", "-")
    by_command = json.loads(out)
    by_python = json.loads(json_text(result_dict(cyclopean.check(model, **said))))
    by_http = served("check", {"Model": model.read_text(), **connected(options, said)})
    assert status == {"stable": 0, "unstable": 1, "undecided": 3}[by_command["verdict"]]
    assert set(by_command) == set(by_python) == set(by_http)
    assert untimed(by_command) == untimed(by_python) == untimed(by_http)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"push": "1,0,0", "mu": "0.7"}, {"push": (1.0, 0.0, 0.0), "mu": 0.7}),
        ({"push": "1,0,0", "tension": "5000"}, {"push": (1.0, 0.0, 0.0), "tension": 5000.0}),
        ({"push": "1,0,0", "combination": "winter"}, {"push": (1.0, 0.0, 0.0), "combination": "winter"}),
        (
            {"push": "1,0,0", "pushover": "1deg", "steps": "2"},
            {"push": (1.0, 0.0, 0.0), "pushover": "1deg", "steps": 2},
        ),
    ],
    ids=lambda case: ",".join(case),
)
def test_a_limit_is_the_same_from_everywhere(run, model, options, said) -> None:
    by_command = json.loads(run("limit", model, *typed(options), "--json", "-")[1])
    by_python = json.loads(json_text(limit_dict(cyclopean.limit(model, **said))))
    by_http = served("limit", {"Model": model.read_text(), **connected(options, said)})
    assert untimed(by_command) == untimed(by_python) == untimed(by_http)


def test_every_option_is_an_input() -> None:
    """What a server decides itself is no input: how long it works."""
    for component, kinds, own in (
        ("check", (Settings, CheckOptions), {"seconds"}),
        ("limit", (LimitOptions,), {"seconds", "loads", "tilt"}),  # Azimuth, and Load with Load Block
        ("sequence", (SequenceOptions,), {"order"}),
    ):
        names = {one.name: one for one in COMPONENTS[component].inputs}
        for kind in kinds:
            for name, option in options_of(kind).items():
                assert name in own or input_name(name) in names, name
                if name not in own | {"tilt"}:
                    assert names[input_name(name)].access == ("list" if option.repeated else "item")


def test_margins_are_found_when_they_are_asked_for(model, monkeypatch, unasked) -> None:
    from cyclopean import analysis

    asked = []
    found = analysis.margins
    monkeypatch.setattr(analysis, "margins", lambda *given: asked.append(1) or found(*given))
    result = cyclopean.check(model)
    assert not asked
    assert result.margins is result.margins is not None
    assert len(asked) == 1
    assert cyclopean.check(model, margins=False).margins is None
    assert cyclopean.check(model, mu=0.3).margins is None, "it falls as it is"
