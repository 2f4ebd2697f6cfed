"""The contribution of a rigid tip's face to the initial gap between tip and fruit [mm].

The contribution of the fruit's shape is added in `scene.py`.
"""

import numpy as np

from sensor.arrays import Floats
from sensor.tips.tip_shape import Arc, TipShape


def tip_gap(shape: TipShape, x: Floats, y: Floats) -> Floats:
    """Return the height [mm] of a tip's face above its lowest point; it is infinite outside the face.

    The points x (along the tips) and y (across) [mm] are relative to the centre of the tip. The height depends on one
    coordinate r of the meridian, which consists of arcs and straight pieces. On a round tip, r is the distance from the
    axis. On a square tip, it is the larger of |x| and |y|.
    """
    meridian_coordinate = np.hypot(x, y) if shape.is_round else np.maximum(np.abs(x), np.abs(y))
    r = np.asarray(meridian_coordinate)
    gap = np.full_like(r, np.inf)
    for piece in shape.meridian:
        on_piece = (r >= piece.start.r) & (r <= piece.end.r)
        if isinstance(piece, Arc):
            from_centre = r[on_piece] - piece.centre_r
            # The circle of an arc touches z = 0. The maximum removes round-off at the ends of a quarter circle.
            gap[on_piece] = piece.radius - np.sqrt(np.maximum(piece.radius**2 - from_centre**2, 0.0))
        else:
            slope = (piece.end.z - piece.start.z) / (piece.end.r - piece.start.r)
            gap[on_piece] = piece.start.z + slope * (r[on_piece] - piece.start.r)
    return gap
