"""A drawing as a DXF document in millimetres of the part: lines, arcs, texts, and dimensions with measured lengths."""

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
}  # layers, each with its colour by AutoCAD's index
THICK = 50  # width of visible and cut edges [0.01 mm on paper]; thin lines have half of it, ISO 128-20
PENS = dict.fromkeys(LAYERS, THICK // 2) | {"PART": THICK, "SHEET": 35}  # line widths [0.01 mm on paper]
TEXT_MM = 2.5  # height of a capital on paper, ISO 3098
LETTER = 0.83  # width of a monospaced letter over the height of a capital: DejaVu Sans Mono, 0.602 / 0.729
DECIMALS = 2  # decimals of a length with its own tolerance, because no tolerance is finer than 0.01 mm
SMALL_MM = 0.5  # shortest length with a general tolerance in ISO 2768-1; a shorter one needs its own
HATCH_STEP_MM = 2.0  # distance between hatch lines on paper, ISO 128-50
MEASURED = "<>"
"""The placeholder for the measured length in the text of a dimension, as in DXF."""
IN_TABLE = ")"
"""The sign after the letter of a dimension whose tolerance is in a table."""
_DASHES = {"AXES": ("CENTER", 4.0)}  # line pattern of ezdxf, and its length on paper [mm]
_FONT = "MONOSPACED"
_STYLE = "WORKSHOP"
_BY_LAYER = 256
_OFF_CORNERS_MM = 0.00271  # odd shift of the hatch on paper, so that no hatch line meets a corner exactly
_UPRIGHT_DEG = 45.0  # a text turned by more than this is upright; texts are turned by 0 or 90 degrees
LINE_TO_TEXT = 0.8  # distance from a dimension line to the middle of its text, in text heights
_LEADER = {"dimtmove": 1, "dimtih": 1, "dimtoh": 1, "dimtofl": 0, "dimcen": 0.0}  # level text, no centre mark
_CODES = {"Ø": "%%c", "±": "%%p"}  # codes of DXF, which every viewer shows in any font

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
        """Return the four corners counter-clockwise, starting at the lower left [mm]."""
        left, bottom, right, top = self
        return (left, bottom), (right, bottom), (right, top), (left, top)


class DimensionText(NamedTuple):
    """The text of a dimension: its middle [mm], its label, and its rotation [deg]."""

    at: Point
    label: str = MEASURED
    rotation: float = 0.0


class CalloutText(NamedTuple):
    """The text of a radius or a diameter: its label, and the side of a point [mm] on which it stands with a gap."""

    beside: Point
    side: Literal["left", "right"]
    label: str = MEASURED


def text_width(text: str, height: float) -> float:
    """Return the width of a line of text with this height [mm]."""
    return LETTER * height * len(text)


def length_text(length: float, decimals: int = DECIMALS) -> str:
    """Return a length [mm] as text without trailing zeros."""
    return f"{length:.{decimals}f}".rstrip("0").rstrip(".")


class Canvas:
    """A drawing in millimetres of the part, for a sheet at a scale.

    The scale is a length on paper over the same length of the part [1]. Texts have one height on paper at every scale.
    """

    def __init__(self, scale: float, decimals: int = DECIMALS) -> None:
        """Start an empty drawing at a scale; `decimals` applies to lengths that have only the general tolerance."""
        self.scale = scale
        self.decimals = decimals
        self.text_height = TEXT_MM / scale
        self.document = _new_document(self.text_height)
        self.space: BaseLayout = self.document.modelspace()

    def paper(self, corner: Point) -> "Canvas":
        """Return a canvas in millimetres of the paper with its origin at the lower left corner of the sheet.

        It draws into a block of the same document. The block is inserted at `corner` [mm of the part].
        """
        paper = copy.copy(self)
        paper.scale = 1.0
        paper.text_height = TEXT_MM
        paper.space = self.document.blocks.new("SHEET")
        self.space.add_blockref("SHEET", corner, dxfattribs={"xscale": 1.0 / self.scale, "yscale": 1.0 / self.scale})
        return paper

    def count(self) -> int:
        """Return the number of entities drawn until now; `extents` takes it to measure later ones."""
        return len(self.space)

    def extents(self, after: int = 0) -> Box:
        """Return the box around all entities except the first `after` ones [mm]."""
        corners = bbox.extents(list(self.space)[after:], fast=True)
        return Box(corners.extmin.x, corners.extmin.y, corners.extmax.x, corners.extmax.y)

    def label_width(self, label: str, length: float) -> float:
        """Return the width of the text of a dimension with this label and measured length [mm]."""
        number = length_text(length, self._decimals(label, length))
        return text_width(label.replace(MEASURED, number), self.text_height)

    def _decimals(self, label: str, length: float) -> int:
        """Return the decimals of a length [mm], which are fewer if it has only the general tolerance."""
        return self.decimals if IN_TABLE not in label and length >= SMALL_MM else DECIMALS

    def line(self, start: Point, end: Point, layer: str = "PART") -> None:
        """Draw a straight line, which is dash-dotted on the layer AXES."""
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
        """Draw the two centre lines of a hole that is seen along its axis [mm]."""
        x, z = centre
        self.centre_line((x - radius, z), (x + radius, z))
        self.centre_line((x, z - radius), (x, z + radius))

    def centre_line(self, start: Point, end: Point) -> None:
        """Draw a centre line, extended beyond both ends by 2 mm on paper."""
        share = 2.0 / (self.scale * math.dist(start, end))
        reach = (share * (end[0] - start[0]), share * (end[1] - start[1]))
        self.line((start[0] - reach[0], start[1] - reach[1]), (end[0] + reach[0], end[1] + reach[1]), "AXES")

    def hatch(self, outlines: Sequence[Sequence[Point]]) -> None:
        """Hatch the area inside the first closed outline [mm] and outside the others, around texts in it.

        The lines of ezdxf's pattern are drawn as plain lines in the order of their coordinates. So every viewer shows
        the same hatch, and equal drawings have equal bytes.
        """
        hatch = self.space.add_hatch()
        across = HATCH_STEP_MM / (self.scale * math.sqrt(2.0))  # step from one line to the next along x and along z
        off_corners = (_OFF_CORNERS_MM / self.scale, 0.0)  # ezdxf itself would take a random offset
        hatch.set_pattern_fill("CUT", definition=[[45.0, off_corners, (-across, across), []]])
        for outline in (*outlines, *self._around_texts(outlines)):
            hatch.paths.add_polyline_path(outline, is_closed=True)
        lines = sorted((start.x, start.y, end.x, end.y) for start, end in hatch_entity(hatch, jiggle_origin=False))
        self.space.delete_entity(hatch)
        for x, z, end_x, end_z in lines:
            self.line((x, z), (end_x, end_z), "HATCH")

    def _around_texts(self, outlines: Sequence[Sequence[Point]]) -> list[Sequence[Point]]:
        """Return rectangles that a hatch leaves empty: around each text inside the first outline, outside the others.

        The margin around a text is half of its height.
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
        """Return every text with its box [mm]: plain texts, texts in the block of the sheet, texts of dimensions."""
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
        """Draw straight lines from each point to the next one [mm]."""
        for start, end in itertools.pairwise(points):
            self.line(start, end, layer)

    def arc(self, centre: Point, radius: float, start: float, end: float, layer: str = "PART") -> None:
        """Draw an arc, counter-clockwise from one angle to another [deg]."""
        self.space.add_arc(centre, radius, start, end, dxfattribs={"layer": layer})

    def words(
        self, text: str, at: Point, height: float, layer: str = "DIMENSIONS", *, from_the_left: bool = False
    ) -> None:
        """Write a line of text with this height [mm of the part]; `at` is its middle, or its left end on request."""
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
        """Draw the dimension of the length between two points [mm] along an axis.

        `level` [mm] is the position of its dimension line: z of a line along x, or x of a line along z.
        """
        along = 0 if axis == "x" else 1
        start, end = sorted((start, end), key=lambda point: point[along])  # ezdxf reverses the arrows of other orders
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
        """Extend a dimension line to the far end of a text that stands beyond the `ends` of the line [mm].

        A level text beside an upright line is underlined, and the line bends to it. Nothing is drawn for a text between
        the ends. `half_width` [mm] belongs to the text.
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
        """Draw the dimension of a radius or a diameter with this size [mm] and a leader to its text.

        The arrow of a radius meets the arc at the angle [deg]. The arrow of a diameter meets the circle on the side of
        its text.
        """
        gap = 2.0 * self.text_height  # room for the arrow of the leader, chosen by eye
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
        else:  # ezdxf places the arrow of a diameter itself
            dimension = self.space.add_diameter_dim(centre, radius=0.5 * size, location=leader_end, **look)
        dimension.render()

    def dxf(self) -> str:
        """Return the drawing as DXF R2010; equal drawings give equal texts."""
        for kind in sorted(self.document.entitydb.dxf_types_in_use()):
            self.document.classes.add_class(kind)  # otherwise ezdxf adds them in the order of a set, which varies
        text = io.StringIO()
        self.document.write(text)
        return text.getvalue()

    def write_svg(self, path: Path, window: Box) -> None:
        """Write a window of the drawing [mm] as an SVG that prints at its scale; raises OSError."""
        backend = SVGBackend()
        self._play(backend)
        page = layout.Page(*self._size_on_paper(window))
        settings = layout.Settings(fit_page=False, scale=self.scale)
        paper = BoundingBox2d([(window.left, window.bottom), (window.right, window.top)])
        path.write_text(backend.get_string(page, settings=settings, render_box=paper), encoding="utf-8")

    def write_pdf(self, path: Path, window: Box) -> None:
        """Write a window of the drawing [mm] as a PDF that prints at its scale; raises OSError."""
        page = PdfPage((window.left, window.bottom), self.scale)
        self._play(page)
        path.write_bytes(page.file(*self._size_on_paper(window)))

    def _play(self, recorder: Recorder) -> None:
        """Draw the document, black on white, on a recorder of ezdxf such as an SVG or a PDF page."""
        look = Configuration(background_policy=BackgroundPolicy.WHITE, color_policy=ColorPolicy.BLACK)
        Frontend(RenderContext(self.document), recorder, config=look).draw_layout(self.document.modelspace())

    def _size_on_paper(self, window: Box) -> tuple[float, float]:
        return self.scale * (window.right - window.left), self.scale * (window.top - window.bottom)


class _Radius(RadiusDimension):
    """A radius whose arrow points from its text to the arc.

    ezdxf reverses the arrow of every text outside the circle, even if the text is on the side of the centre.
    """

    def is_location_outside(self, location: Vec2) -> bool:
        """Return whether text and centre are on opposite sides of the arc."""
        return bool((location - self.point_on_circle).dot(self.dim_line_vec) > 0.0)


class _Renderer(DimensionRenderer):
    """The renderer of dimensions, with our arrows of radii."""

    def radius(self, dimension: Dimension, ucs: UCS | None = None, override: DimStyleOverride | None = None) -> _Radius:
        """Return the renderer of one radius."""
        return _Radius(dimension, ucs, override)


def _new_document(text_height: float) -> Drawing:
    """Return an empty document with our layers and our style of dimensions.

    `text_height` [mm of the part] is the height of dimension texts. AutoCAD's DXF reference explains the variables of
    the style, such as `dimtxt`, in its group DIMSTYLE.
    """
    document = new("R2010", setup=["linetypes"])
    document.units = units.MM
    document.dimension_renderer = _Renderer()
    for layer, colour in LAYERS.items():
        document.layers.add(layer, color=colour, lineweight=PENS[layer])
    document.styles.add(_FONT, font="DejaVuSansMono.ttf")
    style = document.dimstyles.add(_STYLE)
    sizes = {"dimtxt": 1.0, "dimasz": 0.8, "dimexo": 0.4, "dimexe": 0.4, "dimgap": 0.3}  # in text heights
    for name, heights in sizes.items():
        style.dxf.set(name, heights * text_height)
    for name in ("dimclrd", "dimclre", "dimclrt"):  # colours of dimension lines, extension lines and texts
        style.dxf.set(name, _BY_LAYER)
    # No trailing zeros; the text stands above the line, is turned with it, and moves out if it does not fit.
    for name, number in {"dimdec": DECIMALS, "dimzin": 8, "dimtad": 1, "dimtih": 0, "dimtoh": 0, "dimtix": 0}.items():
        style.dxf.set(name, number)
    style.dxf.set("dimdsep", ord("."))
    style.dxf.set("dimtxsty", _FONT)
    return document


def _is_inside(point: Point, outline: Sequence[Point]) -> bool:
    """Return whether a point [mm] lies strictly inside a closed outline."""
    return bool(is_point_in_polygon_2d(Vec2(point), Vec2.list(outline)) > 0)


def _box_of(text: MText) -> Box:
    """Return the box around the text of a dimension [mm], either level or upright."""
    along = 0.5 * text_width(str(text.plain_text()), text.dxf.char_height)
    across = 0.5 * text.dxf.char_height
    is_upright = abs(text.get_rotation()) > _UPRIGHT_DEG
    half_width, half_height = (across, along) if is_upright else (along, across)
    x, z = text.dxf.insert.x, text.dxf.insert.y
    return Box(x - half_width, z - half_height, x + half_width, z + half_height)


def _coded(text: str) -> str:
    """Return a text in which the diameter and plus-minus signs are replaced by their DXF codes."""
    for letter, code in _CODES.items():
        text = text.replace(letter, code)
    return text
