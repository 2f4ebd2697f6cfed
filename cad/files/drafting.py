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


@dataclass(frozen=True, kw_only=True)
class Words:
    """A line of text with the middle of its foot, or its left end, at a point; turned by an angle [deg]."""

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
        space = document.modelspace()
        for layer, colour in _LAYERS.items():
            document.layers.add(layer, color=colour)
        for item in items:
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
        for kind in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(kind)  # ezdxf itself takes them in the order of a set
        document.saveas(path)
    finally:
        options.write_fixed_meta_data_for_testing = before


def write_svg(items: Sequence[Item], path: Path, title: str) -> None:
    """Write a drawing [mm] as SVG, plotted at 2:1; raises OSError."""
    points = [point for item in items for point in _reach(item)]
    left, right = min(x for x, _ in points) - _MARGIN, max(x for x, _ in points) + _MARGIN
    low, high = min(y for _, y in points) - _MARGIN, max(y for _, y in points) + _MARGIN
    width, height = right - left, high - low
    body = "\n".join(_svg(item) for item in items)
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_PLOT * width:.3f}mm" height="{_PLOT * height:.3f}mm" '
        f'viewBox="{left:.3f} {-high:.3f} {width:.3f} {height:.3f}">\n<title>{escape(title)}</title>\n'
        f'<rect x="{left:.3f}" y="{-high:.3f}" width="{width:.3f}" height="{height:.3f}" fill="#ffffff"/>\n'
        f'<g fill="none" stroke-linecap="round" font-family="monospace">\n{body}\n</g>\n</svg>\n',
        encoding="utf-8",
    )


def _reach(item: Item) -> list[Point]:
    if isinstance(item, Line):
        return [item.start, item.end]
    if isinstance(item, Arc):
        (x, y), r = item.centre, item.radius
        return [(x - r, y - r), (x + r, y + r)]
    long = _LETTER * item.height * len(item.text)
    before = 0.5 * long if item.centred else 0.0
    across, along = math.sin(math.radians(item.turn)), math.cos(math.radians(item.turn))
    ends = (-before, long - before)
    return [(item.at[0] + along * s, item.at[1] + across * s + up) for s in ends for up in (0.0, item.height)]


def _svg(item: Item) -> str:
    colour, pen = _PENS[item.layer]
    look = f'stroke="{colour}" stroke-width="{pen}"'
    if isinstance(item, Line):
        (x1, y1), (x2, y2) = item.start, item.end
        return f'<path d="M{x1:.4f} {-y1:.4f}L{x2:.4f} {-y2:.4f}" {look}/>'
    if isinstance(item, Words):
        x, y = item.at
        anchor = "middle" if item.centred else "start"
        turn = f' transform="rotate({-item.turn:g} {x:.4f} {-y:.4f})"' if item.turn else ""
        place = f'x="{x:.4f}" y="{-y:.4f}" font-size="{item.height / 0.75:.3f}" text-anchor="{anchor}"'
        return f'<text {place} fill="{colour}"{turn}>{escape(item.text)}</text>'
    (x, y), r = item.centre, item.radius
    if item.closed:
        return f'<circle cx="{x:.4f}" cy="{-y:.4f}" r="{r:.4f}" {look}/>'
    (x1, y1), (x2, y2) = (
        (x + r * math.cos(math.radians(turn)), y + r * math.sin(math.radians(turn))) for turn in (item.start, item.end)
    )
    large = int((item.end - item.start) % FULL_DEG > 0.5 * FULL_DEG)
    return f'<path d="M{x1:.4f} {-y1:.4f}A{r:.4f} {r:.4f} 0 {large} 0 {x2:.4f} {-y2:.4f}" {look}/>'


def across(x: Point, level: float, text: str, foot: tuple[float, float] | None = None) -> tuple[Item, ...]:
    """Return a dimension between two x at a level, with lines up or down to the feet of what it measures."""
    (a, b), feet = x, foot or (level, level)
    witness = [_thin((s, f), (s, level)) for s, f in zip(x, feet, strict=True) if f != level]
    middle = Words(text=text, at=(0.5 * (a + b), level + 0.35))
    return (*witness, _thin((a, level), (b, level)), *_tip((a, level), (b, level)), middle)


def upright(y: Point, place: float, text: str, foot: tuple[float, float] | None = None) -> tuple[Item, ...]:
    """Return a dimension between two heights at a place x, with lines to the feet of what it measures."""
    (a, b), feet = y, foot or (place, place)
    witness = [_thin((f, s), (place, s)) for s, f in zip(y, feet, strict=True) if f != place]
    middle = Words(text=text, at=(place - 0.35, 0.5 * (a + b)), turn=90.0)
    return (*witness, _thin((place, a), (place, b)), *_tip((place, a), (place, b)), middle)


def note(at: Point, text_at: Point, text: str) -> tuple[Item, ...]:
    """Return words on a line that ends in an arrow at a place."""
    end = text_at[0] + _LETTER * _TEXT * len(text)
    near = text_at if abs(at[0] - text_at[0]) < abs(at[0] - end) else (end, text_at[1])
    words = Words(text=text, at=(text_at[0], text_at[1] + 0.35), centred=False)
    return (_thin(text_at, (end, text_at[1])), _thin(near, at), *_tip(at, near)[:2], words)


def _tip(a: Point, b: Point) -> tuple[Item, ...]:
    """Return two strokes of an arrow at each end of a line."""
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    if length == 0.0:
        return ()
    u, v = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    found = []
    for (x, y), sign in ((a, 1.0), (b, -1.0)):
        for side in (-0.25, 0.25):
            end = (x + sign * u - side * v, y + sign * v + side * u)
            found.append(_thin((x, y), end))
    return tuple(found)


def _thin(start: Point, end: Point) -> Line:
    return Line(start=start, end=end, layer="DIMENSIONS")
