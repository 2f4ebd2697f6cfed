"""The tool that compresses a body: a plate, or the end of a plunger."""

import math
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats

_STEEPEST = 0.1  # smallest squared cosine of the slope of a ball's face; steeper parts do not touch the body


@dataclass(frozen=True, kw_only=True)
class Tool:
    """A rigid tool on the axis of the body: a plate, or a plunger whose radius is `edge` [mm].

    Its face is flat, or spherical with a `curvature` [1/mm].
    """

    curvature: float = 0.0
    edge: float = math.inf

    def face(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the height of the face above its lowest point [mm] at radii r [mm], and its first two derivatives.

        The derivatives are the slope [1] and its rate of change [1/mm].
        """
        cosine = np.sqrt(np.maximum(1.0 - (self.curvature * r) ** 2, _STEEPEST))
        rise = self.curvature * r**2 / (1.0 + cosine)
        return rise, self.curvature * r / cosine, self.curvature / cosine**3
