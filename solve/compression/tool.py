"""The tool that presses a body: a plate, or the end of a plunger."""

import math
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats

_STEEPEST = 0.1  # least squared cosine of the slope of a ball's face; a steeper part does not touch


@dataclass(frozen=True, kw_only=True)
class Tool:
    """A rigid tool on the axis of the body: a plate, or a plunger with its `edge` at a radius [mm].

    Its face is flat, or a ball with a `curvature` [1/mm].
    """

    curvature: float = 0.0
    edge: float = math.inf

    def face(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the distance of the face behind its tip at r [mm], its slope [1] and the slope's derivative [1/mm]."""
        cosine = np.sqrt(np.maximum(1.0 - (self.curvature * r) ** 2, _STEEPEST))
        rise = self.curvature * r**2 / (1.0 + cosine)
        return rise, self.curvature * r / cosine, self.curvature / cosine**3
