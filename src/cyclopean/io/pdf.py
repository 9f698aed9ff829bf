"""Sheets as one PDF, with the extra `pdf` (reportlab): drawings of the kit (`view.svg`) in millimetres of paper.

Shapes stay lines and areas, words stay words that can be searched, in Helvetica, which every reader has. A pattern is
left out: what is to be seen in print is drawn in plain colours. The same sheets give the same bits.
"""

import re
from collections.abc import Iterable, Mapping
from io import BytesIO
from typing import Any
from xml.etree import ElementTree

import numpy as np

from cyclopean.io.extras import extra
from cyclopean.io.line_work import corners
from cyclopean.io.svg_lines import Placed, hex_digits, placed

__all__ = ["pdf_bytes", "unwritable"]

POINT = 72.0 / 25.4  # points of PDF in a millimetre
DEVIATION = 0.01  # mm that corners may lie off a curve: a tenth of the finest line
BOLD = ("600", "700", "bold")
CAPS = {"butt": 0, "round": 1, "square": 2}


def unwritable(words: str) -> str:
    """Letters that the PDF cannot show: those that are not in Windows-1252, each once."""
    return "".join(dict.fromkeys(c for c in words if not c.encode("cp1252", "ignore")))


def pdf_bytes(sheets: Mapping[str, str], title: str) -> bytes:
    """Make a PDF, a page for each sheet.

    Parameters
    ----------
    sheets : mapping of str to str
        What each is called in the list of contents, and its drawing: one `<svg>` element, its `viewBox` in mm.
    title : str
        Of the document.

    Raises
    ------
    InputError
        reportlab is not installed.
    """
    stream = BytesIO()
    canvas = extra("pdf", ".pdfgen.canvas").Canvas(stream, invariant=1, pageCompression=1)
    canvas.setTitle(title)
    for number, (name, drawing) in enumerate(sheets.items(), 1):
        root = ElementTree.fromstring(drawing)
        wide, high = (POINT * float(x) for x in root.get("viewBox", "").split()[2:])
        canvas.setPageSize((wide, high))
        canvas.bookmarkPage(str(number))
        canvas.addOutlineEntry(_shown(name), str(number))
        _paint(canvas, placed("drawing", root, np.array([[POINT, 0.0, 0.0], [0.0, -POINT, high]])))
        canvas.showPage()
    canvas.save()
    return stream.getvalue()


def _paint(canvas: Any, parts: Iterable[Placed]) -> None:
    """What is drawn, in its order."""
    for one in parts:
        if one.kind == "text":
            _write(canvas, one)
            continue
        fill, stroke = _colour(one.style, "fill", "#000000"), _colour(one.style, "stroke", "none")
        if fill or stroke:
            _stroke_as(canvas, one, stroke)
            if fill:
                canvas.setFillColorRGB(*fill)
            canvas.drawPath(_path(canvas, one), stroke=int(bool(stroke)), fill=int(bool(fill)), fillMode=1)


def _stroke_as(canvas: Any, one: Placed, stroke: tuple[float, ...] | None) -> None:
    """Colour, width and dashes of lines."""
    if stroke:
        canvas.setStrokeColorRGB(*stroke)
        canvas.setLineWidth(one.larger * float(one.style.get("stroke-width", "1")))
        canvas.setLineJoin(1)
        canvas.setLineCap(CAPS[one.style.get("stroke-linecap", "butt")])
        canvas.setDash([one.larger * float(x) for x in re.split(r"[\s,]+", one.style.get("stroke-dasharray", "")) if x])


def _path(canvas: Any, one: Placed) -> Any:
    """Its lines as one path."""
    path = canvas.beginPath()
    for line in one.lines():
        points = corners(line, POINT * DEVIATION)[0].tolist()
        path.moveTo(*points[0])
        for x, y in points[1:]:
            path.lineTo(x, y)
        if line.closed:
            path.close()
    return path


def _write(canvas: Any, one: Placed) -> None:
    """A line of text, turned as its matrix says."""
    said = _shown("".join(one.element.itertext()))
    x, y = one.point("x", "y")
    way, size = one.matrix[:, 0] / np.linalg.norm(one.matrix[:, 0]), float(one.style.get("font-size", "16"))
    bold = "-Bold" if one.style.get("font-weight", "") in BOLD else ""
    canvas.saveState()
    canvas.setFillColorRGB(*(_colour(one.style, "fill", "#000000") or (0.0, 0.0, 0.0)))
    canvas.setFont(f"Helvetica{bold}", size * one.larger)
    canvas.transform(way[0], way[1], -way[1], way[0], x, y)
    draw = {"middle": canvas.drawCentredString, "end": canvas.drawRightString}
    draw.get(one.style.get("text-anchor", "start"), canvas.drawString)(0.0, 0.0, said)
    canvas.restoreState()


def _shown(words: str) -> str:
    """Words with a question mark for every letter that Helvetica has not."""
    return words.encode("cp1252", "replace").decode("cp1252")


def _colour(style: Mapping[str, str], what: str, otherwise: str) -> tuple[float, ...] | None:
    """Red, green and blue from 0 to 1; None where nothing is painted, or a pattern."""
    said = style.get(what, otherwise)
    said = style.get("color", "#000000") if said == "currentColor" else said
    full = hex_digits(said)
    return tuple(int(full[k : k + 2], 16) / 255.0 for k in (0, 2, 4)) if full else None
