"""The drawing of a pin that is a tip: how it stands on the fruit, its end from above, and every dimension once [mm]."""

import math

import cadquery as cq

from cad.drawing.canvas import MEASURED, Box, Canvas
from cad.drawing.lengths import Length, draw_lengths
from cad.drawing.sheet import BETWEEN_MM, Sheet, Title, on_sheet
from cad.drawing.view import draw_view, views_of
from cad.tips.tip_shape import Arc, TipShape

FIT = "h8"  # 0 to -14 um up to 3 mm, -18 um up to 6 mm, ISO 286-2: stiffness of the contact goes with it, to 1.4 %
_REACH_MM = 3.0  # on paper, of an axis beyond the part


def pin_drawing(pin: cq.Shape, shape: TipShape, length: float, count: int, title: Title) -> Sheet:
    """Return the sheet of a pin of a length that stands upright on z = 0 [mm], of which so many are made."""
    (front,) = views_of([pin], "front")
    (above,) = views_of([pin], "above")
    half = 0.5 * shape.side_mm
    edges = "Edges of the lower face sharp, not broken." if shape.is_flat else "Lower end as drawn, polished."
    notes = [
        "Millimetres. View of the pin as it stands on the fruit, and its upper end.",
        f"MAKE {count}. {edges}",
    ]
    if shape.flank_deg:
        notes.append(f"Cone of {180.0 - 2.0 * shape.flank_deg:g} degrees.")

    def draw_views(canvas: Canvas) -> None:
        draw_view(canvas, front)
        reach = _REACH_MM / canvas.scale
        canvas.line((0.0, -reach), (0.0, length + reach), "AXES")
        lengths = [Length("left", (-half, 0.0), (-half, length))]
        for piece in shape.meridian:
            if isinstance(piece, Arc):
                middle = 0.5 * (piece.start.r + piece.end.r)
                angle = 270.0 + math.degrees(math.asin((middle - piece.centre_r) / piece.radius))
                centre = (piece.centre_r, piece.radius)
                canvas.callout("radius", centre, piece.radius, (half, -3.0 * canvas.text_height), "right", angle=angle)
            elif piece.end.z > piece.start.z:
                lengths.append(Length("right", (0.0, 0.0), (piece.end.r, piece.end.z)))
        draw_lengths(canvas, lengths, Box(-half, 0.0, half, length))
        level = canvas.extents().bottom - BETWEEN_MM / canvas.scale - half
        draw_view(canvas, above, (0.0, level))
        canvas.centre_mark((0.0, level), half)
        label = f"Ø{MEASURED} {FIT}" if shape.is_round else f"{MEASURED} {FIT}"
        end = [Length("bottom", (-half, level), (half, level), label)]
        if not shape.is_round:
            end.append(Length("right", (half, level - half), (half, level + half), label))
        draw_lengths(canvas, end, Box(-half, level - half, half, level + half))

    return on_sheet(draw_views, notes, title)
