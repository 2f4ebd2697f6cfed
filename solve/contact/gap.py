"""The initial gap under a rigid tip due to the shape of its face, at least 0 [mm].

The gap due to the shape of the fruit is added to it.
"""

import numpy as np

from sensor.arrays import Floats
from sensor.tips.tip_shape import Arc, TipShape


def tip_gap(shape: TipShape, x: Floats, y: Floats) -> Floats:
    """Return the height [mm] of a tip's face above its lowest point; infinity outside the face.

    The points x (along the tips) and y (across) [mm] are relative to the centre of the tip. The tip is a body of
    revolution, or a square whose sections along x and y have the same meridian.
    """
    r = np.asarray(np.hypot(x, y) if shape.is_round else np.maximum(np.abs(x), np.abs(y)))
    gap = np.full_like(r, np.inf)
    for piece in shape.meridian:
        on_piece = (r >= piece.start.r) & (r <= piece.end.r)
        if isinstance(piece, Arc):
            from_centre = r[on_piece] - piece.centre_r
            gap[on_piece] = piece.radius - np.sqrt(np.maximum(piece.radius**2 - from_centre**2, 0.0))
        else:
            slope = (piece.end.z - piece.start.z) / (piece.end.r - piece.start.r)
            gap[on_piece] = piece.start.z + slope * (r[on_piece] - piece.start.r)
    return gap
