"""A drawing as SVG that plots at the scale of its sheet."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from cad.drawing.items import FULL_DEG, Arc, Box, Dimension, Item, Line, Words

_COLOURS = {"PART": "#111111", "DIMENSIONS": "#1f4fa3", "NOTES": "#333333", "SHEET": "#111111"}
_PENS = {"PART": 0.5, "DIMENSIONS": 0.18, "NOTES": 0.25, "SHEET": 0.35}  # [mm] on paper
_CAPITAL = 0.729  # height of a capital of a monospaced letter over the size of its font


def write_svg(items: Sequence[Item], path: Path, title: str, window: Box, scale: float) -> None:
    """Write what lies in a window of a drawing [mm], plotted at a scale; raises OSError."""
    left, bottom, right, top = window
    width, height = right - left, top - bottom
    body = "\n".join(_svg(item, scale) for item in items)
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{scale * width:.3f}mm" height="{scale * height:.3f}mm" '
        f'viewBox="{left:.3f} {-top:.3f} {width:.3f} {height:.3f}">\n<title>{escape(title, quote=False)}</title>\n'
        f'<rect x="{left:.3f}" y="{-top:.3f}" width="{width:.3f}" height="{height:.3f}" fill="#ffffff"/>\n'
        f'<g fill="none" stroke-linecap="round" font-family="\'DejaVu Sans Mono\', monospace">\n{body}\n</g>\n</svg>\n',
        encoding="utf-8",
    )


def _svg(item: Item, scale: float) -> str:
    if isinstance(item, Dimension):
        lines = "".join(_svg(line, scale) for line in item.lines)
        return f'<g class="dimension">{lines}{_svg(item.words, scale)}</g>'
    colour = _COLOURS[item.layer]
    if isinstance(item, Words):
        return _svg_words(item, colour)
    look = f'stroke="{colour}" stroke-width="{_PENS[item.layer] / scale:.4f}"'
    if isinstance(item, Line):
        (x1, y1), (x2, y2) = item.start, item.end
        return f'<path d="M{x1:.4f} {-y1:.4f}L{x2:.4f} {-y2:.4f}" {look}/>'
    return _svg_arc(item, look)


def _svg_arc(item: Arc, look: str) -> str:
    (x, y), r = item.centre, item.radius
    if item.closed:
        return f'<circle cx="{x:.4f}" cy="{-y:.4f}" r="{r:.4f}" {look}/>'
    (x1, y1), (x2, y2) = item.ends
    large = int((item.end - item.start) % FULL_DEG > 0.5 * FULL_DEG)
    return f'<path d="M{x1:.4f} {-y1:.4f}A{r:.4f} {r:.4f} 0 {large} 0 {x2:.4f} {-y2:.4f}" {look}/>'


def _svg_words(item: Words, colour: str) -> str:
    left, bottom, right, top = item.box
    x = 0.5 * (left + right) if item.centred else left
    base = bottom if not item.turn else 0.5 * (bottom + top)
    if item.turn:
        x, base = right, 0.5 * (bottom + top)
    anchor = "middle" if item.centred else "start"
    turn = f' transform="rotate({-item.turn:g} {x:.4f} {-base:.4f})"' if item.turn else ""
    place = f'x="{x:.4f}" y="{-base:.4f}" font-size="{item.height / _CAPITAL:.3f}" text-anchor="{anchor}"'
    return f'<text {place} fill="{colour}"{turn}>{escape(item.text, quote=False)}</text>'
