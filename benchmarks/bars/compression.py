"""The force on a ball between plates and its error bar, compared with an independent code."""

import numpy as np

from benchmarks.bars.check import ReferenceCheck, make_checks
from benchmarks.harness import Reference
from sensor.theory.hertz import force_factor
from solve.compression.flesh_law import FleshLaw
from solve.compression.force_curve import CompressionPress, force_curve
from solve.compression.half_body import Section

BALL = Section(half_height=35.0, radius=35.0)
DEPTHS = np.array([0.01, 0.02, 0.05, 0.1])  # travel of one plate, divided by the radius


def ball_press() -> CompressionPress:
    """Return the press of a neo-Hookean ball with Poisson's ratio 0.3 between frictionless plates."""
    deepest = 0.15 * BALL.radius
    contact = (BALL.radius * deepest) ** 0.5  # Hertz's contact radius
    return CompressionPress(section=BALL, law=FleshLaw(poisson=0.3), deepest=deepest, contact=contact, exponent=1.5)


def ball_checks(truth: Reference) -> tuple[ReferenceCheck, ...]:
    """Return a check of the ratio of the force to Hertz's force [1] at each of `DEPTHS`."""
    curve = force_curve(ball_press())
    travels = BALL.radius * DEPTHS
    # Hertz's force for E = 1 MPa; 0.91 is 1 - nu^2.
    ratios = curve.force(travels) / (force_factor(1.0 / 0.91, BALL.radius) * travels**1.5)
    return make_checks([f"F at {depth:g} R" for depth in DEPTHS], ratios, (curve.error,) * len(DEPTHS), truth)
