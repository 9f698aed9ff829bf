"""The proof in the reader's hands: the second checker inside a page, with the certificate that it is to check."""

import json
import re
import zlib
from base64 import b64encode
from collections.abc import Mapping
from html import escape
from importlib.resources import files

from cyclopean.view.markup import document, section

# Of pages that check a proof and have no scene: the worker comes out of the page itself.
CHECKING = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; worker-src blob:;"
    " base-uri 'none'; form-action 'none'"
)
LARGEST = 5_000_000  # characters of an embedded certificate: beyond that a page is no page to be sent by mail
_STYLE = (
    "#proof-here button,#proof-here input{font:inherit;padding:.45rem 1rem;cursor:pointer}"
    "#proof-here progress{margin:0 .8rem;width:12rem;vertical-align:middle}"
    "#proof-here [role=status]{margin:1rem 0 0;overflow-wrap:anywhere}"
    "#proof-here [role=status] strong{display:block;font-size:1.4rem;color:var(--accent)}"
    "#proof-here .drop{border:2px dashed var(--line);border-radius:.3rem;padding:1rem 1.5rem;margin:1rem 0}"
    "#proof-here input{display:block;padding-left:0;max-width:100%}"
    "#proof-here .over{background:var(--wash)}"
    "#proof-here svg{display:block;max-width:40rem;max-height:70vh;width:100%;margin:1rem 0}"
    "#proof-here polygon{fill:#fff;stroke:#8a8a8a;stroke-linejoin:round;vector-effect:non-scaling-stroke}"
    "#proof-here .by{fill:#fbe3dd}#proof-here .fails{fill:#c0270f;stroke:#c0270f;stroke-width:3}"
    "#proof-here dl{display:grid;grid-template-columns:8rem 1fr;gap:.2rem 1rem;margin:.6rem 0}#proof-here dd{margin:0}"
)


def proof_here(certificate: Mapping[str, object], name: str) -> str:
    """A button that checks a certificate anew, in the page itself, with the checker and the certificate embedded.

    Parameters
    ----------
    certificate : mapping
        As `Result.certificate` holds it.
    name : str
        Of the model, to be told with the answer; escaped here.

    Returns
    -------
    str
        HTML; one sentence where the certificate is too large to be embedded.
    """
    packed = _packed(json.dumps(certificate, sort_keys=True, separators=(",", ":")))
    if len(packed) > LARGEST:
        return "<p>The certificate is too large for this page to hold; write it to a file to check it.</p>"
    start = '<button type="button" class="check">Verify this proof here</button>'
    lead = (
        "<p>Or check it on the spot, without Python and off line. A second checker, which shares no"
        " code with the first, goes through the whole certificate in exact arithmetic; both are inside this page.</p>"
    )
    return lead + _checking(start, f"the model {name}") + _embedded("certificate", packed)


def proof_page() -> str:
    """A page of its own that checks whatever certificate is dropped on it."""
    choose = "".join(
        f'<div class="drop"><label>{words} <input type="file" name="{name}" accept=".json"></label></div>'
        for name, words in (
            ("certificate", "Drop a certificate here, or choose its file:"),
            ("model", "And its model, if you have it (cyclopean.model/1), to see whether it is about that:"),
        )
    )
    lead = (
        "Files stay on this machine: the page loads nothing and sends nothing. Its checker was written from the"
        " published rules, shares no code with the program that made the certificate, and calculates exactly."
    )
    title = "Is this proved?"
    return document(
        title, [f"<h1>{title}</h1>", section("Certificate", _checking(choose, "", "same_model.js"), lead)], may=CHECKING
    )


def _checking(start: str, name: str, *more: str) -> str:
    """What starts it, a bar, the answer; the checker, the outline and more, and the script that runs them."""
    worker = "".join(_without_comments(_asset(part)) for part in ("checker.js", "outline.js", *more))
    script = _without_comments(_asset("proof_here.js"))
    return (
        f'<style>{_STYLE}</style><div id="proof-here" data-name="{escape(name, quote=True)}">{start}'
        '<progress max="1" value="0" aria-label="Progress of the check" hidden></progress>'
        '<button type="button" class="stop" hidden>Stop</button><div role="status" aria-live="polite"></div>'
        "<noscript>This needs scripts, and the browser does not run them.</noscript></div>"
        f"{_embedded('checker', _packed(worker))}<script>{script}</script>"
    )


def _embedded(name: str, packed: str) -> str:
    return f'<script type="text/plain" id="{name}">{packed}</script>'


def _packed(text: str) -> str:
    return b64encode(zlib.compress(text.encode(), 9)).decode()


def _without_comments(script: str) -> str:
    """One of our scripts, in which "// " only begins comments, without these and indentation: an eighth less."""
    return re.sub(r"^\s+|\s*// .*$", "", script, flags=re.MULTILINE)


def _asset(name: str) -> str:
    return files("cyclopean.view").joinpath(name).read_text(encoding="utf-8")
