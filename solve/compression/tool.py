"""What presses a body: a plate, or the end of a plunger."""

import math
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats

_STEEPEST = 0.1  # least square of the cosine of the slope of a ball's face: beyond, nothing touches


@dataclass(frozen=True, kw_only=True)
class Tool:
    """A rigid tool on the axis of the body: a plate, or a plunger that ends at a radius `edge` [mm].

    Its face is flat, or a ball of a `curvature` [1/mm].
    """

    curvature: float = 0.0
    edge: float = math.inf

    def face(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """Return how far the face lies behind its tip at r [mm], its slope [1] and the growth of that [1/mm]."""
        cosine = np.sqrt(np.maximum(1.0 - (self.curvature * r) ** 2, _STEEPEST))
        rise = self.curvature * r**2 / (1.0 + cosine)
        return rise, self.curvature * r / cosine, self.curvature / cosine**3
