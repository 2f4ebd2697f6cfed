"""A drawing as DXF R2010 in millimetres of the part, its dimensions as DIMENSION entities that measure it."""

import math
from collections.abc import Sequence
from pathlib import Path

from ezdxf import units
from ezdxf._options import options
from ezdxf.document import Drawing
from ezdxf.entities.dimstyleoverride import DimStyleOverride
from ezdxf.enums import TextEntityAlignment
from ezdxf.filemanagement import new
from ezdxf.layouts.base import BaseLayout

from cad.drawing.items import DECIMALS, LAYERS, Dimension, Item, Line, Words

_STYLE = "WORKSHOP"
_BY_LAYER = 256
_LOOK = {"layer": "DIMENSIONS"}
_CODES = {"Ø": "%%c", "±": "%%p"}  # that every text font of a DXF viewer knows


def write_dxf(items: Sequence[Item], path: Path) -> None:
    """Write a drawing [mm] as DXF; the same items give the same bytes; raises OSError."""
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True  # else the file holds the time and a random id
    try:
        document = new("R2010", setup=False)
        document.units = units.MM
        for layer, colour in LAYERS.items():
            document.layers.add(layer, color=colour)
        heights = [item.height for item in items if isinstance(item, Dimension)]
        _add_style(document, max(heights, default=1.0))
        for item in items:
            _add_entity(document.modelspace(), item)
        for kind in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(kind)  # ezdxf itself takes them in the order of a set
        document.saveas(path)
    finally:
        options.write_fixed_meta_data_for_testing = before


def _add_style(document: Drawing, height: float) -> None:
    """Add the style of all dimensions by the height of their text [mm]: text over the line, as measured."""
    style = document.dimstyles.add(_STYLE)
    sizes = {"dimtxt": 1.0, "dimasz": 0.8, "dimexo": 0.4, "dimexe": 0.4, "dimgap": 0.3}
    for name, share in sizes.items():
        style.dxf.set(name, share * height)
    for name in ("dimclrd", "dimclre", "dimclrt"):
        style.dxf.set(name, _BY_LAYER)
    for name, number in {"dimdec": DECIMALS, "dimzin": 8, "dimtad": 1, "dimtih": 0, "dimtoh": 0, "dimtix": 0}.items():
        style.dxf.set(name, number)
    style.dxf.set("dimdsep", ord("."))


def _coded(text: str) -> str:
    for letter, code in _CODES.items():
        text = text.replace(letter, code)
    return text


def _add_entity(space: BaseLayout, item: Item) -> None:
    if isinstance(item, Dimension):
        _add_dimension(space, item)
        return
    look = {"layer": item.layer}
    if isinstance(item, Line):
        space.add_line(item.start, item.end, dxfattribs=look)
    elif isinstance(item, Words):
        text = space.add_text(_coded(item.text), height=item.height, rotation=item.turn, dxfattribs=look)
        align = TextEntityAlignment.MIDDLE_CENTER if item.centred else TextEntityAlignment.MIDDLE_LEFT
        text.set_placement(item.at, align=align)
    elif item.closed:
        space.add_circle(item.centre, item.radius, dxfattribs=look)
    else:
        space.add_arc(item.centre, item.radius, item.start, item.end, dxfattribs=look)


def _add_dimension(space: BaseLayout, item: Dimension) -> None:
    """Add a DIMENSION between the points that it measures; its picture is that of the SVG, letter by letter."""
    made = _linear(space, item) if item.kind in ("x", "z") else _round(space, item)
    made.render()
    picture = made.dimension.get_geometry_block()
    if picture is None:
        msg = "DXF: a dimension has no picture; install ezdxf as the lock file has it"
        raise ValueError(msg)
    picture.delete_all_entities()
    for line in item.lines:
        _add_entity(picture, line)
    _add_entity(picture, item.words)
    made.dimension.dxf.text_midpoint = (*item.text_at, 0.0)


def _linear(space: BaseLayout, item: Dimension) -> DimStyleOverride:
    along_x = item.kind == "x"
    return space.add_linear_dim(
        base=(item.text_at[0], item.level) if along_x else (item.level, item.text_at[1]),
        p1=item.start,
        p2=item.end,
        location=item.text_at,
        text=_coded(item.label),
        angle=0.0 if along_x else 90.0,
        text_rotation=item.turn,
        dimstyle=_STYLE,
        dxfattribs=_LOOK,
    )


def _round(space: BaseLayout, item: Dimension) -> DimStyleOverride:
    (x, z), (a, b) = item.start, item.end
    add = space.add_radius_dim if item.kind == "radius" else space.add_diameter_dim
    return add(
        center=item.start,
        radius=math.dist(item.start, item.end),
        angle=math.degrees(math.atan2(b - z, a - x)),
        location=item.text_at,
        text=_coded(item.label),
        dimstyle=_STYLE,
        dxfattribs=_LOOK,
    )
