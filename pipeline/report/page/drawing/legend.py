"""Legends of plots: a swatch and a text for each thing that is drawn."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pipeline.report.page.drawing.panel import Panel, Words

Place = Literal["lower right", "upper left", "center right", "above"]

_SWATCH = 18.0  # [pt] wide
_ROW = 14.0  # [pt]
_EDGE = 8.0  # [pt] from the panel
_SIZE = 9.0  # [pt] of the words
_LETTER = 5.0  # [pt] that a letter of them is wide, in a wide font


@dataclass(frozen=True, kw_only=True)
class Entry:
    """What is drawn in a colour: an area, a line with its dashes, or points on a line; `opacity` is that of an area."""

    text: str
    colour: str
    kind: Literal["area", "line", "points"] = "line"
    dash: str = ""
    opacity: float = 1.0


def draw_legend(panel: Panel, place: Place, entries: Sequence[Entry]) -> None:
    """Write a legend in a corner or at the right end of a panel, or in one row above it."""
    box = panel.box
    count = len(entries)
    if place == "above":
        left = box.left
        for entry in entries:
            _draw(panel, entry, left, box.top - _ROW, "right")
            left += _SWATCH + 20.0 + _LETTER * len(entry.text)
        return
    top = {
        "lower right": box.top + box.height - _EDGE - _ROW * (count - 0.5),
        "center right": box.top + 0.5 * (box.height - _ROW * (count - 1)),
        "upper left": box.top + _EDGE + 0.5 * _ROW,
    }[place]
    for row, entry in enumerate(entries):
        if place == "upper left":
            _draw(panel, entry, box.left + _EDGE, top + _ROW * row, "right")
        else:
            _draw(panel, entry, box.left + box.width - _EDGE - _SWATCH, top + _ROW * row, "left")


def _draw(panel: Panel, entry: Entry, left: float, middle: float, side: Literal["left", "right"]) -> None:
    """Draw a swatch, the middle of its left end at a place [pt], with its text on one side of it."""
    colour = entry.colour
    if entry.kind == "area":
        size = f'x="{left:.2f}" y="{middle - 4.0:.2f}" width="{_SWATCH:g}" height="8"'
        swatch = f'<rect {size} style="fill:{colour};fill-opacity:{entry.opacity:g}"/>'
    else:
        dash = f";stroke-dasharray:{entry.dash}" if entry.dash else ""
        line = f"M{left:.2f} {middle:.2f}h{_SWATCH:g}"
        swatch = f'<path d="{line}" style="fill:none;stroke:{colour};stroke-width:1.5{dash}"/>'
    if entry.kind == "points":
        centre = f'cx="{left + 0.5 * _SWATCH:.2f}" cy="{middle:.2f}" r="2.5"'
        swatch += f'<circle {centre} style="fill:{colour}"/>'
    panel.written.append(swatch)
    if side == "right":
        panel.write_at(entry.text, left + _SWATCH + 5.0, middle, Words(size=_SIZE))
    else:
        panel.write_at(entry.text, left - 5.0, middle, Words(size=_SIZE, anchor="end"))
