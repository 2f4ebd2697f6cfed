"""A drawing as a DXF document in millimetres of the part: lines, arcs, words, and dimensions that measure it."""

import copy
import io
import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast

from ezdxf import bbox, units
from ezdxf._options import options
from ezdxf.addons.drawing import layout
from ezdxf.addons.drawing.config import BackgroundPolicy, ColorPolicy, Configuration
from ezdxf.addons.drawing.frontend import Frontend
from ezdxf.addons.drawing.properties import RenderContext
from ezdxf.addons.drawing.recorder import Recorder
from ezdxf.addons.drawing.svg import SVGBackend
from ezdxf.document import Drawing
from ezdxf.entities.dimension import Dimension
from ezdxf.entities.dimstyleoverride import DimStyleOverride
from ezdxf.entities.insert import Insert
from ezdxf.entities.mtext import MText
from ezdxf.entities.text import Text
from ezdxf.enums import TextEntityAlignment
from ezdxf.filemanagement import new
from ezdxf.layouts.base import BaseLayout
from ezdxf.math import UCS, BoundingBox2d, Vec2, is_point_in_polygon_2d
from ezdxf.render.dim_radius import RadiusDimension
from ezdxf.render.dimension import DimensionRenderer
from ezdxf.render.hatching import hatch_entity

from cad.drawing.pdf import PdfPage

LAYERS = {
    "PART": 7,
    "DIMENSIONS": 5,
    "NOTES": 3,
    "SHEET": 8,
    "HATCH": 9,
    "AXES": 4,
}  # with the colour of each, by AutoCAD's index
THICK = 50  # [0.01 mm on paper], of what is seen and cut; thin lines are half of it, ISO 128-20
PENS = dict.fromkeys(LAYERS, THICK // 2) | {"PART": THICK, "SHEET": 35}  # [0.01 mm on paper]
TEXT_MM = 2.5  # height of a capital on paper, ISO 3098
LETTER = 0.83  # width of a monospaced letter over the height of a capital: DejaVu Sans Mono, 0.602 / 0.729
DECIMALS = 2  # of a length with a tolerance of its own: none is finer than 0.01 mm
SMALL_MM = 0.5  # below it a length needs a tolerance of its own: ISO 2768-1 has none
HATCH_STEP_MM = 2.0  # on paper, between the lines that mark a cut, ISO 128-50
MEASURED = "<>"
"""Stands in the text of a dimension for the measured length."""
IN_TABLE = ")"
"""Follows the letter of a dimension whose tolerance stands in a table."""
_DASHES = {"AXES": ("CENTER", 4.0)}  # pattern of ezdxf, and how long on paper
_FONT = "MONOSPACED"
_STYLE = "WORKSHOP"
_BY_LAYER = 256
_OFF_CORNERS_MM = 0.00271  # on paper: no line of a hatch goes through a corner
_UPRIGHT_DEG = 45.0
LINE_TO_TEXT = 0.8  # from a dimension line to the middle of its text, in heights of the text
_LEADER = {"dimtmove": 1, "dimtih": 1, "dimtoh": 1, "dimtofl": 0, "dimcen": 0.0}  # to a level text, no centre mark
_CODES = {"Ø": "%%c", "±": "%%p"}  # that every text font of a DXF viewer knows

options.write_fixed_meta_data_for_testing = True  # ezdxf then writes no time and no random id

Point = tuple[float, float]


class Box(NamedTuple):
    """A rectangle [mm]."""

    left: float
    bottom: float
    right: float
    top: float

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Return the four corners, gone round from the lower left one [mm]."""
        left, bottom, right, top = self
        return (left, bottom), (right, bottom), (right, top), (left, top)


class DimensionText(NamedTuple):
    """The text of a dimension: its middle [mm], what it says, and by how much it is turned [deg]."""

    at: Point
    label: str = MEASURED
    rotation: float = 0.0


class CalloutText(NamedTuple):
    """The text of a radius or a diameter: on one side of a point [mm], with a gap, and what it says."""

    beside: Point
    side: Literal["left", "right"]
    label: str = MEASURED


def text_width(text: str, height: float) -> float:
    """Return the width of a line of text of a height [mm]."""
    return LETTER * height * len(text)


def length_text(length: float, decimals: int = DECIMALS) -> str:
    """Return a length [mm] as text without zeros at its end."""
    return f"{length:.{decimals}f}".rstrip("0").rstrip(".")


class Canvas:
    """What is drawn of a part [mm], for a sheet of the scale: millimetres of paper over those of the part."""

    def __init__(self, scale: float, decimals: int = DECIMALS) -> None:
        """Take the scale, and the decimals of lengths that have the general tolerance alone."""
        self.scale = scale
        self.decimals = decimals
        self.text_height = TEXT_MM / scale
        self.document = _new_document(self.text_height)
        self.space: BaseLayout = self.document.modelspace()

    def paper(self, corner: Point) -> "Canvas":
        """Return a canvas in millimetres of the paper, whose origin is the lower left corner of the sheet [mm].

        It draws into a block of the same document, which stands at that corner.
        """
        paper = copy.copy(self)
        paper.scale = 1.0
        paper.text_height = TEXT_MM
        paper.space = self.document.blocks.new("SHEET")
        self.space.add_blockref("SHEET", corner, dxfattribs={"xscale": 1.0 / self.scale, "yscale": 1.0 / self.scale})
        return paper

    def count(self) -> int:
        """Return the number of entities."""
        return len(self.space)

    def extents(self, after: int = 0) -> Box:
        """Return the box around all that is drawn [mm], or around what was drawn after so many entities."""
        corners = bbox.extents(list(self.space)[after:], fast=True)
        return Box(corners.extmin.x, corners.extmin.y, corners.extmax.x, corners.extmax.y)

    def label_width(self, label: str, length: float) -> float:
        """Return the width of the text of a dimension that measures a length [mm]."""
        number = length_text(length, self._decimals(label, length))
        return text_width(label.replace(MEASURED, number), self.text_height)

    def _decimals(self, label: str, length: float) -> int:
        """Return the decimals of a length [mm], fewer where the general tolerance is all that it has."""
        return self.decimals if IN_TABLE not in label and length >= SMALL_MM else DECIMALS

    def line(self, start: Point, end: Point, layer: str = "PART") -> None:
        """Draw a straight line: of long dashes and dots on AXES."""
        self.space.add_line(start, end, dxfattribs=self._look(layer))

    def _look(self, layer: str) -> dict[str, Any]:
        if layer not in _DASHES:
            return {"layer": layer}
        pattern, length = _DASHES[layer]
        return {"layer": layer, "linetype": pattern, "ltscale": length / self.scale}

    def rectangle(self, box: Box, layer: str = "PART") -> None:
        """Draw the four sides of a box."""
        self.polyline((*box.corners, box.corners[0]), layer)

    def circle(self, centre: Point, radius: float, layer: str = "PART") -> None:
        """Draw a circle."""
        self.space.add_circle(centre, radius, dxfattribs=self._look(layer))

    def centre_mark(self, centre: Point, radius: float) -> None:
        """Draw the two centre lines of a hole that is seen along its axis."""
        x, z = centre
        self.centre_line((x - radius, z), (x + radius, z))
        self.centre_line((x, z - radius), (x, z + radius))

    def centre_line(self, start: Point, end: Point) -> None:
        """Draw a centre line that stands out of both ends by 2 mm on paper."""
        share = 2.0 / (self.scale * math.dist(start, end))
        reach = (share * (end[0] - start[0]), share * (end[1] - start[1]))
        self.line((start[0] - reach[0], start[1] - reach[1]), (end[0] + reach[0], end[1] + reach[1]), "AXES")

    def hatch(self, outlines: Sequence[Sequence[Point]]) -> None:
        """Hatch what lies within the first closed outline [mm] and outside the others; texts within it stay free.

        The lines of ezdxf's pattern are drawn as plain lines, in order of their coordinates. Every viewer then shows
        the same, and the same drawing has the same bytes.
        """
        hatch = self.space.add_hatch()
        across = HATCH_STEP_MM / (self.scale * math.sqrt(2.0))  # from one line to the next, along x and along z
        off_corners = (_OFF_CORNERS_MM / self.scale, 0.0)  # ezdxf itself would take a random offset
        hatch.set_pattern_fill("CUT", definition=[[45.0, off_corners, (-across, across), []]])
        for outline in (*outlines, *self._around_texts(outlines)):
            hatch.paths.add_polyline_path(outline, is_closed=True)
        lines = sorted((start.x, start.y, end.x, end.y) for start, end in hatch_entity(hatch, jiggle_origin=False))
        self.space.delete_entity(hatch)
        for x, z, end_x, end_z in lines:
            self.line((x, z), (end_x, end_z), "HATCH")

    def _around_texts(self, outlines: Sequence[Sequence[Point]]) -> list[Sequence[Point]]:
        """Return the outlines that a hatch leaves free: around each text within the first outline, outside the others.

        They are half a text's height wider than the text.
        """
        outer, *holes = outlines
        margin = 0.5 * self.text_height
        around: list[Sequence[Point]] = []
        for _, (left, bottom, right, top) in self.texts():
            corners = Box(left - margin, bottom - margin, right + margin, top + margin).corners
            in_hole = any(_is_inside(corners[0], hole) for hole in (*holes, *around))
            if not in_hole and all(_is_inside(corner, outer) for corner in corners):
                around.append(corners)
        return around

    def dimensions(self) -> list[Dimension]:
        """Return every dimension."""
        return [cast(Dimension, entity) for entity in self.space.query("DIMENSION")]

    def texts(self) -> list[tuple[str, Box]]:
        """Return every text with the box around it [mm]: words, also those of the sheet, and texts of dimensions."""
        placed = []
        of_sheet = [text for sheet in self.space.query("INSERT") for text in cast(Insert, sheet).virtual_entities()]
        for entity in (*self.space, *of_sheet):
            if isinstance(entity, Text) and entity.plain_text():
                around = bbox.extents([entity])
                box = Box(around.extmin.x, around.extmin.y, around.extmax.x, around.extmax.y)
                placed.append((entity.plain_text(), box))
            if isinstance(entity, Dimension):
                drawn = [text for text in entity.virtual_entities() if isinstance(text, MText)]
                placed += [(str(text.plain_text()), _box_of(text)) for text in drawn]
        return placed

    def polyline(self, points: Sequence[Point], layer: str = "PART") -> None:
        """Draw the straight lines from each point to the next one."""
        for start, end in itertools.pairwise(points):
            self.line(start, end, layer)

    def arc(self, centre: Point, radius: float, start: float, end: float, layer: str = "PART") -> None:
        """Draw an arc, counter-clockwise from one angle to another [deg]."""
        self.space.add_arc(centre, radius, start, end, dxfattribs={"layer": layer})

    def words(
        self, text: str, at: Point, height: float, layer: str = "DIMENSIONS", *, from_the_left: bool = False
    ) -> None:
        """Write a line of text of a height [mm of the part] about its middle, or from its left end."""
        entity = self.space.add_text(_coded(text), height=height, dxfattribs={"layer": layer, "style": _FONT})
        align = TextEntityAlignment.MIDDLE_LEFT if from_the_left else TextEntityAlignment.MIDDLE_CENTER
        entity.set_placement(at, align=align)

    def length(
        self,
        axis: Literal["x", "z"],
        start: Point,
        end: Point,
        level: float,
        text: DimensionText,
    ) -> None:
        """Draw the dimension of the length between two points [mm] along an axis; `level` is where its line runs [mm].

        That is z of a line along x, x of a line along z.
        """
        along = 0 if axis == "x" else 1
        start, end = sorted((start, end), key=lambda point: point[along])  # ezdxf would turn both arrows round
        distance = end[along] - start[along]
        dimension = self.space.add_linear_dim(
            base=(text.at[0], level) if axis == "x" else (level, text.at[1]),
            p1=start,
            p2=end,
            location=text.at,
            text=_coded(text.label),
            angle=0.0 if axis == "x" else 90.0,
            text_rotation=text.rotation,
            dimstyle=_STYLE,
            override={"dimdec": self._decimals(text.label, distance)},
            dxfattribs={"layer": "DIMENSIONS"},
        )
        dimension.render()
        half_width = 0.5 * self.label_width(text.label, distance)
        self._lead_to_text(axis, (start[along], end[along]), level, text, half_width)

    def _lead_to_text(
        self,
        axis: Literal["x", "z"],
        ends: tuple[float, float],
        level: float,
        text: DimensionText,
        half_width: float,
    ) -> None:
        """Lengthen a dimension line to the far end of a text that stands beyond it; nothing for one within its `ends`.

        A level text of an upright line is underlined: the line bends to it. All lengths [mm]; `half_width` of the text.
        """
        low, high = ends
        middle = text.at[0] if axis == "x" else text.at[1]
        if low < middle < high:
            return
        outwards = 1.0 if middle > high else -1.0
        end = high if outwards > 0.0 else low
        if axis == "x":
            self.line((end, level), (middle + outwards * half_width, level), "DIMENSIONS")
        elif text.rotation:
            self.line((level, end), (level, middle + outwards * half_width), "DIMENSIONS")
        else:
            under_text = text.at[1] - LINE_TO_TEXT * self.text_height
            self.line((level, end), (level, under_text), "DIMENSIONS")
            to_far_end = math.copysign(half_width, text.at[0] - level)
            self.line((level, under_text), (text.at[0] + to_far_end, under_text), "DIMENSIONS")

    def callout(
        self,
        kind: Literal["radius", "diameter"],
        centre: Point,
        size: float,
        text: CalloutText,
        angle: float = 0.0,
    ) -> None:
        """Draw the dimension of a radius or a diameter, of this size [mm], with a leader to its text.

        The arrow of a radius meets the arc at the angle [deg].
        """
        gap = 2.0 * self.text_height
        x, z = text.beside
        leader_end = (x + (gap if text.side == "right" else -gap), z)
        look: dict[str, Any] = {
            "text": _coded(text.label),
            "dimstyle": _STYLE,
            "override": _LEADER,
            "dxfattribs": {"layer": "DIMENSIONS"},
        }
        if kind == "radius":
            dimension = self.space.add_radius_dim(centre, radius=size, angle=angle, **look)
            dimension.set_location(leader_end, leader=True)
        else:  # ezdxf lets the arrow of a diameter meet the circle on the side of its text
            dimension = self.space.add_diameter_dim(centre, radius=0.5 * size, location=leader_end, **look)
        dimension.render()

    def dxf(self) -> str:
        """Return the drawing as DXF R2010; the same drawing gives the same text."""
        for kind in sorted(self.document.entitydb.dxf_types_in_use()):
            self.document.classes.add_class(kind)  # ezdxf itself takes them in the order of a set
        text = io.StringIO()
        self.document.write(text)
        return text.getvalue()

    def write_svg(self, path: Path, window: Box) -> None:
        """Write what lies in a window of the drawing [mm] as SVG that plots at its scale; raises OSError."""
        backend = SVGBackend()
        self._play(backend)
        page = layout.Page(*self._size_on_paper(window))
        settings = layout.Settings(fit_page=False, scale=self.scale)
        paper = BoundingBox2d([(window.left, window.bottom), (window.right, window.top)])
        path.write_text(backend.get_string(page, settings=settings, render_box=paper), encoding="utf-8")

    def write_pdf(self, path: Path, window: Box) -> None:
        """Write what lies in a window of the drawing [mm] as PDF that prints at its scale; raises OSError."""
        page = PdfPage((window.left, window.bottom), self.scale)
        self._play(page)
        path.write_bytes(page.file(*self._size_on_paper(window)))

    def _play(self, recorder: Recorder) -> None:
        """Draw all lines, letters and arrows, black on white, on what records them."""
        look = Configuration(background_policy=BackgroundPolicy.WHITE, color_policy=ColorPolicy.BLACK)
        Frontend(RenderContext(self.document), recorder, config=look).draw_layout(self.document.modelspace())

    def _size_on_paper(self, window: Box) -> tuple[float, float]:
        return self.scale * (window.right - window.left), self.scale * (window.top - window.bottom)


class _Radius(RadiusDimension):
    """A radius whose arrow comes from where its text is: ezdxf itself turns it wherever that is outside the circle."""

    def is_location_outside(self, location: Vec2) -> bool:
        """Say whether the text lies on the other side of the arc than its centre."""
        return bool((location - self.point_on_circle).dot(self.dim_line_vec) > 0.0)


class _Renderer(DimensionRenderer):
    """What draws dimensions."""

    def radius(self, dimension: Dimension, ucs: UCS | None = None, override: DimStyleOverride | None = None) -> _Radius:
        """Return the entities of a radius."""
        return _Radius(dimension, ucs, override)


def _new_document(text_height: float) -> Drawing:
    """Return an empty document with our layers, and a style of dimensions: text over the line, as measured.

    `text_height` is the height of the texts of dimensions [mm of the part]. AutoCAD's DXF reference explains the
    variables of the style, such as `dimtxt`, in its group DIMSTYLE.
    """
    document = new("R2010", setup=["linetypes"])
    document.units = units.MM
    document.dimension_renderer = _Renderer()
    for layer, colour in LAYERS.items():
        document.layers.add(layer, color=colour, lineweight=PENS[layer])
    document.styles.add(_FONT, font="DejaVuSansMono.ttf")
    style = document.dimstyles.add(_STYLE)
    sizes = {"dimtxt": 1.0, "dimasz": 0.8, "dimexo": 0.4, "dimexe": 0.4, "dimgap": 0.3}  # in heights of the text
    for name, heights in sizes.items():
        style.dxf.set(name, heights * text_height)
    for name in ("dimclrd", "dimclre", "dimclrt"):  # colours of the line, of its extensions, of the text
        style.dxf.set(name, _BY_LAYER)
    # No zeros at the end; text above the line, turned with it, and moved out where it has no room.
    for name, number in {"dimdec": DECIMALS, "dimzin": 8, "dimtad": 1, "dimtih": 0, "dimtoh": 0, "dimtix": 0}.items():
        style.dxf.set(name, number)
    style.dxf.set("dimdsep", ord("."))
    style.dxf.set("dimtxsty", _FONT)
    return document


def _is_inside(point: Point, outline: Sequence[Point]) -> bool:
    """Say whether a point [mm] lies inside a closed outline, not on it."""
    return bool(is_point_in_polygon_2d(Vec2(point), Vec2.list(outline)) > 0)


def _box_of(text: MText) -> Box:
    """Return the box around the text of a dimension [mm], which is level or upright."""
    along = 0.5 * text_width(str(text.plain_text()), text.dxf.char_height)
    across = 0.5 * text.dxf.char_height
    is_upright = abs(text.get_rotation()) > _UPRIGHT_DEG
    half_width, half_height = (across, along) if is_upright else (along, across)
    x, z = text.dxf.insert.x, text.dxf.insert.y
    return Box(x - half_width, z - half_height, x + half_width, z + half_height)


def _coded(text: str) -> str:
    """Return a text with the codes of DXF for the signs of diameter and of plus or minus."""
    for letter, code in _CODES.items():
        text = text.replace(letter, code)
    return text
