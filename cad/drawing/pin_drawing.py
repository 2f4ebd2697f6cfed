"""The drawing of a pin that is a tip: from its side, and every dimension once [mm]."""

import math

import cadquery as cq

from cad.drawing.canvas import MEASURED, Box, Canvas
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.sheet import Sheet, Title, on_sheet
from cad.drawing.view import draw_view, views_of
from cad.tips.tip_shape import Arc, TipShape

FIT = "h8"  # 0 to -14 um up to 3 mm, -18 um up to 6 mm, ISO 286-2: stiffness of the contact goes with it, to 1.4 %
_REACH_MM = 3.0  # on paper, of an axis beyond the part


def pin_drawing(pin: cq.Shape, shape: TipShape, length: float, count: int, title: Title) -> Sheet:
    """Return the sheet of a pin of a length that stands upright on z = 0 [mm], of which so many are made.

    It lies there as it is turned or ground, the end that meets the fruit on the left.
    """
    lying = pin.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(0.0, 1.0, 0.0), 90.0)
    (front,) = views_of([lying], "front")
    half = 0.5 * shape.side_mm
    edges = "Edges of the left face sharp, not broken." if shape.is_flat else "Left end as drawn, polished."
    notes = ["Millimetres. The left end stands on the fruit.", f"MAKE {count}. {edges}"]
    if shape.flank_deg:
        notes.append(f"Cone of {180.0 - 2.0 * shape.flank_deg:g} degrees.")

    def draw_views(canvas: Canvas) -> None:
        draw_view(canvas, front)
        reach = _REACH_MM / canvas.scale
        canvas.line((-reach, 0.0), (length + reach, 0.0), "AXES")
        sign = "Ø" if shape.is_round else "□"
        lengths = [
            Length("bottom", (0.0, -half), (length, -half)),
            Length("right", (length, -half), (length, half), f"{sign}{MEASURED} {FIT}"),
        ]
        for piece in shape.meridian:
            if isinstance(piece, Arc):
                middle = 0.5 * (piece.start.r + piece.end.r)
                angle = 180.0 - math.degrees(math.asin((middle - piece.centre_r) / piece.radius))
                centre = (piece.radius, piece.centre_r)
                canvas.callout("radius", centre, piece.radius, (0.0, piece.end.r), "left", angle=angle)
            elif piece.end.z > piece.start.z:
                lengths.append(Length("top", (0.0, 0.0), (piece.end.z, piece.end.r)))
        draw_lengths(canvas, lengths, Box(0.0, -half, length, half))

    return on_sheet(draw_views, notes, title)
