"""The DXF from which strips are cut [mm]: the outline of each different strip, its thickness and count beside it."""

from collections.abc import Sequence

from cad.drawing.canvas import Box, Canvas, text_width
from cad.parts.strips import CutStrip
from sensor.design.sheets import SoldSheet

_TEXT_MM = 2.5
_BETWEEN_MM = 8.0  # from one outline to the next, with the text between
_ROUNDED = 3  # decimals of a length [mm]


def strip_cutting(strips: Sequence[CutStrip], sheet: SoldSheet) -> str:
    """Return the text of the DXF: outlines on the layer PART, words on NOTES, which is not cut."""
    canvas = Canvas(1.0)
    foot = 0.0
    for cut in strips:
        box = Box(0.0, foot, round(cut.length, _ROUNDED), round(foot + cut.width, _ROUNDED))
        canvas.closed_outline(box.corners)
        words = f"{cut.spring} spring: {cut.count} pieces, {cut.thickness:g} thick, {cut.length:.2f} x {cut.width:g}"
        canvas.words(words, (0.0, box.top + 0.5 * _BETWEEN_MM), _TEXT_MM, "NOTES", from_the_left=True)
        foot = box.top + _BETWEEN_MM
    material = f"{sheet.material}; millimetres"
    height = min(_TEXT_MM, 150.0 / text_width(material, 1.0))
    canvas.words(material, (0.0, foot), height, "NOTES", from_the_left=True)
    return canvas.dxf()
