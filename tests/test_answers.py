"""The first line of an answer: in a mason's words, and true.

By hand: a block of 1 x 1 x 1 m on rough ground falls over when the ground tilts by 45 degrees, and slides before that
where friction is less than 1; pushed with its own weight it is about to fall over, too.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cyclopean.analysis import Live, LiveLoad, Settings, limit
from cyclopean.analysis.answers import answer, force, limit_answer, rounded, towards
from cyclopean.api.checking import CheckOptions, examined
from cyclopean.api.inputs import Reading
from cyclopean.design import arch, stack
from cyclopean.design.construction.sequence import build_sequence
from cyclopean.view.building import outcome

CUBE = stack(1, size=(1.0, 1.0, 1.0))


def said_of_check(assembly, **settings):
    options = CheckOptions(margins=True)
    return answer(examined(assembly, Settings(**settings), Reading(), options))


@given(st.floats(1e-12, 1e12))
def test_rounding_keeps_what_is_said_true(value):
    low, high = (float(rounded(value, up)) for up in (False, True))
    assert low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9)
    assert high - low <= 0.0101 * value


@given(st.integers(-720, 720))
def test_ways_turn_with_the_azimuth(degrees):
    assert towards(float(degrees)) == towards(degrees + 360.0) or degrees % 45
    front = towards(degrees + 180.0)
    assert ("left" in towards(float(degrees))) == ("right" in front)


@pytest.mark.parametrize(("mu", "degrees"), [(2.0, "45"), (0.5, "26.6")])
def test_a_cube_on_ground_that_tilts(mu, degrees):
    word, said = said_of_check(CUBE, mu=mu)
    assert word == "Stands"
    assert said.startswith(f"It would fall if the ground tilted by {degrees}")
    live = limit_answer(limit(CUBE, Live(tilt=90.0), Settings(mu=mu)))
    assert live[1].startswith(f"It falls at the latest when the ground tilts by {degrees}")
    assert live[1].endswith("towards the back.")


def test_a_cube_that_is_pushed_or_loaded():
    settings = Settings(mu=0.5, density=2000.0)
    title, said = limit_answer(limit(CUBE, Live(push=(-2.0, 0.0, 0.0)), settings))
    assert title.startswith("50")
    assert said.startswith("It falls at the latest when it is pushed towards the left with 50")
    load = LiveLoad(CUBE.blocks[1].id, (0.0, 10.0, 0.0))  # mu of its weight, 2000 kg m/s2 g
    title, said = limit_answer(limit(CUBE, Live(loads=(load,)), settings))
    assert title == "9.81 kN"
    assert said == f"It falls at the latest under 9.81 kN on '{load.block}'."
    title, said = limit_answer(limit(CUBE, Live(loads=(load,), words="1 kN on the road at x = 1 m"), settings))
    assert (title, said) == ("981 kN", "It falls at the latest under 981 kN on the road at x = 1 m.")
    assert force(9.81, True) == "9.81 N"


def test_where_nothing_is_to_spare():
    """Without friction a cube stands on level ground, and nowhere else."""
    assert said_of_check(CUBE, mu=0.0)[1].startswith("It would fall at the slightest tilt of the ground towards the ")
    said = limit_answer(limit(CUBE, Live(push=(0.0, 1.0, 0.0)), Settings(mu=0.0)))
    assert said == ("Nothing to spare", "It falls at the slightest push towards the back.")


def test_what_counts_on_more_than_dry_stone_says_so_first():
    word, said = said_of_check(arch(7), mu=0.2, cohesion=1e6)
    assert word == "Stands"
    assert "joints that pull" in said.partition(".")[0]


def test_a_fall_is_a_fall():
    assert said_of_check(arch(7), mu=0.1)[0] == "Falls"
    assert limit_answer(limit(arch(7), Live(push=(1.0, 0.0, 0.0)), Settings(mu=0.1)))[0] == "Falls as it is"


def test_an_arch_needs_a_centring_and_then_does_not():
    title, needs, word = outcome(build_sequence(arch(5), Settings(mu=0.84)))
    assert (title, word) == ("Stands when finished", "stable")
    assert needs.startswith("While it is built it needs a strut against ")
    assert "a centring under " in needs
    assert needs.endswith("step 5.")


@pytest.mark.parametrize(
    ("live", "value", "unit"),
    [
        (Live(push=(1.0, 0.0, 0.0)), 50.0, "% of its weight"),
        (Live(tilt=0.0), 26.56505, "degrees"),
        (Live(loads=(LiveLoad("b01", (2.0e4, 0.0, 0.0)),)), 11.76798, "kN"),
        (Live(loads=(LiveLoad("b01", (1e3, 0.0, 0.0)),), words="a surcharge of 1000 Pa on the soil"), 11.76798, "kPa"),
    ],
)
def test_both_bounds_in_the_unit_of_what_grows(live, value, unit):
    """A cube of 1 m3, 2400 kg/m3 and mu 0.5 slides under half its weight, 11.76798 kN, and at atan 0.5."""
    said = limit(CUBE, live, Settings(mu=0.5, density=2400.0)).reason
    low, high = (float(said.split(word)[1].split()[0]) for word in ("up to ", "from "))
    assert f"{unit} on; both are proved. Joints slide in the mechanism" in said
    assert (low, high) == pytest.approx((value, value), rel=1e-5)
    assert low <= value <= high


def test_a_mechanism_that_does_not_slide_is_told():
    slim, push = stack(1, size=(0.4, 0.5, 1.0)), Live(push=(1.0, 0.0, 0.0))
    assert limit(slim, push, Settings(mu=0.7)).reason.endswith("No joint slides in the mechanism.")
    assert "It stands as it is" in limit(slim, push, Settings(mu=0.0)).reason
