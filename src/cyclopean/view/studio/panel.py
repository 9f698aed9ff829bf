"""The live page: sliders, the verdict, the chosen block, what is saved. Viser's own elements; no script of ours."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from cyclopean.analysis import PreparedModel, Settings, prepare
from cyclopean.analysis.interactive import Knobs
from cyclopean.assembly import Assembly, length_tolerance, paired_friction
from cyclopean.assembly.rearranging import arrange
from cyclopean.errors import CyclopeanError, InputError
from cyclopean.view.access import AccessControl
from cyclopean.view.colours import ACCENT
from cyclopean.view.figures import force_text, number, resultants
from cyclopean.view.layers import server, silent
from cyclopean.view.markup import ramp, told
from cyclopean.view.messages import takes
from cyclopean.view.rate_limit import RateLimit
from cyclopean.view.studio.live_scene import LABELS, LiveScene, Look
from cyclopean.view.studio.painter import Painter
from cyclopean.view.studio.prover import Reach
from cyclopean.view.studio.saving import KINDS, save
from cyclopean.view.studio.session import Listener, Session, Snapshot, State

MU, TILT, PUSH, SCALES = 1.5, 60.0, 1.0, 4.0  # ends of the sliders
GRAVITY = 9.80665  # m/s2, by which weights are told
PATIENCE = 8.0  # s that a notice stays
AT_ONCE, SAVES = 20, 500  # files that are saved in a minute, and in all, by all clients together


@dataclass(frozen=True, slots=True)
class Studio:
    """A page that is being served."""

    address: str  # with the token that opens it
    session: Session


@contextmanager
def studio(
    model: Assembly,
    settings: Settings,
    *,
    folder: Path,
    stem: str = "model",
    address: tuple[str, int] = ("127.0.0.1", 0),
    warnings: tuple[str, ...] = (),
) -> Iterator[Studio]:
    """Serve the live page of a model while the block lasts.

    The settings are what was said about its analysis; gravity as said, before the sliders turn it. Files are saved
    into the folder, under names that begin with `stem`, which is no path. It listens at an address of host and port;
    port 0 is one that is free. The warnings are what reading the model had to say.

    Raises
    ------
    InputError
        Nothing that can be analysed: see `analysis.prepare`; or a stem that would lead out of the folder.
    """
    if Path(stem).name != stem:
        raise InputError(f"stem '{stem}': expected the beginning of a file's name, without a folder")
    posed = prepare(model, replace(settings, tilt=None))
    followed = replace(settings, combination="", factors=(), settlement=())  # the posed model has its loads already
    if posed.contacts.strength.any():
        followed = replace(followed, method="rbe")
        warnings = (*warnings, "joints of this model pull: only rigid-block equilibrium has that")
    if posed.settled is not None:
        warnings = (*warnings, "supports of this model settle: that is left out here; see the command check")
    host, port = address
    access = AccessControl(host)
    with silent(), server(host, port, access) as running:
        running.request_share_url = lambda *_, **__: None  # nobody makes this page public from the page itself
        elements = running.gui._gui_input_handle_from_uuid  # by which viser itself finds them
        access.accepts = lambda uuid, value: takes(elements.get(uuid), value)
        page = _Page(running, posed, followed, folder, stem, (*warnings, *posed.warnings))
        try:
            shown = {"": "127.0.0.1", "0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
            place = f"{f'[{shown}]' if ':' in shown else shown}:{running.get_port()}"
            yield Studio(f"http://{place}/?token={access.token}", page.session)
        finally:
            page.close()


class _Page:
    """Ties sliders, session and scene together."""

    def __init__(
        self, running: Any, posed: PreparedModel, settings: Settings, folder: Path, stem: str, warnings: tuple[str, ...]
    ) -> None:
        self._running, self._gui = running, running.gui
        self._posed, self._folder, self._stem = posed, folder, stem
        self._block: int | None = None
        self._saves, self._in_all = RateLimit(AT_ONCE, 60.0), RateLimit(SAVES, math.inf)
        given = None if posed.assembly.contacts is None else posed.assembly.contacts.mu
        own = np.full(len(posed.contacts), np.nan) if given is None else given
        contacts, _ = paired_friction(posed.assembly, replace(posed.contacts, mu=own))
        tolerance = length_tolerance(posed.assembly) if posed.forgiven is None else posed.forgiven.gap
        self._home = home = arrange(posed.assembly, contacts, posed.fixed, tolerance)
        tilt, azimuth = settings.tilt or (0.0, 0.0)
        knobs = Knobs(Knobs().mu if settings.mu is None else settings.mu, tilt=tilt, azimuth=azimuth)
        self._scene = LiveScene(running, home, self._choose, lambda *drag: self.session.move(*drag))
        first = State(home, knobs, settings.chosen_method())
        self._build(first, given is not None and not np.isnan(given).all(), warnings)
        self._painter = Painter(self._scene, lambda: bool(self._moving.value))
        told = Listener(self._show, self._refuse, self._tell)
        self.session = Session(first, settings, posed.gravity, posed.assumed, told)

    def close(self) -> None:
        """Stop everything that runs."""
        self.session.close()
        self._painter.close()

    # ------------------------------------------------------------------ elements

    def _build(self, first: State, says_mu: bool, warnings: tuple[str, ...]) -> None:
        gui = self._gui
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.set_panel_label("cyclopean studio")
        gui.main_panel.dock_right()
        self._running.scene.world_axes.visible = False
        self._verdict = gui.add_html(_verdict_html(None))
        self._reach = gui.add_html(_reach_html(None))
        with gui.add_folder("Ground and friction"):
            self._ground(gui, first, says_mu)
        with gui.add_folder("What is shown"):
            self._layers(gui)
        with gui.add_folder("Block"):
            self._chosen_block(gui)
        for element in self._look.values():
            element.on_update(lambda _: self._scene.look(Look(**{n: e.value for n, e in self._look.items()})))
        with gui.add_folder("Save"):
            for kind in KINDS:
                gui.add_button(f"Save {kind}").on_click(lambda event, kind=kind: self._save(event, kind))
            place = f"Files go to the folder '{self._folder.resolve().name}'; none that is there is replaced."
            gui.add_html(f'<p style="margin:.2em 1em;font-size:.8em;overflow-wrap:anywhere">{escape(place)}</p>')
        if warnings:
            with gui.add_folder("Warnings", expand_by_default=False):
                gui.add_html("".join(f"<p>{told(line)}</p>" for line in warnings))

    def _ground(self, gui: Any, first: State, says_mu: bool) -> None:
        knobs, slider, ticked = first.knobs, gui.add_slider, "also where the model gives mu"
        top, steep = max(MU, 2.0 * knobs.mu), max(TILT, abs(knobs.tilt))
        wins = "What the model says wins unless ticked."
        self._mu = slider("Friction mu", 0.0, top, 0.01, min(knobs.mu, top), hint=_MU_HINT)
        self._everywhere = gui.add_checkbox(ticked, False, visible=says_mu, hint=wins)
        self._tilt = slider("Tilt, degrees", min(0.0, knobs.tilt), steep, 0.1, knobs.tilt)
        self._azimuth = slider("Tilt towards, degrees", -180.0, 180.0, 1.0, _within(knobs.azimuth))
        self._push = [slider(f"Push along {axis}", -PUSH, PUSH, 0.005, 0.0, hint=_PUSH_HINT) for axis in "xy"]
        methods = ("rbe",) if self._posed.contacts.strength.any() else ("cra", "rbe")
        method = gui.add_dropdown("Method", methods, initial_value=first.method)
        method.on_update(lambda _: self.session.set(method=method.value))
        for element in (self._mu, self._everywhere, self._tilt, self._azimuth, *self._push):
            element.on_update(lambda _: self._turn())
        gui.add_button("Level, no push").on_click(lambda _: self._level())

    def _layers(self, gui: Any) -> None:
        tick, many = gui.add_checkbox, len(self._posed.assembly) > LABELS
        few = f"Up to {LABELS} blocks." if many else None
        self._look = {
            "forces": tick("forces", True),
            "points": tick("pressing points", False, hint="And friction at them: of coupled states."),
            "contacts": tick("contacts", False),
            "labels": tick("names", False, disabled=many, hint=few),
            "scale": gui.add_slider("Mechanism, scale", 0.0, SCALES, 0.05, 1.0, hint=_SCALE_HINT),
        }
        self._moving = tick("mechanism moves", False)

    def _chosen_block(self, gui: Any) -> None:
        self._name = gui.add_text("Name", "", hint="Click a block, or write its name.")
        self._about = gui.add_html(_ABOUT)
        self._look["handle"] = gui.add_checkbox("drag it by a handle", False)
        buttons = gui.add_button_group("Change", ("Remove", "Put back", "Undo"))
        self._name.on_update(lambda event: self._named(event))
        buttons.on_click(lambda _: self._change(buttons.value))

    # ------------------------------------------------------------------ what the user does

    def _turn(self) -> None:
        push = (float(self._push[0].value), float(self._push[1].value))
        mu, tilt, azimuth = float(self._mu.value), float(self._tilt.value), float(self._azimuth.value)
        self.session.set(knobs=Knobs(mu, bool(self._everywhere.value), tilt, azimuth, push))

    def _level(self) -> None:
        for slider in (self._tilt, self._azimuth, *self._push):
            slider.value = 0.0
        self._turn()

    def _named(self, event: Any) -> None:
        name = self._name.value
        if event.client is None:  # we wrote it
            return
        try:
            self._choose(self._home.number(name) if name else None)
        except InputError:
            self._about.content = f"<p style='margin:.3em 1em'>There is no block '{escape(name)}'.</p>"

    def _choose(self, block: int | None) -> None:
        self._block = block
        self._name.value = "" if block is None else self._home.model.blocks[block].id
        self._scene.choose(block)
        self._describe()

    def _change(self, what: str) -> None:
        if what == "Undo":
            self.session.undo()
        elif self._block is None:
            self._refuse("choose a block first: click it, or write its name")
        elif what == "Remove":
            self.session.remove(self._block)
        else:
            self.session.put_back(self._block)

    def _save(self, event: Any, kind: str) -> None:
        snapshot, client = self.session.latest, event.client
        try:
            if snapshot is None:
                raise InputError("nothing to save yet")
            if not self._saves.allows():
                raise InputError(f"{AT_ONCE} files were saved within a minute; wait a little")
            if not self._in_all.allows():
                raise InputError(f"{SAVES} files were saved already; start the command anew to save more")
            path, content = save(kind, snapshot, self._folder, self._stem)
        except CyclopeanError as error:
            _notify(client, "Not done", str(error), "red")
            return
        _notify(client, f"Saved {path.name}", f"into the folder '{path.resolve().parent.name}'")
        client.send_file_download(path.name, content)

    # ------------------------------------------------------------------ what the page says

    def _show(self, snapshot: Snapshot) -> None:
        self._verdict.content = _verdict_html(snapshot)
        self._running.flush()  # the words do not wait for the drawing
        self._describe()
        self._painter.show(snapshot)

    def _tell(self, reach: Reach | None) -> None:
        self._reach.content = _reach_html(reach)

    def _describe(self) -> None:
        snapshot = self.session.latest if hasattr(self, "session") else None
        if snapshot is not None:
            self._about.content = _block_html(snapshot, self._block, self._posed.density)

    def _refuse(self, why: str) -> None:
        for client in self._running.get_clients().values():
            _notify(client, "Not done", why, "red")


def _notify(client: Any, title: str, body: str, colour: str | None = None) -> None:
    client.add_notification(title, body, color=colour, auto_close_seconds=PATIENCE)


_MU_HINT = "Where the model gives none; tan of the angle of friction."
_PUSH_HINT = "A steady horizontal force on every block, in shares of its weight."
_SCALE_HINT = "1: the largest movement is a quarter of a mean block."
_ABOUT = "<p style='margin:.3em 1em'>None chosen.</p>"


def _within(degrees: float) -> float:
    """The same direction between -180 and 180 degrees."""
    return (degrees + 180.0) % 360.0 - 180.0


def _verdict_html(snapshot: Snapshot | None) -> str:
    """The word, what it is worth, why, and for what it holds; of one height, so that sliders stay under the hand."""
    if snapshot is None:
        return '<div id="verdict" style="padding:.4em 1em">Looking at the model ...</div>'
    colour = ACCENT[snapshot.word]
    word = {"searching": "undecided so far", "failed": "no answer"}.get(snapshot.stage, snapshot.word)
    border = "solid" if snapshot.proved else "dashed"
    scale = "" if snapshot.result.utilisation is None else ramp("friction used at the worst contact", "0", "1")
    if snapshot.result.mechanism is not None:
        scale = ramp("movement of a block, largest = 1", "0", "1")
    return (
        f'<div id="verdict" data-stage="{snapshot.stage}" data-ticket="{snapshot.ticket}"'
        f' style="margin:.3em .6em;padding:.5em .8em;min-height:18em;border-left:.5em {border} {colour}">'
        f'<strong id="word" style="font-size:1.7em;line-height:1.1;color:{colour}">{word.capitalize()}</strong>'
        f' <span id="worth" style="font-weight:600">{_WORTH[snapshot.stage]}</span>'
        f'<p style="margin:.35em 0;min-height:5.6em;overflow-wrap:anywhere">{escape(snapshot.sentence)}</p>'
        f'<p id="for" style="margin:.35em 0;min-height:4.2em;font-size:.85em">{escape(_for(snapshot))}</p>'
        f'<div style="font-size:.85em">{scale}</div></div>'
    )


def _reach_html(reach: Reach | None) -> str:
    """How far it is from falling."""
    style = 'id="reach" style="margin:.2em 1em;min-height:4.2em;font-size:.85em"'
    if reach is None:
        return f"<p {style}>Looking how far it is from falling ...</p>"
    x, y = reach.heading
    return (
        f"<p {style}>From the level, by equilibrium, it falls at a tilt of <b>{reach.tilt}</b> towards"
        f" {reach.azimuth:g}°, at a push along ({x:.3g}, {y:.3g}) of <b>{reach.push}</b>.</p>"
    )


_WORTH = {
    "proved": "proved: its certificate has passed the checker",
    "provisional": "provisional",
    "searching": "",
    "undecided": "nothing is proved",
    "failed": "",
}


def _for(snapshot: Snapshot) -> str:
    """The state that the word is about, in numbers."""
    knobs, arrangement = snapshot.state.knobs, snapshot.state.arrangement
    parts = [f"mu {knobs.mu:g}", f"tilt {knobs.tilt:g}° towards {knobs.azimuth:g}°"]
    parts.append(f"push {knobs.push[0]:g}, {knobs.push[1]:g} of the weight")
    if arrangement.poses:
        parts.append(f"{len(arrangement.poses)} moved")
    if arrangement.removed:
        parts.append(f"{len(arrangement.removed)} taken out")
    settled = snapshot.stage in ("proved", "undecided")
    method = snapshot.state.method if settled else "rbe"
    seconds = snapshot.result.seconds["total"] if settled else snapshot.answer.seconds
    notes = "".join(f"; {note}" for note in arrangement.notes[:3])
    return f"For {', '.join(parts)}; by {method} in {1e3 * seconds:.0f} ms{notes}"


def _block_html(snapshot: Snapshot, block: int | None, density: float) -> str:
    """Name, weight, contacts and worst utilisation of the chosen block."""
    arrangement, result = snapshot.state.arrangement, snapshot.result
    if block is None:
        return _ABOUT
    at = arrangement.place(block)
    name = escape(arrangement.model.blocks[block].id)
    if at is None:
        return f"<p style='margin:.3em 1em'><b>{name}</b> is taken out.</p>"
    contacts, assembly = result.contacts, result.assembly
    mine = np.flatnonzero((contacts.a == at) | (contacts.b == at))
    own = assembly.blocks[at].density
    volume = float(assembly.mass.volume[at])
    rows = [("weight", force_text((density if own is None else own) * volume * GRAVITY))]
    rows.append(("volume", f"{number(volume)} m³"))
    rows.append(("it is", "a support" if result.fixed[at] else "free"))
    others = [
        assembly.blocks[int(b if a == at else a)].id for a, b in zip(contacts.a[mine], contacts.b[mine], strict=True)
    ]
    names = list(dict.fromkeys(others))
    listed = ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")
    rows.append(("contacts", f"{len(mine)}" + (f" with {escape(listed)}" if mine.size else "")))
    found = resultants(result)
    if found is not None and mine.size and result.utilisation is not None:
        rows.append(("largest force", force_text(float(np.hypot(found.normal[mine], found.friction[mine]).max()))))
        rows.append(("friction used", f"{100.0 * float(result.utilisation[mine].max()):.0f} % at the worst contact"))
    body = "".join(f"<div>{what}: <b>{value}</b></div>" for what, value in rows)
    return f'<div id="block" style="margin:.3em 1em;overflow-wrap:anywhere"><b>{name}</b>{body}</div>'
