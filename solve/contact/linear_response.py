"""What the sensor reads: forces of both tips and their ratio over travel and modulus, from one compliance.

Travel x of tip i is the give of its spring plus the indentation of the fruit: x = C F + S F / E, with C the
compliance of the springs and S that of the fruit times E. Linear, so every E and x comes from the same S.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.quantity import fault

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Response:
    """Forces [N], force ratio and slope ratio (dF_h/dx) / (dF_l/dx) [1] over travel x [mm] at one modulus E [MPa].

    Arrays of shape (travels,); P and slope_ratio are nan where a tip is off the fruit.
    """

    E: float
    x: Floats
    F_l: Floats
    F_h: Floats
    P: Floats
    slope_ratio: Floats


def spring_compliance(K_l: float, K_h: float) -> Floats:
    """Return the compliance of two springs that do not disturb each other, shape (2, 2) [mm/N from N/mm]."""
    return np.diag([1.0 / K_l, 1.0 / K_h])


def travels(travel_mm: float, count: int) -> Floats:
    """Return `count` equal steps of travel that end at travel_mm [mm], shape (count,); 0 is left out."""
    if count < 1:
        raise fault("count", count, "", "at least 1", "ask for at least one travel")
    return travel_mm * np.arange(1, count + 1) / count


def linear_response(S: Floats, C: Floats, E: float, x: Floats, ahead: Sequence[float] = (0.0, 0.0)) -> Response:
    """Return the response of flat tips that either touch with their whole face or not at all.

    S [1/mm] and C [mm/N] of shape (2, 2), low tip first; `ahead` is what a tilt adds to the travel of each tip [mm].
    """
    give = np.asarray(C, dtype=np.float64) + np.asarray(S, dtype=np.float64) / E
    stiffness = np.linalg.inv(give)
    reach = x[:, None] + np.asarray(ahead, dtype=np.float64)
    F = reach @ stiffness.T
    alone = np.maximum(reach, 0.0) / np.diag(give)
    for tip in (0, 1):
        other = 1 - tip
        # The other tip alone sinks the fruit below this one: give_io F_o is where this tip would first touch.
        off = (reach[:, tip] <= give[tip, other] * alone[:, other]) | (reach[:, tip] <= 0.0)
        F[off, tip], F[off, other] = 0.0, alone[off, other]
    both = (F > 0.0).all(axis=1)
    ratio = np.divide(F[:, 1], F[:, 0], out=np.full(len(x), np.nan), where=both)
    slope = stiffness.sum(axis=1)
    slopes = np.where(both, slope[1] / slope[0], np.nan)
    return Response(E=E, x=np.asarray(x), F_l=F[:, 0], F_h=F[:, 1], P=ratio, slope_ratio=slopes)
