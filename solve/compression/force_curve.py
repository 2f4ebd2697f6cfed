"""The force of a pressed body as a smooth function of the travel, from two meshes, with its error."""

import functools
import math
from dataclasses import dataclass, field

import numpy as np

from sensor.arrays import Floats
from solve.compression.body import HalfBody, Section
from solve.compression.flesh_law import FleshLaw
from solve.compression.press import press_forces
from solve.compression.tool import Tool

COARSE = 1.0
FINE = 1.5
_LEAST_TRAVEL = 0.01  # of the deepest: where the first solve is
_SOLVES = 16
# Terms in half powers of the travel: the contact of round bodies grows with its root. As nodes of the surface come
# into contact one by one, forces scatter about their curve; the fit takes the mean.
_TERMS = 5
_COUNTED = 0.1  # of the deepest travel: forces below it are too small to move a modulus


@dataclass(frozen=True, kw_only=True)
class CompressionPress:
    """A tool that presses a body to the `deepest` travel [mm], where the contact has about a radius `contact` [mm].

    At first the force grows as travel^`exponent`. The tool is slippery or, with `grips`, holds what it has touched.
    """

    section: Section
    deepest: float
    contact: float
    exponent: float
    tool: Tool = field(default_factory=Tool)
    law: FleshLaw = field(default_factory=FleshLaw)
    grips: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceCurve:
    """F = E travel^exponent sum_k coefficients_k (travel / deepest)^(k/2) [N of MPa, mm], and its relative `error` [1].

    The travel is that of one tool towards the middle of the body, from the first touch to `deepest` [mm].
    """

    exponent: float
    coefficients: Floats
    deepest: float
    error: float

    def force(self, travel: Floats) -> Floats:
        """Return the force [N at E = 1 MPa] at travels [mm]."""
        root = np.sqrt(travel / self.deepest)
        return np.asarray(travel**self.exponent * np.polynomial.polynomial.polyval(root, self.coefficients))


def force_curve(press: CompressionPress) -> ForceCurve:
    """Return the force curve of a press on a fine mesh, with its error.

    The error is the largest relative difference from a coarser mesh, plus the scatter of the fine one.
    Raises SolveError where no equilibrium is found.
    """
    coarse = fitted_curve(press)
    fine = fitted_curve(press, FINE)
    travels = _travels(press.deepest)
    difference = np.abs(coarse.force(travels) / fine.force(travels) - 1.0)
    return ForceCurve(
        exponent=fine.exponent,
        coefficients=fine.coefficients,
        deepest=fine.deepest,
        error=float(difference[travels >= _COUNTED * press.deepest].max()) + fine.error,
    )


@functools.lru_cache(maxsize=256)  # the law of a test asks for the same presses again
def fitted_curve(press: CompressionPress, refinement: float = COARSE) -> ForceCurve:
    """Return the force curve fitted to the solves on one mesh; its error is their root mean square scatter [1]."""
    travels = _travels(press.deepest)
    edge = math.inf if press.tool.curvature else press.tool.edge  # a ball does not touch with the edge
    body = HalfBody(press.section, press.law, press.contact, refinement, edge)
    forces = press_forces(body, travels.tolist(), tool=press.tool, grips=press.grips)
    ratios = forces / travels**press.exponent
    # Least squares of relative differences: the fit over the force is 1 at each travel.
    powers = np.sqrt(travels / press.deepest)[:, None] ** np.arange(_TERMS)
    coefficients, *_ = np.linalg.lstsq(powers / ratios[:, None], np.ones_like(ratios))
    scatter = (powers @ coefficients / ratios - 1.0)[travels >= _COUNTED * press.deepest]
    return ForceCurve(
        exponent=press.exponent,
        coefficients=np.asarray(coefficients, dtype=np.float64),
        deepest=press.deepest,
        error=float(np.sqrt((scatter**2).sum() / (len(scatter) - _TERMS))),
    )


def _travels(deepest: float) -> Floats:
    """Return the travels that are solved [mm], close to each other at the touch."""
    return deepest * np.linspace(_LEAST_TRAVEL**0.5, 1.0, _SOLVES) ** 2
