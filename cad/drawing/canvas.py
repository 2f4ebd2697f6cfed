"""A drawing as a DXF document, at the true size of the part [mm]: lines, arcs, texts and measured dimensions."""

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
from ezdxf.entities.dxfentity import DXFEntity
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
}  # AutoCAD colour index of each layer
THICK = 50  # width of visible and cut edges [0.01 mm on paper]; thin lines are half as wide, ISO 128-20
PENS = dict.fromkeys(LAYERS, THICK // 2) | {"PART": THICK, "SHEET": 35}  # line widths [0.01 mm on paper]
TEXT_MM = 2.5  # height of a capital letter on paper, ISO 3098
DECIMALS = 2  # number of decimals of a length with its own tolerance; no tolerance is finer than 0.01 mm
LETTER = 0.83  # width of a monospaced letter divided by the height of a capital: DejaVu Sans Mono, 0.602 / 0.729
SMALL_MM = 0.5  # shortest length with a general tolerance in ISO 2768-1; a shorter one needs its own tolerance
HATCH_STEP_MM = 2.0  # distance between hatch lines on paper, ISO 128-50
MEASURED = "<>"
"""The DXF placeholder for the measured length in the text of a dimension."""
IN_TABLE = ")"
"""The character after the letter of a dimension whose tolerance is given in the measuring table."""
_DASHES = {"AXES": ("CENTER", 4.0)}  # for each layer with dashed lines, ezdxf's pattern and its length on paper [mm]
_FONT = "MONOSPACED"
_STYLE = "WORKSHOP"
_BY_LAYER = 256  # DXF colour index with which an entity takes the colour of its layer
_OFF_CORNERS_MM = 0.00271  # shift of the hatch on paper; not a round number, so that hatch lines miss all corners
_VERTICAL_DEG = 45.0  # a text rotated by more than this is vertical; texts are rotated by either 0 or 90 degrees
LINE_TO_TEXT = 0.8  # distance from a dimension line to the middle of its text, in text heights
_LEADER = {"dimtmove": 1, "dimtih": 1, "dimtoh": 1, "dimtofl": 0, "dimcen": 0.0}  # horizontal text, no centre mark
_CODES = {"Ø": "%%c", "±": "%%p"}  # DXF control codes, which every viewer can show in any font

options.write_fixed_meta_data_for_testing = True  # prevents ezdxf from writing the time and a random identifier

Point = tuple[float, float]
"""A point (x, z) of the drawing [mm]; x is to the right, and z is up."""


class Box(NamedTuple):
    """A rectangle with horizontal and vertical sides [mm]."""

    left: float
    bottom: float
    right: float
    top: float

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Return the four corners [mm], counter-clockwise from the lower left."""
        left, bottom, right, top = self
        return (left, bottom), (right, bottom), (right, top), (left, top)


class DimensionText(NamedTuple):
    """The text of a dimension: its centre [mm], its label, and its rotation [deg]."""

    at: Point
    label: str = MEASURED
    rotation: float = 0.0


class CalloutText(NamedTuple):
    """The text of a radius or a diameter: a point [mm], the side of the point on which it is written, and the label."""

    beside: Point
    side: Literal["left", "right"]
    label: str = MEASURED


def text_width(text: str, height: float) -> float:
    """Return the width [mm] of a line of text whose capital letters have this height [mm]."""
    return LETTER * height * len(text)


def length_text(length: float, decimals: int = DECIMALS) -> str:
    """Return a length [mm] as text without trailing zeros."""
    return f"{length:.{decimals}f}".rstrip("0").rstrip(".")


class Canvas:
    """A drawing at the true size of the part [mm], to be printed at a scale.

    The scale [1] is the ratio of a length on paper to the length on the part. The height of texts on paper does not
    depend on the scale.
    """

    def __init__(self, scale: float, decimals: int = DECIMALS) -> None:
        """Create an empty drawing.

        `decimals` is the number of decimals of a length to which only the general tolerance applies.
        """
        self.scale = scale
        self.decimals = decimals
        self.text_height = TEXT_MM / scale
        self.document = _new_document(self.text_height)
        self.space: BaseLayout = self.document.modelspace()

    def add_paper_canvas(self, corner: Point) -> "Canvas":
        """Add a block for the sheet to the document, and return a canvas that draws into this block.

        The canvas has the unit millimetres on paper, and its origin is the lower left corner of the sheet. The block is
        inserted at `corner` [mm on the part], and is reduced or enlarged to the scale of the part.
        """
        paper = copy.copy(self)
        paper.scale = 1.0
        paper.text_height = TEXT_MM
        paper.space = self.document.blocks.new("SHEET")
        self.space.add_blockref("SHEET", corner, dxfattribs={"xscale": 1.0 / self.scale, "yscale": 1.0 / self.scale})
        return paper

    def entity_count(self) -> int:
        """Return the current number of entities, which can be passed to `extents` as `after`."""
        return len(self.space)

    def extents(self, after: int = 0) -> Box:
        """Return the bounding box [mm] of the entities that were drawn after the first `after` entities."""
        corners = bbox.extents(list(self.space)[after:], fast=True)
        return Box(corners.extmin.x, corners.extmin.y, corners.extmax.x, corners.extmax.y)

    def label_width(self, label: str, length: float) -> float:
        """Return the width [mm] of the text of a dimension with this label, which measures `length` [mm]."""
        number = length_text(length, self._decimals(label, length))
        return text_width(label.replace(MEASURED, number), self.text_height)

    def _decimals(self, label: str, length: float) -> int:
        """Return the number of decimals of a length [mm], which depends on whether the general tolerance applies."""
        return self.decimals if IN_TABLE not in label and length >= SMALL_MM else DECIMALS

    def line(self, start: Point, end: Point, layer: str = "PART") -> None:
        """Draw a straight line; on the layer AXES it is dash-dotted."""
        self.space.add_line(start, end, dxfattribs=self._line_attributes(layer))

    def _line_attributes(self, layer: str) -> dict[str, Any]:
        """Return the DXF attributes of a line on a layer, including the dash pattern of the layer."""
        if layer not in _DASHES:
            return {"layer": layer}
        pattern, length = _DASHES[layer]
        return {"layer": layer, "linetype": pattern, "ltscale": length / self.scale}

    def rectangle(self, box: Box, layer: str = "PART") -> None:
        """Draw the outline of a box [mm]."""
        self.polyline((*box.corners, box.corners[0]), layer)

    def circle(self, centre: Point, radius: float, layer: str = "PART") -> None:
        """Draw a circle with the given centre and radius [mm]."""
        self.space.add_circle(centre, radius, dxfattribs=self._line_attributes(layer))

    def centre_mark(self, centre: Point, radius: float) -> None:
        """Draw the two centre lines of a hole seen along its axis, given its centre and radius [mm]."""
        x, z = centre
        self.centre_line((x - radius, z), (x + radius, z))
        self.centre_line((x, z - radius), (x, z + radius))

    def centre_line(self, start: Point, end: Point) -> None:
        """Draw a centre line that extends 2 mm on paper beyond both ends."""
        relative_extension = 2.0 / (self.scale * math.dist(start, end))  # as a fraction of the distance of the ends
        extension_x, extension_z = (relative_extension * (end[axis] - start[axis]) for axis in (0, 1))
        extended_start = (start[0] - extension_x, start[1] - extension_z)
        extended_end = (end[0] + extension_x, end[1] + extension_z)
        self.line(extended_start, extended_end, "AXES")

    def hatch(self, outlines: Sequence[Sequence[Point]]) -> None:
        """Hatch an area, except where texts are written on it.

        The area lies inside the first of the closed outlines [mm] and outside the other outlines, which are its holes.
        ezdxf computes the hatch lines, which are then drawn as plain lines in the order of their coordinates. So every
        viewer shows the same hatch, and identical drawings have identical bytes.
        """
        hatch = self.space.add_hatch()
        step = HATCH_STEP_MM / (self.scale * math.sqrt(2.0))  # offset of the next line along x and along z
        off_corners = (_OFF_CORNERS_MM / self.scale, 0.0)  # replaces the random offset of ezdxf
        # The pattern is one family of lines at 45 degrees: angle, start, offset of the next line, and no dashes.
        hatch.set_pattern_fill("CUT", definition=[[45.0, off_corners, (-step, step), []]])
        for outline in (*outlines, *self._text_frames(outlines)):
            hatch.paths.add_polyline_path(outline, is_closed=True)
        lines = sorted((start.x, start.y, end.x, end.y) for start, end in hatch_entity(hatch, jiggle_origin=False))
        self.space.delete_entity(hatch)
        for x, z, end_x, end_z in lines:
            self.line((x, z), (end_x, end_z), "HATCH")

    def _text_frames(self, outlines: Sequence[Sequence[Point]]) -> list[Sequence[Point]]:
        """Return the frames [mm] of the texts within a hatch. The hatch must leave these frames blank.

        The texts lie inside the first of the `outlines` [mm] and outside the others, which are holes. A frame extends
        beyond its text by half of the text height on each side. A text inside an earlier frame is skipped.
        """
        outer, *holes = outlines
        margin = 0.5 * self.text_height
        frames: list[Sequence[Point]] = []
        for _, (left, bottom, right, top) in self.find_texts():
            corners = Box(left - margin, bottom - margin, right + margin, top + margin).corners
            # One corner is enough for this test, on the assumption that no text crosses the outline of a hole.
            is_in_hole = any(_is_inside(corners[0], hole) for hole in (*holes, *frames))
            if not is_in_hole and all(_is_inside(corner, outer) for corner in corners):
                frames.append(corners)
        return frames

    def dimensions(self) -> list[Dimension]:
        """Return all dimensions of the drawing, in the order in which they were drawn."""
        return [cast(Dimension, entity) for entity in self.space.query("DIMENSION")]

    def find_texts(self) -> list[tuple[str, Box]]:
        """Return every text of the drawing and its bounding box [mm].

        The list includes plain texts, texts in the block of the sheet, and texts of dimensions.
        """
        texts = []
        # The entities of a block have block coordinates. The virtual entities of a block are copies in drawing
        # coordinates. The virtual entities of a dimension are the lines and texts by which it is drawn.
        sheet_entities: list[DXFEntity] = []
        for sheet in self.space.query("INSERT"):
            sheet_entities += cast(Insert, sheet).virtual_entities()
        for entity in (*self.space, *sheet_entities):
            if isinstance(entity, Text) and entity.plain_text():
                extents = bbox.extents([entity])
                box = Box(extents.extmin.x, extents.extmin.y, extents.extmax.x, extents.extmax.y)
                texts.append((entity.plain_text(), box))
            if isinstance(entity, Dimension):
                dimension_texts = [text for text in entity.virtual_entities() if isinstance(text, MText)]
                texts += [(str(text.plain_text()), _box_of(text)) for text in dimension_texts]
        return texts

    def polyline(self, points: Sequence[Point], layer: str = "PART") -> None:
        """Draw a straight line from each point [mm] to the next one."""
        for start, end in itertools.pairwise(points):
            self.line(start, end, layer)

    def arc(self, centre: Point, radius: float, start: float, end: float, layer: str = "PART") -> None:
        """Draw an arc, counter-clockwise from the angle `start` to the angle `end` [deg]."""
        self.space.add_arc(centre, radius, start, end, dxfattribs={"layer": layer})

    def write_text(
        self, text: str, at: Point, height: float, layer: str = "DIMENSIONS", *, left_aligned: bool = False
    ) -> None:
        """Write a line of text whose capital letters have this height [mm on the part].

        `at` [mm] is the centre of the text, or the middle of its left end if `left_aligned` is true.
        """
        entity = self.space.add_text(_encode_signs(text), height=height, dxfattribs={"layer": layer, "style": _FONT})
        align = TextEntityAlignment.MIDDLE_LEFT if left_aligned else TextEntityAlignment.MIDDLE_CENTER
        entity.set_placement(at, align=align)

    def add_linear_dimension(
        self,
        axis: Literal["x", "z"],
        start: Point,
        end: Point,
        line_position: float,
        text: DimensionText,
    ) -> None:
        """Draw a linear dimension: the distance between two points [mm] along an axis.

        `line_position` [mm] is the z of the dimension line for the axis x, or its x for the axis z. `text` gives the
        label and its place. If the text is beyond the ends of the line, the line is extended to it.
        """
        # `along` is the index of the measured coordinate of a point (x, z). `angle` [deg] is the direction of the line.
        if axis == "x":
            along, angle, point_on_line = 0, 0.0, (text.at[0], line_position)
        else:
            along, angle, point_on_line = 1, 90.0, (line_position, text.at[1])
        # If the points are not in ascending order, ezdxf reverses the arrows.
        low, high = sorted((start, end), key=lambda point: point[along])
        distance = high[along] - low[along]
        dimension = self.space.add_linear_dim(
            base=point_on_line,
            p1=low,
            p2=high,
            location=text.at,
            text=_encode_signs(text.label),
            angle=angle,
            text_rotation=text.rotation,
            dimstyle=_STYLE,
            override={"dimdec": self._decimals(text.label, distance)},  # the number of decimals
            dxfattribs={"layer": "DIMENSIONS"},
        )
        dimension.render()
        half_width = 0.5 * self.label_width(text.label, distance)
        self._lead_to_text(axis, (low[along], high[along]), line_position, text, half_width)

    def _lead_to_text(
        self,
        axis: Literal["x", "z"],
        ends: tuple[float, float],
        line_position: float,
        text: DimensionText,
        half_width: float,
    ) -> None:
        """Extend a dimension line to the far end of its text, unless the text is between the ends of the line.

        `ends` are the coordinates of the two ends along the axis [mm]. `line_position` [mm] is the z of the line for
        the axis x, or its x for the axis z. `half_width` [mm] is half the width of the text. If a horizontal text is
        beside a vertical line, the line is extended to the bottom of the text, bends there, and underlines the text.
        """
        low, high = ends
        text_x, text_z = text.at
        middle = text_x if axis == "x" else text_z
        if low < middle < high:
            return
        # The line is extended from the end that is nearer to the text, in the direction of the text.
        direction = 1.0 if middle > high else -1.0
        end = high if direction > 0.0 else low
        far_end = middle + direction * half_width  # the far end of a text that runs along the line
        if axis == "x":
            self.line((end, line_position), (far_end, line_position), "DIMENSIONS")
        elif text.rotation:
            self.line((line_position, end), (line_position, far_end), "DIMENSIONS")
        else:
            under_text = text_z - LINE_TO_TEXT * self.text_height
            self.line((line_position, end), (line_position, under_text), "DIMENSIONS")
            to_far_end = math.copysign(half_width, text_x - line_position)
            self.line((line_position, under_text), (text_x + to_far_end, under_text), "DIMENSIONS")

    def add_callout(
        self,
        dimension_type: Literal["radius", "diameter"],
        centre: Point,
        size: float,
        text: CalloutText,
        angle: float = 0.0,
    ) -> None:
        """Draw the dimension of a radius or a diameter, with a leader to its text.

        `size` [mm] is the radius or the diameter, and `centre` [mm] is the centre of the circle. `text` gives the label
        and its place. The arrow of a radius meets the arc at `angle` [deg], counter-clockwise from the x axis. The
        arrow of a diameter meets the circle on the side of the text.
        """
        gap = 2.0 * self.text_height  # space for the arrow of the leader, chosen by eye
        x, z = text.beside
        to_text = gap if text.side == "right" else -gap
        leader_end = (x + to_text, z)
        attributes: dict[str, Any] = {
            "text": _encode_signs(text.label),
            "dimstyle": _STYLE,
            "override": _LEADER,
            "dxfattribs": {"layer": "DIMENSIONS"},
        }
        if dimension_type == "radius":
            dimension = self.space.add_radius_dim(centre, radius=size, angle=angle, **attributes)
            dimension.set_location(leader_end, leader=True)
        else:  # ezdxf determines where the arrow of a diameter meets the circle
            dimension = self.space.add_diameter_dim(centre, radius=0.5 * size, location=leader_end, **attributes)
        dimension.render()

    def dxf(self) -> str:
        """Return the drawing as the text of a DXF R2010 file. Identical drawings give identical texts."""
        # Otherwise ezdxf adds the classes in the order of a set, which varies from run to run.
        for entity_type in sorted(self.document.entitydb.dxf_types_in_use()):
            self.document.classes.add_class(entity_type)
        text = io.StringIO()
        self.document.write(text)
        return text.getvalue()

    def write_svg(self, path: Path, window: Box) -> None:
        """Write a window of the drawing [mm] to an SVG file that prints at the scale of the drawing.

        Raises OSError if the file cannot be written.
        """
        backend = SVGBackend()
        self._draw_on(backend)
        page = layout.Page(*self._size_on_paper(window))
        settings = layout.Settings(fit_page=False, scale=self.scale)
        paper = BoundingBox2d([(window.left, window.bottom), (window.right, window.top)])
        path.write_text(backend.get_string(page, settings=settings, render_box=paper), encoding="utf-8")

    def write_pdf(self, path: Path, window: Box) -> None:
        """Write a window of the drawing [mm] to a PDF file that prints at the scale of the drawing.

        Raises OSError if the file cannot be written.
        """
        page = PdfPage((window.left, window.bottom), self.scale)
        self._draw_on(page)
        path.write_bytes(page.file_bytes(*self._size_on_paper(window)))

    def _draw_on(self, recorder: Recorder) -> None:
        """Draw the document in black on white on an ezdxf recorder, such as an SVG backend or a PDF page."""
        config = Configuration(background_policy=BackgroundPolicy.WHITE, color_policy=ColorPolicy.BLACK)
        Frontend(RenderContext(self.document), recorder, config=config).draw_layout(self.document.modelspace())

    def _size_on_paper(self, window: Box) -> tuple[float, float]:
        """Return the width and the height that a window of the drawing has on paper [mm]."""
        return self.scale * (window.right - window.left), self.scale * (window.top - window.bottom)


class _Radius(RadiusDimension):
    """A radius dimension whose arrow always points from its text to the arc.

    If a text is outside the circle, ezdxf reverses the arrow, even if the text is on the side of the centre.
    """

    def is_location_outside(self, location: Vec2) -> bool:
        """Return whether the text and the centre are on opposite sides of the arc."""
        return bool((location - self.point_on_circle).dot(self.dim_line_vec) > 0.0)


class _Renderer(DimensionRenderer):
    """ezdxf's dimension renderer, with `_Radius` for radius dimensions."""

    def radius(self, dimension: Dimension, ucs: UCS | None = None, override: DimStyleOverride | None = None) -> _Radius:
        """Return the renderer of a radius dimension."""
        return _Radius(dimension, ucs, override)


def _new_document(text_height: float) -> Drawing:
    """Return an empty document with the layers and the dimension style of the drawings.

    `text_height` [mm on the part] is the height of dimension texts.
    """
    document = new("R2010", setup=["linetypes"])
    document.units = units.MM
    document.dimension_renderer = _Renderer()
    for layer, colour in LAYERS.items():
        document.layers.add(layer, color=colour, lineweight=PENS[layer])
    document.styles.add(_FONT, font="DejaVuSansMono.ttf")
    _add_dimension_style(document, text_height)
    return document


def _add_dimension_style(document: Drawing, text_height: float) -> None:
    """Add the style of all dimensions to a document.

    The variables of the style, such as `dimtxt`, are defined in the DIMSTYLE section of AutoCAD's DXF reference.
    `text_height` [mm on the part] is the height of dimension texts.
    """
    style = document.dimstyles.add(_STYLE)
    # Sizes in text heights: the text itself, the arrows, the gap and the overhang of extension lines, and the gap
    # around a text. The sizes were chosen by eye.
    sizes = {"dimtxt": 1.0, "dimasz": 0.8, "dimexo": 0.4, "dimexe": 0.4, "dimgap": 0.3}
    for name, heights in sizes.items():
        style.dxf.set(name, heights * text_height)
    for name in ("dimclrd", "dimclre", "dimclrt"):  # colours of dimension lines, extension lines and texts
        style.dxf.set(name, _BY_LAYER)
    # Lengths have no trailing zeros (dimzin). Texts are above the line (dimtad), rotated with it (dimtih, dimtoh), and
    # outside if they do not fit (dimtix).
    switches = {"dimdec": DECIMALS, "dimzin": 8, "dimtad": 1, "dimtih": 0, "dimtoh": 0, "dimtix": 0}
    for name, number in switches.items():
        style.dxf.set(name, number)
    style.dxf.set("dimdsep", ord("."))  # the decimal separator
    style.dxf.set("dimtxsty", _FONT)


def _is_inside(point: Point, outline: Sequence[Point]) -> bool:
    """Return whether a point [mm] lies strictly inside a closed outline."""
    return bool(is_point_in_polygon_2d(Vec2(point), Vec2.list(outline)) > 0)


def _box_of(text: MText) -> Box:
    """Return the bounding box [mm] of the text of a dimension, which is either horizontal or vertical.

    The insertion point of the text is its centre.
    """
    half_length = 0.5 * text_width(str(text.plain_text()), text.dxf.char_height)
    half_text_height = 0.5 * text.dxf.char_height
    is_vertical = abs(text.get_rotation()) > _VERTICAL_DEG
    half_width, half_height = (half_text_height, half_length) if is_vertical else (half_length, half_text_height)
    x, z = text.dxf.insert.x, text.dxf.insert.y
    return Box(x - half_width, z - half_height, x + half_width, z + half_height)


def _encode_signs(text: str) -> str:
    """Return a text with its diameter and plus-minus signs replaced by DXF control codes."""
    for sign, code in _CODES.items():
        text = text.replace(sign, code)
    return text
