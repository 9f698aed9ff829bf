"""The report page: what it holds, what it must never hold, and that nothing of it touches the network or stdout.

What counts as a network reference: an address with a host anywhere in what a browser would load, that is in src, href,
srcset, action, data, poster, url(...) or @import. Viser's client is bundled text in a frame: it names a few addresses
(its own project's links), which load nothing by themselves, and the page's content security policy, which the frame
inherits, forbids every request that leaves the machine. The only other address is the SVG name space.
"""

import base64
import re
import socket
from dataclasses import replace
from html.parser import HTMLParser

import msgspec
import numpy as np
import pytest
import zstandard

from cyclopean.analysis import Result
from cyclopean.analysis.undecided import Fold, Friction, Recut, StableAt, Undecided
from cyclopean.assembly import Assembly, Block, Contacts
from cyclopean.view import report_html
from cyclopean.view import scene as scene_module
from cyclopean.view.colours import WEAK
from cyclopean.view.markup import POLICY

BOX = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
EVIL = '<script>alert("1")</script>'


def hexahedron(name, low, high, **more):
    return Block(name, np.concatenate([low, high]), BOX, **more)


def square(x, z):
    return np.array([[x, 0, z], [x + 1, 0, z], [x + 1, 1, z], [x, 1, z]], float)


def ring(k, radius):
    angle = np.pi - np.pi * k / 13
    return np.array([radius * np.cos(angle), 0.0, radius * np.sin(angle)])


def joint(k):
    inner, outer, deep = ring(k, 4.6), ring(k, 5.4), np.array([0.0, 1.0, 0.0])
    return np.array([inner, outer, outer + deep, inner + deep])


def arch():
    """Thirteen voussoirs with forces made up: thrust growing towards the springings, some friction."""
    blocks = [hexahedron(f"v{k}", joint(k), joint(k + 1), density=2400.0, fixed=k in (0, 12)) for k in range(13)]
    contacts = Contacts.of([(k, k + 1) for k in range(12)], [joint(k) for k in range(1, 13)], [0.7] * 12)
    thrust = 1e4 * (1 + np.abs(np.arange(12) - 5.5))
    force = np.zeros((48, 3))
    force[:, 0] = np.repeat(thrust, 4) / 4
    force[:, 1] = 0.3 * force[:, 0]
    share = np.linspace(0.05, 0.95, 12)
    return Result(
        assembly=Assembly(tuple(blocks), name="arch by hand"),
        contacts=contacts,
        fixed=np.array([k in (0, 12) for k in range(13)]),
        method="rbe",
        verdict="stable",
        reason="Forces in compression & friction balance every block.",
        assumed={"gravity": [0, 0, -9.80665], "supports": "lowest"},
        gravity=np.array([0, 0, -9.80665]),
        residuals={"equilibrium": 3.2e-13, "cone": 0.0},
        force=force,
        frame=contacts.frame,
        utilisation=share,
        certificate={"kind": "rbe-state"},
        provenance={"solver": "newton", "factorisations": 4, "settings": {"cone": "exact"}},
        seconds={"solve": 0.0123, "total": 0.05},
        warnings=("block 'v3' & its neighbour interpenetrate by 1e-9 m",),
    )


def collapsing_stack(name="b"):
    """Four offset cubes; the upper three turn as one about the lower cube's edge."""
    blocks = [hexahedron(f"{name}{k}", square(0.35 * k, k), square(0.35 * k, k + 1), fixed=k == 0) for k in range(4)]
    overlaps = [square(0.35 * (k + 1), k + 1) - [[0, 0, 0], [0.35, 0, 0], [0.35, 0, 0], [0, 0, 0]] for k in range(3)]
    contacts = Contacts.of([(k, k + 1) for k in range(3)], overlaps, [0.84] * 3)
    assembly = Assembly(tuple(blocks), name=f"stack of {name}")
    spin, pivot = np.array([0.0, 0.4, 0.0]), np.array([1.0, 0.0, 1.0])
    mechanism = np.zeros((4, 6))
    mechanism[1:, 3:] = spin
    mechanism[1:, :3] = np.cross(spin, assembly.mass.centroid[1:] - pivot)
    return Result(
        assembly=assembly,
        contacts=contacts,
        fixed=np.array([True, False, False, False]),
        method="rbe",
        verdict="unstable",
        reason=f"Three blocks overturn, '{name}3' the fastest.",
        assumed={"mu": 0.84, "density": 2400.0},
        gravity=np.array([0.5, 0, -9.8]),
        residuals={"bound": 4.2e14},
        mechanism=mechanism,
        certificate={"kind": "rbe-mechanism"},
    )


def undecided():
    return replace(arch(), verdict="undecided", force=None, utilisation=None, certificate=None, residuals={})


def sinking():
    """A cube of 1 m on a fixed one, that overlaps it by eps and slides by 3 eps along x; friction 1 kN a corner."""
    blocks = (hexahedron("low", square(0, 0), square(0, 1), fixed=True), hexahedron("up", square(0, 1), square(0, 2)))
    contacts = Contacts.of([(0, 1)], [square(0, 1)], [0.84])
    frame = np.array([[[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]])
    return Result(
        assembly=Assembly(blocks, name="sinking cube"),
        contacts=contacts,
        fixed=np.array([True, False]),
        method="cra",
        verdict="stable",
        reason="Forces that a virtual motion produces.",
        assumed={"mu": 0.84, "density": 2400.0},
        gravity=np.array([0, 0, -9.8]),
        residuals={"equilibrium": 1e-16, "gap": 2e-15, "complementarity": 0.0, "alignment": 0.0, "sliding": 0.0},
        force=np.array([[6000.0, -1000.0, 0.0], [5880.0, -1000.0, 0.0], [0, 0, 0], [5880.0, -1000.0, 0.0]]),
        frame=frame,
        utilisation=np.array([0.2]),
        displacement=np.array([[0, 0, 0, 0, 0, 0], [3.0, 0, -1.0, 0, 0, 0]]),
        certificate={"kind": "cra-state", "eps": 1.0, "eta": 10.0, "beta_min": 0.01},
        provenance={"route": "continuation", "settings": {"eps": 1.0, "eta": 20.0, "beta_min": 0.01}},
    )


TREE = {
    "point": 0,
    "engaged": {
        "point": 1,
        "rays": [[1, 0, 0], [0, 1, 0], [-1, -1, 0]],
        "sectors": [{"mechanism": {}}, {"forces": []}, {"point": 1, "speed": 1, "slower": {"forces": []},
                                                        "faster": {"mechanism": {}, "forces": []}}],
    },
    "unloaded": {"mechanism": {}},
}  # fmt: skip


def refuted():
    certificate = {"kind": "cra-tree", "eps": 2.0, "eta": 20.0, "beta_min": 0.02, "tree": TREE}
    tried = [{"route": "RBE", "word": "balanced"}]
    return replace(sinking(), verdict="unstable", force=None, utilisation=None, displacement=None, residuals={},
                   certificate=certificate, provenance={"route": "tree", "tried": tried})  # fmt: skip


class Page(HTMLParser):
    """What a browser would load, the text it would show, and the document in the frame."""

    def __init__(self, source):
        super().__init__()
        self.loads, self.text, self.tags, self.frame = [], [], [], ""
        self.skip = None
        self.feed(source)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "srcset", "action", "data", "poster", "xlink:href"):
                self.loads.append(value)
            if name == "srcdoc":
                self.frame = value
        self.skip = tag if tag in ("style", "script") else None

    def handle_endtag(self, tag):
        self.skip = None

    def handle_data(self, data):
        if self.skip is None:
            self.text.append(data)

    @property
    def words(self):
        return " ".join(" ".join(self.text).split())


@pytest.fixture(scope="module")
def pages():
    made = {
        "arch": report_html(arch(), certificate_file="arch cert.json", model_file="arch.json"),
        "stack": report_html(collapsing_stack()),
        "undecided": report_html(undecided()),
        "sinking": report_html(sinking()),
        "refuted": report_html(refuted()),
    }
    return {name: (source, Page(source)) for name, source in made.items()}


@pytest.mark.parametrize("name", ["arch", "stack", "undecided", "sinking", "refuted"])
def test_asks_no_network_for_anything(pages, name):
    source, page = pages[name]
    inside = Page(page.frame)
    assert "iframe" in page.tags
    assert "__VISER_EMBED_DATA__" in page.frame  # viser's client is really there, and our scene
    for load in page.loads + inside.loads:
        assert load.startswith(("data:", "#"))
    outer = source.replace("&quot;", '"')[: source.index("srcdoc=")] + source[source.index("</iframe>") :]
    assert set(re.findall(r"https?://[^\s\"'<>]*", outer)) <= {"http://www.w3.org/2000/svg"}
    assert not re.search(r"@import|url\((?!#(hatch|grain))", outer)
    assert f'http-equiv="Content-Security-Policy" content="{POLICY}"' in source
    for rule in POLICY.split(";"):
        assert set(rule.split()[1:]) <= {"'none'", "'unsafe-inline'", "'unsafe-eval'", "blob:", "data:"}


@pytest.mark.parametrize("name", ["arch", "stack", "undecided", "sinking", "refuted"])
def test_never_says_nan_and_stays_small(pages, name):
    source, _ = pages[name]
    outer = source[: source.index("srcdoc=")] + source[source.index("</iframe>") :]
    assert not re.search(r"\b(nan|inf|infinity)\b", outer, re.IGNORECASE)
    assert len(source) < 1_200_000


STABLE = """
arch by hand|(arch.json)|Stands|Forces in compression & friction balance every block.|rigid-block equilibrium (RBE)
blocks 13|of them free 11|contacts 12|contact points 48|Friction coefficient μ 0.7 (35.0°) given|2,400 kg/m³ given
2 of 13 blocks: the blocks that touch the lowest point assumed|9.80665 m/s², straight down assumed
Contact Utilisation Normal (kN) Friction (kN) μ Area (m²) v11 – v12 0.95 65 19.5 0.7 0.8 v10 – v11
block 'v3' & its neighbour interpenetrate|equilibrium 3.20 × 10⁻¹³|cone 0|solver newton|factorisations 4|cone exact
seconds solve 0.0123, total 0.05|cyclopean verify 'arch cert.json'|python -m cyclopean.proof 'arch cert.json'|rbe-state
the longest is 67.9 kN|not about what was surveyed|about to slide
"""
UNSTABLE = """
Falls|Three blocks overturn, 'b3' the fastest.|How it moves|where it stands|1 of 4 blocks given
Friction coefficient μ 0.84 (40.0°) assumed 0.84 where the model gives none|2,400 kg/m³ assumed 2,400 where
9.81275 m/s² along (0.5, 0, −9.8) given|b3 1.00|bound 4.20 × 10¹⁴|dilatant|contacts listed
cyclopean verify certificate.json|cyclopean check MODEL --certificate certificate.json
"""


def test_shows_every_field_of_a_stable_result(pages):
    _, page = pages["arch"]
    for words in STABLE.strip().replace("\n", "|").split("|"):
        assert words in page.words


COUPLED = """
coupled rigid-block analysis (CRA)|How it presses and rubs|3 of 4 contact points overlap and press, 3 of them rub
bounds: eta = 20 eps, beta_min = 0.01 eps|friction on the upper block, the longest is 1 kN|Click the drawing
complementarity 0|in eps times the weight of the lighter block|route continuation: from dilating to Coulomb friction
brings them about
"""
REFUTED = """
What was proved|Rigid-block equilibrium accepts this model|divided into 5 cases (3 decisions deep at most)
bounds: eta = 10 eps, beta_min = 0.01 eps|No forces 2|No displacement 2|Not both together 1|virtual work
what is proved is that none go together|with a larger eta or a smaller beta_min|route a tree of cases
"""


@pytest.mark.parametrize(("name", "said"), [("sinking", COUPLED), ("refuted", REFUTED)])
def test_says_what_coupled_analysis_found(pages, name, said):
    _, page = pages[name]
    for words in said.strip().replace("\n", "|").split("|"):
        assert words in page.words
    assert ("How it presses and rubs" in page.words) == (name == "sinking")
    assert "associated" not in page.words


def test_says_how_near_an_undecided_coupled_analysis_came():
    near = replace(refuted(), verdict="undecided", certificate=None, residuals={"merit": 0.25, "bound": 0.5},
                   provenance={"route": "", "settings": {"eps": 1.0, "eta": 10.0, "beta_min": 0.01}})  # fmt: skip
    words = Page(report_html(near)).words
    assert "do work of 0.25 (in eps times a mean block weight)" in words
    assert "closed 50 % of the cases" in words
    assert "Rigid-block equilibrium accepts" not in words  # nobody found that out
    tried = [{"route": "RBE", "word": "undecided"}, {"route": "A", "word": "balanced"}]
    assert "Rigid-block equilibrium accepts" not in Page(report_html(replace(near, provenance={"tried": tried}))).words
    assert "share of all cases that the refuting search has proved impossible" in words
    assert "would have to exceed this many times" not in words


def test_names_and_marks_the_stones_at_which_an_undecided_search_ends():
    one = arch()
    known = Undecided(
        "It is open.", "stable", 10.0,
        folds=(Fold(one.assembly.blocks[1].id, (41.2, 44.0), 31.4, ("c<13>",)),),
        recut=Recut(one.assembly.blocks[1].id, "foot", 41.2, 31.0),
        stable_at=StableAt(11.82, {"kind": "cra-state"}), friction=Friction(1.25, 0.75), untried=("more friction",),
    )  # fmt: skip
    source = report_html(replace(one, verdict="undecided", force=None, utilisation=None, undecided=known))
    page = Page(source)
    name = one.assembly.blocks[1].id
    for words in (
        "It is open.",
        "Rigid-block equilibrium alone says stable, with proof.",
        "A state exists for eta >= 11.82, with proof (10 was asked for).",
        f"Stone '{name}' rests on faces steeper than friction (41 and 44 degrees against 31)",
        "stands only if 'c<13>' jams it.",
        "With friction 0.75 it is proved stable.",
        f"Recut '{name}': its face on 'foot' lies at 41 degrees and would carry it at 31.",
        "There was no time to try more friction: more --seconds",
        "where the search ends",
    ):
        assert words in page.words
    assert f'fill="{WEAK}"' in source  # the key; faces are shaded
    assert "where the search ends" not in Page(report_html(undecided())).words


def test_shows_every_field_of_an_unstable_result(pages):
    _, page = pages["stack"]
    for words in UNSTABLE.strip().replace("\n", "|").split("|"):
        assert words in page.words
    assert "Most used contacts" not in page.words


def test_says_that_nothing_is_proved_when_undecided(pages):
    _, page = pages["undecided"]
    assert "Undecided" in page.words
    assert "it is proved neither that this model stands nor that it falls" in page.words
    assert "cyclopean verify" not in page.words


@pytest.mark.parametrize("name", [EVIL, "a&b", '"><img src=x>', "naïve ‘quotes’", "</ol><i>", "${x}"])
def test_ids_and_names_are_escaped(name):
    result = collapsing_stack(name)
    loaded = replace(arch(), assembly=result.assembly, contacts=result.contacts, fixed=result.fixed, frame=None,
                     force=np.tile([4.0, 1.0, 0.0], (12, 1)), utilisation=np.array([0.1, 0.2, 0.3]), warnings=(name,),
                     reason=name, provenance={name: {name: [name]}}, residuals={name: 1.0}, method=name,
                     certificate={"kind": name, "blocks": []})  # fmt: skip
    for one, files in ((result, {"certificate_file": name}), (loaded, {"model_file": name})):
        source = report_html(one, **files)
        page = Page(source)
        assert name not in source or name in ("naïve ‘quotes’", "${x}")
        assert page.tags.count("script") == (1 if one.certificate is None else 4)  # three that check the proof
        assert "img" not in page.tags
        assert name in " ".join(page.text)


def recorded(page):
    """Messages that the scene in the frame was made with."""
    data = re.search(r'__VISER_EMBED_DATA__="([^"]*)"', page.frame)[1]
    inner = zstandard.ZstdDecompressor().decompress(base64.b64decode(data)[8:])
    length = int.from_bytes(inner[:8], "little")
    return [message for _, message in msgspec.msgpack.decode(inner[8 : 8 + length])["messages"]]


def test_the_scene_holds_blocks_by_colour_arrows_supports_and_gravity(pages):
    scenes = {name: {m["name"]: m for m in recorded(page) if "props" in m} for name, (_, page) in pages.items()}
    assert {"/supports", "/stones/1", "/contact forces", "/gravity", "/edges"} <= set(scenes["arch"])
    assert {f"/utilisation/{k / 10:.1f} to {(k + 1) / 10:.1f}" for k in (1, 2, 5, 9)} <= set(scenes["arch"])
    assert tuple(scenes["arch"]["/utilisation/0.8 to 0.9"]["props"]["color"]) == (0xD5, 0x5C, 0x13)
    assert "/where it stood" not in scenes["arch"]
    assert {"/where it stood", "/movement/0.9 to 1.0", "/supports"} <= set(scenes["stack"])
    assert "/contact forces" not in scenes["stack"]
    assert "/stones/1" in scenes["undecided"]
    layers = {"/pressing points", "/friction", "/virtual displacement"}
    assert layers <= set(scenes["sinking"])
    assert not layers & set(scenes["arch"])
    hidden = {m["name"] for m in recorded(pages["sinking"][1]) if m.get("visible") is False}
    assert {"/WorldAxes", "/virtual displacement"} <= hidden
    assert not any(name.startswith("/stones") for name in hidden), "stone is seen at first"


def test_options_that_a_warning_names_are_shown_as_one_types_them():
    page = report_html(replace(arch(), warnings=("a < b: say `units` or `beta_min`",)))
    assert "<li>a &lt; b: say <code>--units</code> or <code>--beta-min</code></li>" in page


def test_values_that_are_not_finite_become_a_dash():
    share = arch().utilisation.copy()
    share[:3] = [np.nan, np.inf, 7.0]
    page = Page(report_html(replace(arch(), utilisation=share, residuals={"equilibrium": np.nan})))
    assert "equilibrium –" in page.words
    assert "v2 – v3 7.00" in page.words
    assert not re.search(r"\b(nan|inf)\b", page.words, re.I)


def test_tension_is_summed_up_when_it_was_asked_for():
    pull = np.zeros(12)
    pull[[2, 7]] = [1500.0, 500.0]
    words = Page(report_html(replace(collapsing_stack(), tension=pull))).words
    assert "2 contact points would have to, with at most 1.5 kN at one point and 2 kN in all (2.83 % of" in words
    assert "would have to pull" in words
    assert "b0 – b1 1.5 2.12 % 1.5 0.65" in words  # by hand: 3 cubes of 2400 kg at 9.8128 m/s2 weigh 70.65 kN
    assert "compression and friction are enough" in Page(report_html(replace(arch(), tension=np.zeros(48)))).words
    assert "Dry joints cannot pull" not in Page(report_html(arch())).words
    assert "None that would help" in Page(report_html(replace(refuted(), tension=np.zeros(4)))).words


def test_empty_and_contactless_models_have_a_page():
    bare = {"force": np.zeros((0, 3)), "frame": np.zeros((0, 3, 3)), "utilisation": np.zeros(0)}
    lonely = replace(arch(), contacts=Contacts.of([], []), **bare)
    assert "contacts 0" in Page(report_html(lonely)).words
    empty = replace(lonely, assembly=Assembly(()), fixed=np.zeros(0, bool))
    assert "blocks 0" in Page(report_html(empty)).words


def test_prints_nothing_and_leaves_no_server_behind(capfd, monkeypatch):
    import viser

    seen = []
    start = viser.ViserServer.__init__

    def spy(self, *args, **kwargs):
        start(self, *args, **kwargs)
        seen.append((self.get_host(), self.get_port()))
        with socket.create_connection(seen[0], timeout=1):  # it does listen now, so the refusal below means something
            pass

    monkeypatch.setattr(viser.ViserServer, "__init__", spy)
    report_html(arch())
    ((host, port),) = seen
    assert host == "127.0.0.1"
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((host, port), timeout=1)
    assert capfd.readouterr() == ("", "")


def test_the_server_is_stopped_and_the_console_restored_when_drawing_fails(monkeypatch, capfd):
    import rich
    import viser

    ports = []
    start = viser.ViserServer.__init__

    def spy(self, *args, **kwargs):
        start(self, *args, **kwargs)
        ports.append(self.get_port())

    def broken(*_):
        raise RuntimeError("no light")

    monkeypatch.setattr(viser.ViserServer, "__init__", spy)
    monkeypatch.setattr(scene_module, "light", broken)
    with pytest.raises(RuntimeError, match="no light"):
        report_html(arch())
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", ports[0]), timeout=1)
    assert not rich.get_console().quiet
    assert capfd.readouterr() == ("", "")


def test_ten_thousand_blocks_stay_below_the_size_limit():
    side = 100
    blocks = tuple(
        hexahedron(f"b{i}", *(square(1.01 * (i % side), 1.01 * (i // side) + z) for z in (0, 1)))
        for i in range(side * side)
    )
    assembly = Assembly(blocks, name="large")
    near = np.arange(side * side - side)
    contacts = Contacts.of(
        [(i, i + side) for i in near.tolist()],
        [square(1.01 * (i % side), 1.01 * (i // side) + 1.0) for i in near.tolist()],
        [0.7] * len(near),
    )
    share = np.random.default_rng(1).uniform(size=len(near))
    result = replace(arch(), assembly=assembly, contacts=contacts, fixed=np.arange(side * side) < side, frame=None,
                     force=np.tile([4.0, 1.0, 0.0], (4 * len(near), 1)), utilisation=share)  # fmt: skip
    source = report_html(result)
    assert len(source) < 10_000_000
    words = Page(source).words
    assert "With more than 3,000 blocks, the drawing of contact forces would not be legible and is left out." in words
    assert "Edges of blocks are left out" in words
