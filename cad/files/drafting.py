"""Lines, arcs and words of a drawing [mm], written as DXF and as SVG with bytes that no font or clock decides."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

from ezdxf import units
from ezdxf._options import options
from ezdxf.enums import TextEntityAlignment
from ezdxf.filemanagement import new
from ezdxf.layouts.layout import Modelspace

Point = tuple[float, float]
_LAYERS = {"PART": 7, "DIMENSIONS": 5, "NOTES": 3}  # with the colour of each, by AutoCAD's index
_PENS = {"PART": ("#111111", 0.25), "DIMENSIONS": ("#1f4fa3", 0.09), "NOTES": ("#333333", 0.09)}
FULL_DEG = 360.0
_MARGIN = 8.0
_LETTER = 0.8  # width of a monospaced letter over the height of a capital
_TEXT = 1.25  # [mm] height of a capital; 2.5 mm as plotted
_PLOT = 2.0  # scale of the SVG


@dataclass(frozen=True, kw_only=True)
class Line:
    """A straight line from one point to another on a layer."""

    start: Point
    end: Point
    layer: str = "PART"


@dataclass(frozen=True, kw_only=True)
class Arc:
    """A circular arc, counter-clockwise from one angle to another [deg]; a circle goes from 0 to 360."""

    centre: Point
    radius: float
    start: float
    end: float
    layer: str = "PART"

    @property
    def closed(self) -> bool:
        """Say whether this is a whole circle."""
        return self.end - self.start >= FULL_DEG

    @property
    def ends(self) -> tuple[Point, ...]:
        """Return the points at both ends [mm]."""
        (x, y), r = self.centre, self.radius
        turns = (math.radians(self.start), math.radians(self.end))
        return tuple((x + r * math.cos(turn), y + r * math.sin(turn)) for turn in turns)


@dataclass(frozen=True, kw_only=True)
class Words:
    """A line of text with the middle of its base, or its left end, at a point; turned by an angle [deg]."""

    text: str
    at: Point
    height: float = _TEXT
    turn: float = 0.0
    centred: bool = True
    layer: str = "DIMENSIONS"


Item = Line | Arc | Words


def write_dxf(items: Sequence[Item], path: Path) -> None:
    """Write a drawing [mm] as DXF R2010; raises OSError."""
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True  # else the file holds the time and a random id
    try:
        document = new("R2010", setup=False)
        document.units = units.MM
        for layer, colour in _LAYERS.items():
            document.layers.add(layer, color=colour)
        for item in items:
            _add_entity(document.modelspace(), item)
        for kind in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(kind)  # ezdxf itself takes them in the order of a set
        document.saveas(path)
    finally:
        options.write_fixed_meta_data_for_testing = before


def _add_entity(space: Modelspace, item: Item) -> None:
    look = {"layer": item.layer}
    if isinstance(item, Line):
        space.add_line(item.start, item.end, dxfattribs=look)
    elif isinstance(item, Words):
        text = space.add_text(item.text, height=item.height, rotation=item.turn, dxfattribs=look)
        align = TextEntityAlignment.BOTTOM_CENTER if item.centred else TextEntityAlignment.BOTTOM_LEFT
        text.set_placement(item.at, align=align)
    elif item.closed:
        space.add_circle(item.centre, item.radius, dxfattribs=look)
    else:
        space.add_arc(item.centre, item.radius, item.start, item.end, dxfattribs=look)


def write_svg(items: Sequence[Item], path: Path, title: str) -> None:
    """Write a drawing [mm] as SVG, plotted at 2:1; raises OSError."""
    x, y = zip(*(point for item in items for point in _extremes(item)), strict=True)
    left, top = min(x) - _MARGIN, max(y) + _MARGIN
    width, height = max(x) + _MARGIN - left, top - (min(y) - _MARGIN)
    body = "\n".join(_svg(item) for item in items)
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_PLOT * width:.3f}mm" height="{_PLOT * height:.3f}mm" '
        f'viewBox="{left:.3f} {-top:.3f} {width:.3f} {height:.3f}">\n<title>{escape(title)}</title>\n'
        f'<rect x="{left:.3f}" y="{-top:.3f}" width="{width:.3f}" height="{height:.3f}" fill="#ffffff"/>\n'
        f'<g fill="none" stroke-linecap="round" font-family="monospace">\n{body}\n</g>\n</svg>\n',
        encoding="utf-8",
    )


def _extremes(item: Item) -> list[Point]:
    """Return points whose bounding box holds an item."""
    if isinstance(item, Line):
        return [item.start, item.end]
    if isinstance(item, Arc):
        (x, y), r = item.centre, item.radius
        return [(x - r, y - r), (x + r, y + r)]
    (x, y), length = item.at, _LETTER * item.height * len(item.text)
    start = -0.5 * length if item.centred else 0.0
    sine, cosine = math.sin(math.radians(item.turn)), math.cos(math.radians(item.turn))
    return [(x + cosine * s, y + sine * s + up) for s in (start, start + length) for up in (0.0, item.height)]


def _svg(item: Item) -> str:
    colour, pen = _PENS[item.layer]
    if isinstance(item, Words):
        return _svg_words(item, colour)
    look = f'stroke="{colour}" stroke-width="{pen}"'
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
    x, y = item.at
    anchor = "middle" if item.centred else "start"
    turn = f' transform="rotate({-item.turn:g} {x:.4f} {-y:.4f})"' if item.turn else ""
    place = f'x="{x:.4f}" y="{-y:.4f}" font-size="{item.height / 0.75:.3f}" text-anchor="{anchor}"'
    return f'<text {place} fill="{colour}"{turn}>{escape(item.text)}</text>'


def horizontal_dimension(x: Point, level: float, text: str, feet: Point | None = None) -> tuple[Item, ...]:
    """Return a dimension between two x at a level, with lines to the levels of the two ends measured [mm]."""
    (a, b), ends = x, feet or (level, level)
    words = Words(text=text, at=(0.5 * (a + b), level + 0.35))
    return _dimension((a, level), (b, level), ((a, ends[0]), (b, ends[1])), words)


def vertical_dimension(y: Point, place: float, text: str, feet: Point | None = None) -> tuple[Item, ...]:
    """Return a dimension between two heights at a place x, with lines to x of the two ends measured [mm]."""
    (a, b), ends = y, feet or (place, place)
    words = Words(text=text, at=(place - 0.35, 0.5 * (a + b)), turn=90.0)
    return _dimension((place, a), (place, b), ((ends[0], a), (ends[1], b)), words)


def _dimension(start: Point, end: Point, feet: tuple[Point, Point], words: Words) -> tuple[Item, ...]:
    witness = [_thin(foot, point) for foot, point in zip(feet, (start, end), strict=True) if foot != point]
    return (*witness, _thin(start, end), *_arrows(start, end), words)


def leader(at: Point, text_at: Point, text: str) -> tuple[Item, ...]:
    """Return words on a line that ends in an arrow at a place."""
    end = text_at[0] + _LETTER * _TEXT * len(text)
    near = text_at if abs(at[0] - text_at[0]) < abs(at[0] - end) else (end, text_at[1])
    words = Words(text=text, at=(text_at[0], text_at[1] + 0.35), centred=False)
    return (_thin(text_at, (end, text_at[1])), _thin(near, at), *_arrows(at, near)[:2], words)


def _arrows(a: Point, b: Point) -> tuple[Item, ...]:
    """Return two strokes of an arrow at each end of a line."""
    length = math.dist(a, b)
    if length == 0.0:
        return ()
    u, v = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    ends = [(a, 1.0, side) for side in (-0.25, 0.25)] + [(b, -1.0, side) for side in (-0.25, 0.25)]
    return tuple(_thin((x, y), (x + sign * u - side * v, y + sign * v + side * u)) for (x, y), sign, side in ends)


def _thin(start: Point, end: Point) -> Line:
    return Line(start=start, end=end, layer="DIMENSIONS")
