"""The rows of sensor/theory/large_strain.toml: a sharp square tip, counted as the circle of its area."""

import math

import numpy as np

from reference.flat_punch.force_curve import force_curve
from reference.flat_punch.tip_profile import RoundTip
from sensor.theory.soft_tissue import FleshLawName
from solve.compression.flesh_law import FleshLaw

RADIUS = 1.0 / math.sqrt(math.pi)
"""Of the circle with the area of a square tip [tip sides]."""
DEPTHS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
"""Of the table [tip sides]."""


def table_row(law: FleshLawName, poisson: float) -> tuple[list[float], list[float]]:
    """Return the factors [1] and their errors [1] at the depths of the table that the curve reaches."""
    curve = force_curve(RoundTip(radius=RADIUS), FleshLaw(name=law, poisson=poisson), DEPTHS[-1])
    depths = np.array([depth for depth in DEPTHS if depth <= curve.reached])
    return curve.factor(depths).tolist(), curve.error(depths).tolist()
