"""Laws of coupled analysis: units, place, direction, order, triangulation, density and names are not mechanics.

Small models whose word is known by hand (stacks on slopes, beams squeezed between columns) or does not hang on the
last per cent (arches, walls, wedges). Each is mapped by what must not matter, all at once or one by one; the word must
stay, and the certificate of the mapped model must verify and bear a second opinion. What matters is tested too.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from coupled_cases import beams, shaft
from cyclopean.analysis import Result, Settings, check
from cyclopean.assembly import Assembly, Contacts, Load
from cyclopean.design import arch, stack, wall
from cyclopean.proof import seal, verify
from laws import examples, nightly
from near_limit import G
from second_opinion import conditions
from test_laws import cut, mapped, rotation

LAWS = settings(
    max_examples=examples(40),
    deadline=None,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=[HealthCheck.too_slow],
)
FEW = settings(LAWS, max_examples=examples(6))
DOWN = np.array([0.0, 0.0, -G])


def between(low: float, high: float) -> st.SearchStrategy[float]:
    """Fifty-one numbers, all of the same magnitude."""
    return st.integers(0, 50).map(lambda i: low + (high - low) * i / 50)


@dataclass(frozen=True)
class Question:
    """A model, its gravity (m/s2), density (kg/m3) and options, and the word where it is known."""

    model: Assembly
    gravity: np.ndarray
    options: dict[str, Any]
    word: str
    density: float = 2400.0


def asked(question: Question, **change: Any) -> Result:
    """The answer: with a proof that the checker and the second opinion accept, and the word that is known."""
    options = {"method": "cra", "gravity": tuple(question.gravity), "density": question.density, "seconds": 30.0}
    result = check(question.model, Settings(**{**options, **question.options, **change}))
    assert result.certificate is not None, f"{result.verdict} for {question.word}: {result.reason}"
    assert verify(result.certificate).proved
    assert conditions(result.certificate) <= 0.0
    assert result.verdict == question.word
    return result


def turned(degrees: float) -> np.ndarray:
    t = np.radians(degrees)
    return G * np.array([np.sin(t), 0.0, -np.cos(t)])


# --- models whose word is known --------------------------------------------------------------------------------------


@st.composite
def stacks(draw: st.DrawFn) -> Question:
    """On a slope t: it slides where tan t > mu, and tips where tan t > b / (n h)."""
    count, breadth = draw(st.integers(1, 3)), draw(between(0.4, 1.5))
    height, mu = draw(between(0.3, 0.8)), draw(between(0.2, 1.0))
    limit = min(mu, breadth / (count * height))
    share = draw(st.sampled_from([0.5, 0.95, 1.05, 2.0]))
    model = stack(count, (breadth, 0.7, height))
    word = "stable" if share < 1.0 else "unstable"
    return Question(model, turned(np.degrees(np.arctan(share * limit))), {"mu": mu}, word)


@st.composite
def frames(draw: st.DrawFn) -> Question:
    """H frames that pitch far less than eta allows: stable where mu >= h / a."""
    half, flat = draw(between(0.3, 1.0)), draw(between(1.1, 2.3))
    share = draw(st.sampled_from([0.4, 0.7, 1.05, 2.0]))
    model = beams(half, half / flat, half * draw(between(0.8, 1.4)))
    return Question(model, DOWN, {"mu": share / flat}, "stable" if share > 1.0 else "unstable")


@st.composite
def leaning(draw: st.DrawFn) -> Question:
    """Arches of twice the least thickness, walls tilted by half of what slides, keystones and blocks in shafts.

    A keystone slides down by eps / lean to overlap by eps at both ends: well below eta.
    """
    kind = draw(st.sampled_from(["arch", "wall", "keystone", "shaft"]))
    if kind == "arch":
        model = arch(draw(st.integers(3, 7)), radius=1.0, thickness=draw(between(0.25, 0.5)))
        return Question(model, DOWN, {"mu": draw(between(0.6, 1.0))}, "stable")
    if kind == "wall":
        model = wall(2, draw(st.integers(2, 3)), depth=draw(between(0.3, 0.6)))
        return Question(model, turned(draw(between(0.0, 10.0))), {"mu": 0.7}, "stable")
    half, height = draw(between(0.5, 1.0)), draw(between(0.4, 1.0))
    if kind == "keystone":
        model = beams(half, height, 0.7, 1, lean=draw(between(0.15, 0.4)))
        return Question(model, DOWN, {"mu": draw(between(0.05, 0.8))}, "stable")
    return Question(shaft(half, height, 0.7), DOWN, {"mu": draw(between(0.1, 0.8))}, "stable")


@st.composite
def loaded(draw: st.DrawFn) -> Question:
    """A load that holds a stack of two down, well inside its middle."""
    model = stack(2, (1.0, 0.8, draw(between(0.3, 0.6))))
    weight = 2400.0 * model.mass.volume[-1] * G
    force = weight * np.array([draw(between(-0.1, 0.1)), draw(between(-0.1, 0.1)), -draw(between(0.5, 2.0))])
    loads = (Load(len(model) - 1, force, model.mass.centroid[-1] + [0.05, -0.02, 0.1]),)
    return Question(replace(model, loads=loads), DOWN, {"mu": 0.7}, "stable")


questions = st.one_of(stacks(), frames(), leaning(), loaded())

# --- what must not matter --------------------------------------------------------------------------------------------


def remapped(q: Question, points: Callable[[Any], Any], forces: Callable[[Any], Any], turn: Any = None) -> Question:
    gravity = q.gravity if turn is None else q.gravity @ turn.T
    model = mapped(q.model, points, forces)
    # the supports are those of the model as it stood
    held = [b.fixed for b in q.model.blocks]
    blocks = tuple(replace(b, fixed=f) for b, f in zip(model.blocks, held, strict=True))
    return replace(q, model=replace(model, blocks=blocks), gravity=gravity)


def scaled(q: Question, size: float) -> Question:
    return remapped(q, lambda x: size * x, lambda f: size**3 * f)


def moved(q: Question, away: Any) -> Question:
    return remapped(q, lambda x: x + np.array(away), lambda f: f)


def rotated(q: Question, seed: int) -> Question:
    turn = rotation(seed)
    return remapped(q, lambda x: x @ turn.T, lambda f: f @ turn.T, turn)


def denser(q: Question, factor: float) -> Question:
    return replace(remapped(q, lambda x: x, lambda f: factor * f), density=factor * q.density)


def shuffled(q: Question, seed: int, half_turned: bool) -> Question:
    """Blocks, contacts and corners in another order under other names; some contacts told from the other side."""
    model, rng = q.model, np.random.default_rng(seed)
    assert model.contacts is not None
    order = rng.permutation(len(model))
    place, contacts = np.argsort(order), model.contacts
    pairs, polygons = [], []
    for k in rng.permutation(len(contacts)):
        pair, polygon = (int(place[contacts.a[k]]), int(place[contacts.b[k]])), contacts.polygon(int(k))
        polygon = np.roll(polygon, int(rng.integers(len(polygon))), axis=0)
        back = half_turned and rng.random() < 0.5
        pairs.append(pair[::-1] if back else pair)
        polygons.append(polygon[::-1] if back else polygon)
    blocks = tuple(replace(model.blocks[i], id=f"{rng.integers(1e9)}-{i}") for i in order)
    loads = tuple(replace(load, block=int(place[load.block])) for load in model.loads)
    return replace(q, model=Assembly(blocks, Contacts.of(pairs, polygons), loads))


def triangulated(q: Question, seed: int) -> Question:
    """Contacts found anew on triangles."""
    rng = np.random.default_rng(seed)
    blocks = tuple(cut(b, rng) for b in q.model.blocks)
    return replace(q, model=Assembly(blocks, None, q.model.loads))


@LAWS
@given(questions)
def test_the_word_by_hand(question: Question) -> None:
    asked(question)


@nightly
@LAWS
@given(questions, st.sampled_from([1e-3, 0.037, 12.5, 1e3]))
def test_size(question: Question, size: float) -> None:
    asked(scaled(question, size))


@nightly
@LAWS
@given(questions, st.tuples(*[between(-1e4, 1e4)] * 3))
def test_place(question: Question, away: tuple[float, float, float]) -> None:
    asked(moved(question, away))


@nightly
@LAWS
@given(questions, st.integers(0, 10**6))
def test_direction(question: Question, seed: int) -> None:
    asked(rotated(question, seed))


@nightly
@LAWS
@given(questions, st.sampled_from([1e-3, 0.01, 4.0, 1e3]))
def test_density(question: Question, factor: float) -> None:
    asked(denser(question, factor))


@nightly
@LAWS
@given(questions, st.integers(0, 10**6), st.booleans())
def test_order_names_and_sides(question: Question, seed: int, half_turned: bool) -> None:
    asked(shuffled(question, seed, half_turned))


@LAWS
@given(questions, st.integers(0, 10**6))
def test_triangulation_and_detection(question: Question, seed: int) -> None:
    asked(triangulated(question, seed))


@settings(LAWS, max_examples=examples(40, 4))
@given(questions, st.integers(0, 10**6), between(0.1, 50.0), st.tuples(*[between(-1e4, 1e4)] * 3))
def test_all_at_once(question: Question, seed: int, size: float, away: tuple[float, float, float]) -> None:
    """Ten kilometres away and turned, lengths of metres are known to 1e-12 m: the word does not hang on that."""
    asked(moved(scaled(rotated(shuffled(denser(question, 3.0), seed, True), seed), size), away))


def test_a_law_can_fail() -> None:
    """Loads that do not grow with the model, or gravity that does not turn with it, are another question."""
    model = stack(1)
    load = Load(1, np.array([0.6 * 2400.0 * G, 0.0, 0.0]), model.mass.centroid[1])
    question = Question(replace(model, loads=(load,)), DOWN, {"mu": 0.7}, "stable")
    asked(question)
    smaller = remapped(question, lambda x: 0.5 * x, lambda f: f)
    with pytest.raises(AssertionError):
        asked(smaller)
    with pytest.raises(AssertionError):
        asked(replace(rotated(Question(model, DOWN, {"mu": 0.7}, "stable"), 3), gravity=DOWN))


# --- eps, eta, beta_min ----------------------------------------------------------------------------------------------


@LAWS
@given(questions, st.sampled_from([1e-6, 0.02, 1.7, 300.0]))
def test_eps_alone_changes_nothing(question: Question, eps: float) -> None:
    """eta and beta_min follow where they are not said; all three together are a unit."""
    plain = asked(question)
    for other in (
        asked(question, eps=eps),
        asked(question, eps=eps, eta=10.0 * eps, beta_min=0.01 * eps),
    ):
        assert other.provenance["route"] == plain.provenance["route"]
        if plain.force is not None:
            assert np.abs(other.force - plain.force).max() <= 1e-6 * np.abs(plain.force).max()
            moves = np.abs(plain.displacement).max()
            assert np.abs(other.displacement / eps - plain.displacement).max() <= 1e-6 * moves


@st.composite
def flat_frames(draw: st.DrawFn) -> tuple[Question, float]:
    """H frames with friction enough, and the eta / eps that they need."""
    half, flat = draw(between(0.3, 1.0)), draw(between(1.2, 6.0))
    model = beams(half, half / flat, half * draw(between(1.0, 1.4)))
    return Question(model, DOWN, {"mu": draw(between(1.03, 1.1)) / flat}, "stable"), 4.0 * flat + 0.01


@LAWS
@given(flat_frames(), st.sampled_from([1.02, 1.5, 10.0]), st.sampled_from([1.0, 0.01]))
def test_a_frame_that_must_pitch_far_enough_stands(case: tuple[Question, float], more: float, eps: float) -> None:
    question, needed = case
    asked(question, eps=eps, eta=more * needed * eps)


@FEW
@given(flat_frames(), st.sampled_from([0.5, 0.9, 0.98]))
def test_a_frame_that_may_not_pitch_far_enough_falls(case: tuple[Question, float], less: float) -> None:
    question, needed = case
    falls = asked(replace(question, word="unstable"), eta=less * needed)
    assert falls.certificate["kind"] == "cra-tree"
    # its tree is no proof for a wider eta, nor for a smaller eps: there it stands
    for wrong in ({"eta": 1.02 * needed}, {"eps": 0.98 * less, "beta_min": 0.0098 * less}):
        changed = {**falls.certificate, **wrong}
        changed["seal"] = seal(changed)
        assert not verify(changed).proved


@FEW
@given(between(0.02, 0.2), between(0.2, 0.9))
def test_a_slender_keystone_needs_eta(lean: float, friction: float) -> None:
    """It sinks in by eps / lean; with less friction than lean it cannot pitch and jam instead."""
    question = Question(beams(1.0, 0.5, 0.7, 1, lean), DOWN, {"mu": friction * lean}, "stable")
    asked(question, eta=1.02 / lean)
    asked(replace(question, word="unstable"), eta=0.98 / lean)


@FEW
@given(frames())
def test_a_tree_is_no_proof_of_more_friction(question: Question) -> None:
    """With friction beyond h / a the frame stands, so nothing may prove that it falls."""
    result = asked(question)
    if result.certificate["kind"] == "cra-tree":
        changed = {**result.certificate}
        needed = np.ptp(question.model.blocks[1].vertices[:, 2]) / (np.ptp(question.model.blocks[1].vertices[:, 0]) / 2)
        changed["contacts"] = [{**joint, "mu": 1.01 * float(needed)} for joint in changed["contacts"]]
        changed["seal"] = seal(changed)
        assert not verify(changed).proved


@LAWS
@given(questions)
def test_coupled_stable_is_stable_in_equilibrium(question: Question) -> None:
    """A coupled state is a state of equilibrium; all that falls by equilibrium alone falls coupled."""
    rigid = check(question.model, Settings(method="rbe", mu=question.options["mu"], gravity=tuple(question.gravity)))
    if question.word == "stable":
        assert rigid.verdict == "stable"
    if rigid.verdict == "unstable":
        assert asked(question).certificate["kind"] == "rbe-mechanism"
