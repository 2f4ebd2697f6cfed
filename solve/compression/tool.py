"""The tool that compresses a body: a plate, or the end of a plunger."""

import math
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats

# Smallest squared cosine of the slope angle of a spherical face. Steeper parts of the face do not touch the body.
_SMALLEST_COSINE_SQUARED = 0.1


@dataclass(frozen=True, kw_only=True)
class Tool:
    """A rigid tool on the axis of the body: a plate, or a plunger of radius `edge` [mm].

    Its face is flat or, with a `curvature` [1/mm], spherical.
    """

    curvature: float = 0.0
    edge: float = math.inf

    def face(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the height of the face above its lowest point [mm] at radii r [mm], and its first two derivatives.

        The first derivative is the slope [1], the second is in 1/mm.
        """
        cosine = np.sqrt(np.maximum(1.0 - (self.curvature * r) ** 2, _SMALLEST_COSINE_SQUARED))
        rise = self.curvature * r**2 / (1.0 + cosine)
        return rise, self.curvature * r / cosine, self.curvature / cosine**3
