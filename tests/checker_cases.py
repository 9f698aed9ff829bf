"""Certificates by chance and ways to damage them, to hold two checkers against each other."""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

import cyclopean
from coupled_cases import beams
from cyclopean import Settings
from cyclopean.assembly import DIRECTIONS, Assembly, Load
from cyclopean.proof import seal

Certificate = dict[str, Any]
SUBSTITUTES = (
    None,
    True,
    "1",
    [],
    {},
    0,
    -1,
    1.0,
    1e200,
    1e-200,
    float("nan"),
    9007199254740993,
    10**40,
    "x\ud800\u20ac",
)


def any_model(rng: np.random.Generator) -> Assembly:
    """A stack, an arch, a wall, a vault or a dome, some with loads, some held in part."""
    mu = float(rng.choice([0.0, *rng.uniform(0.2, 1.0, 6)]))
    made = {
        "stack": lambda: cyclopean.stack(
            int(rng.integers(1, 6)), tuple(rng.uniform(0.3, 1.0, 3)), slope=float(rng.uniform(0.0, 40.0)), mu=mu
        ),
        "leaning": lambda: cyclopean.stack(int(rng.integers(2, 6)), offset=float(rng.uniform(0.0, 0.4)), mu=mu),
        "arch": lambda: cyclopean.arch(
            int(rng.integers(3, 12)), span=3.0, thickness=float(rng.uniform(0.08, 0.5)), mu=mu,
            facets=int(rng.integers(1, 3)),
        ),
        "wall": lambda: cyclopean.wall(int(rng.integers(2, 4)), int(rng.integers(1, 4)), mu=mu),
        "vault": lambda: cyclopean.vault(int(rng.integers(4, 7)), 2, thickness=float(rng.uniform(0.1, 0.3)), mu=mu),
        "beams": lambda: beams(0.5, 0.4, 0.3, int(rng.integers(1, 3)), float(rng.uniform(-0.2, 0.1))),
        "uneven": lambda: _uneven(cyclopean.stack(int(rng.integers(1, 4)), (0.5, 0.4, 0.3), mu=mu), rng),
        "dome": lambda: cyclopean.dome(int(rng.integers(2, 4)), 6, thickness=float(rng.uniform(0.1, 0.4)), mu=mu),
    }  # fmt: skip
    model = made[str(rng.choice(list(made)))]()
    if rng.random() < 0.15:  # a support that holds in part only
        held = tuple(name for name in DIRECTIONS if rng.random() < 0.7)[:5] or ("z",)
        last = max(k for k, block in enumerate(model.blocks) if block.fixed)
        blocks = (*model.blocks[:last], replace(model.blocks[last], fixed=None, held=held), *model.blocks[last + 1 :])
        model = replace(model, blocks=blocks)
    if rng.random() < 0.3:
        block = int(rng.integers(len(model)))
        push = rng.normal(0.0, rng.choice([100.0, 3000.0]), 3)
        model = replace(model, loads=(Load(block, push, model.mass.centroid[block]),))
    return model


def _uneven(model: Assembly, rng: np.random.Generator) -> Assembly:
    """Rough stones: every corner moved a little, contacts still to be found."""
    blocks = [
        replace(block, vertices=block.vertices + rng.normal(0.0, 8e-4, block.vertices.shape)) for block in model.blocks
    ]
    return replace(model, blocks=tuple(blocks), contacts=None)


def as_points(certificate: Certificate) -> Certificate:
    """The same proof about a model that touches at the corners of its contacts alone."""
    if any({"tension", "surface"} & contact.keys() for contact in certificate["contacts"]) or "within" in certificate:
        return certificate
    copy = json.loads(json.dumps(certificate))
    copy["contacts"] = []
    for contact in certificate["contacts"]:
        p = np.array(contact["polygon"])
        normal = sum(np.cross(p[i] - p[0], p[i + 1] - p[0]) for i in range(1, len(p) - 1))
        as_point = {"surface": "point", "normal": [float(x) for x in np.asarray(normal)]}
        copy["contacts"] += [contact | as_point | {"polygon": [corner]} for corner in contact["polygon"]]
    copy["seal"] = seal(copy)
    return copy


def any_certificate(rng: np.random.Generator) -> Certificate | None:
    """The proof of an answer about a model by chance, some taken for one at points; None where there is none."""
    found = _any_proof(rng)
    return as_points(found) if found is not None and rng.random() < 0.15 else found


def _any_proof(rng: np.random.Generator) -> Certificate | None:
    try:
        return _proof_of(any_model(rng), rng)
    except cyclopean.InputError:  # such as a settlement of a block that no contact joins
        return None


def _proof_of(model: Assembly, rng: np.random.Generator) -> Certificate | None:
    way = rng.random()
    if way < 0.25:
        settings = Settings(seconds=5.0, nodes=100)
    elif way < 0.4:
        settings = Settings(method="rbe")
    elif way < 0.5:
        settings = Settings(method="rbe", tension=float(rng.choice([10.0, 1e3, 1e5])))
    elif way < 0.6:
        settings = Settings(method="rbe", cone=str(rng.choice(["inscribed:8", "circumscribed:6"])))
    elif way < 0.7:
        settings = Settings(method="rbe", within=float(rng.choice([1e-4, 1e-3, 5e-3])))
    elif way < 0.8 and any(block.fixed for block in model.blocks):
        support = str(rng.choice([block.id for block in model.blocks if block.fixed]))
        settings = Settings(method="rbe", settlement=((support, tuple(float(x) for x in rng.normal(0.0, 1e-3, 6))),))
    else:
        name = str(rng.choice([block.id for block in model.blocks if not block.fixed]))
        live = [{"push": (1.0, 0.0, 0.0)}, {"tilt": 30.0}, {"loads": ((name, (0.0, 100.0, -1000.0), None),)}]
        return cyclopean.limit(model, **live[int(rng.integers(3))]).certificate
    return cyclopean.check(model, settings, rough=None if model.contacts else 0.01).certificate


def damaged(certificate: Certificate, rng: np.random.Generator) -> str:
    """Text of a certificate with something changed anywhere; most are sealed again, some have their text damaged."""
    copy = json.loads(json.dumps(certificate))
    for _ in range(1 + int(rng.random() < 0.2)):
        _change(copy, rng)
    if rng.random() < 0.9:
        with suppress(ValueError):  # of NaN there is none
            copy["seal"] = seal(copy)
    text = json.dumps(copy, sort_keys=True, separators=(",", ":"))
    if rng.random() < 0.1:
        at = int(rng.integers(len(text)))
        text = [text[:at], text[:at] + str(rng.choice(list('0"]}-.e\\'))) + text[at + 1 :], text + "{"][
            int(rng.integers(3))
        ]
    return text


def _change(root: Certificate, rng: np.random.Generator) -> None:
    """Change one value in place: any key of the certificate is as likely, then any branch below it."""
    holder: Any = root
    key: Any = str(rng.choice([name for name in root if name != "seal"]))
    while isinstance(holder[key], dict | list) and len(holder[key]) and rng.random() < 0.93:
        holder = holder[key]
        names = list(holder) if isinstance(holder, dict) else range(len(holder))
        key = names[int(rng.integers(len(names)))]
    value = holder[key]
    if isinstance(value, bool):
        holder[key] = not value
    elif isinstance(value, int | float) and abs(value) < 1e150 and rng.random() < 0.85:
        holder[key] = _other_number(value, rng)
    elif isinstance(value, list) and len(value) > 1 and rng.random() < 0.7:
        _reorder(value, rng)
    elif rng.random() < 0.3:
        del holder[key]
    else:
        holder[key] = SUBSTITUTES[int(rng.integers(len(SUBSTITUTES)))]


def _other_number(value: float, rng: np.random.Generator) -> float:
    changes: list[Callable[[], float]] = [
        lambda: -value,
        lambda: 0.0,
        lambda: int(value) + 1,
        lambda: value * (1 + 2.0 ** -float(rng.integers(1, 53))),
        lambda: value * (1 - 2.0 ** -float(rng.integers(1, 53))),
        lambda: value + float(rng.normal()) * 10.0 ** float(rng.integers(-16, 2)),
        lambda: float(value),
        lambda: value * 10.0 ** float(rng.integers(-12, 13)),
    ]
    return changes[int(rng.integers(len(changes)))]()


def _reorder(items: list[Any], rng: np.random.Generator) -> None:
    at, other = (int(x) for x in rng.integers(len(items), size=2))
    if (way := rng.random()) < 0.3:
        del items[at]
    elif way < 0.5:
        items.insert(at, json.loads(json.dumps(items[other])))
    elif way < 0.6:
        items.reverse()
    else:
        items[at], items[other] = items[other], items[at]
