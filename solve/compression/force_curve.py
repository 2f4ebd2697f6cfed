"""The force on a compressed body as a smooth function of the travel, with an error estimated from two meshes."""

import functools
import math
from dataclasses import dataclass, field

import numpy as np

from sensor.arrays import Floats
from solve.compression.flesh_law import FleshLaw
from solve.compression.half_body import HalfBody, Section
from solve.compression.tool import Tool
from solve.compression.tool_press import press_forces

COARSE = 1.0  # refinement of the coarse mesh
FINE = 1.5  # refinement of the fine mesh
_FIRST_TRAVEL = 0.01  # travel of the first solve divided by the maximum travel
_TRAVEL_COUNT = 16  # number of travels at which the force is solved
# Number of terms of the fit. The terms are half powers of the travel, because the contact radius of a round body grows
# with the square root of the travel. There are fewer terms than forces, so that the fit smooths the scatter of the
# forces, which arises because surface nodes come into contact one by one.
_TERM_COUNT = 5
# Smallest travel, as a fraction of the maximum travel, at which the error is evaluated. Smaller travels do not affect
# the modulus.
_SMALLEST_COMPARED = 0.1


@dataclass(frozen=True, kw_only=True)
class CompressionPress:
    """The compression of a body by a tool, up to the travel `deepest` [mm].

    `contact` [mm] is the approximate contact radius at this travel. At small travels the force is proportional to
    travel^`exponent`. The tool is frictionless or, with `grips`, holds the surface nodes that it has touched.
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
    """The force as a function of the travel, F = E travel^exponent sum_k coefficients_k (travel / deepest)^(k/2) [N].

    E is in MPa. The travel [mm] is the displacement of one tool towards the middle of the body since the first touch,
    at most `deepest`. `error` [1] is the relative error of the force.
    """

    exponent: float
    coefficients: Floats
    deepest: float
    error: float

    def force(self, travel: Floats) -> Floats:
        """Return the force [N] at the given travels [mm], for E = 1 MPa."""
        root = np.sqrt(travel / self.deepest)
        return np.asarray(travel**self.exponent * np.polynomial.polynomial.polyval(root, self.coefficients))


def force_curve(press: CompressionPress) -> ForceCurve:
    """Return the force curve of the compression `press` on a fine mesh, with its relative error.

    The error is the largest relative difference from the curve on a coarser mesh, plus the scatter on the fine mesh.
    Travels below a tenth of the maximum are not compared, because they do not affect the modulus. Raises SolveError if
    no equilibrium is found.
    """
    coarse = fit_force_curve(press)
    fine = fit_force_curve(press, FINE)
    travels = _travels(press.deepest)
    differences = np.abs(coarse.force(travels) / fine.force(travels) - 1.0)
    is_compared = travels >= _SMALLEST_COMPARED * press.deepest
    return ForceCurve(
        exponent=fine.exponent,
        coefficients=fine.coefficients,
        deepest=fine.deepest,
        error=float(differences[is_compared].max()) + fine.error,
    )


@functools.lru_cache(maxsize=256)  # the analysis of a test requests the same presses again
def fit_force_curve(press: CompressionPress, refinement: float = COARSE) -> ForceCurve:
    """Solve the forces of the compression `press` on one mesh, and fit a force curve to them.

    The error of the curve [1] is the root-mean-square scatter of the forces about it. Doubling the `refinement` halves
    the element size. The result is cached. Raises SolveError if no equilibrium is found.
    """
    travels = _travels(press.deepest)
    edge = math.inf if press.tool.curvature else press.tool.edge  # the edge of a spherical face does not touch the body
    body = HalfBody(press.section, press.law, press.contact, refinement, edge)
    forces = press_forces(body, travels.tolist(), tool=press.tool, grips=press.grips)
    # Without the factor travel^exponent, the force is a polynomial in sqrt(travel).
    polynomial_values = forces / travels**press.exponent
    powers = np.sqrt(travels / press.deepest)[:, None] ** np.arange(_TERM_COUNT)  # (travels, terms)
    # Minimise the squares of the relative differences: the ratio of fit to force should be 1 at each travel.
    coefficients, *_ = np.linalg.lstsq(powers / polynomial_values[:, None], np.ones_like(polynomial_values))
    relative_differences = powers @ coefficients / polynomial_values - 1.0
    scatter = relative_differences[travels >= _SMALLEST_COMPARED * press.deepest]
    degrees_of_freedom = len(scatter) - _TERM_COUNT
    return ForceCurve(
        exponent=press.exponent,
        coefficients=np.asarray(coefficients, dtype=np.float64),
        deepest=press.deepest,
        error=float(np.sqrt((scatter**2).sum() / degrees_of_freedom)),
    )


def _travels(deepest: float) -> Floats:
    """Return the travels [mm] at which the force is solved, which are closer together near the first touch."""
    return deepest * np.linspace(_FIRST_TRAVEL**0.5, 1.0, _TRAVEL_COUNT) ** 2
