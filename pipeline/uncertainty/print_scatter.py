"""How far a printed sensor may be off before it is calibrated: bands from the scatter of its process.

Thickness error and modulus are taken as common to both springs, as they are in one print: t of each leaf shifts by
one offset, E by one factor. The stiffnesses follow a surrogate in ln t that finite elements pin at both ends.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, qmc

from cad.design.parameters import Targets
from cad.design.processes import Process
from cad.parts.housing import Housing
from cad.theory.two_spring_law import Springs, force_ratio, fruit_stiffness, nonlinearity
from pipeline.stages.verdict_rules import Judged
from pipeline.uncertainty.budget import SIGMAS
from solve.error_estimate import propagated

Floats = NDArray[np.float64]
Band = tuple[float, float]
Stiffnesses = Callable[[Housing], tuple[float, float]]

SAMPLES = 1024
LEVEL = 0.95
CALIBRATED = 0.01  # of each stiffness: what weighing a printed unit reaches


@dataclass(frozen=True, kw_only=True)
class Surrogate:
    """ln K / K_nominal = slope s + curve s^2 in s = ln t / t_nominal, for each spring; and its error at the corners."""

    slopes: tuple[float, float]
    curves: tuple[float, float]
    corner_error: float

    def factors(self, shift: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Return K / K_nominal of both springs at the shifts s of their leaves."""
        low, high = (np.exp(a * s + b * s * s) for a, b, s in zip(self.slopes, self.curves, shift, strict=True))
        return low, high


@dataclass(frozen=True, kw_only=True)
class Bands:
    """The middle 95 % of what prints give [N/m; 1], and the error of the modulus read with nominal stiffnesses [1].

    `calibrated_modulus_error` is what remains when both stiffnesses of a unit are known to 1 %.
    """

    K_l_N_per_m: Band
    K_h_N_per_m: Band
    P_max: Band
    NL: Band
    modulus_error: Band
    calibrated_modulus_error: float
    surrogate_error: float


def thickened(housing: Housing, low: float, high: float) -> Housing:
    """Return the housing with the thickness of the low and of the high leaves changed by offsets [mm]."""
    return replace(
        housing,
        low=replace(housing.low, thickness=housing.low.thickness + low),
        high=replace(housing.high, thickness=housing.high.thickness + high),
    )


def fit_surrogate(housing: Housing, offset: float, stiffnesses: Stiffnesses) -> Surrogate:
    """Return the surrogate through the stiffnesses of leaves both thinner, nominal, both thicker by the offset [mm].

    Its error is taken where it was not fitted: one spring thicker, the other thinner.
    """
    nominal = np.array(stiffnesses(housing))
    shift = np.array([_shifts(housing, -offset), _shifts(housing, offset)])
    change = np.array([np.log(stiffnesses(thickened(housing, d, d)) / nominal) for d in (-offset, offset)])
    fits = [np.linalg.solve(np.stack([s, s * s], axis=1), y) for s, y in zip(shift.T, change.T, strict=True)]
    (a, b), (c, d) = ((float(p), float(q)) for p, q in fits)
    found = Surrogate(slopes=(a, c), curves=(b, d), corner_error=0.0)
    worst = 0.0
    for sign in (-1.0, 1.0):
        mixed = np.array(stiffnesses(thickened(housing, sign * offset, -sign * offset))) / nominal
        low, high = _shifts(housing, sign * offset)[0], _shifts(housing, -sign * offset)[1]
        guessed = found.factors((np.array(low), np.array(high)))
        worst = max(worst, float(np.abs(np.array(guessed) / mixed - 1.0).max()))
    return replace(found, corner_error=worst)


def _shifts(housing: Housing, offset: float) -> tuple[float, float]:
    low, high = (math.log1p(offset / flexure.thickness) for flexure in (housing.low, housing.high))
    return low, high


def bands(housing: Housing, process: Process, judged: Judged, targets: Targets, surrogate: Surrogate) -> Bands:
    """Return the bands over a Sobol sample of thickness offset and modulus, both normal."""
    nominal, K_m_max, q = judged.springs, judged.K_m_max, judged.asymmetry
    points = qmc.Sobol(2, seed=1).random(SAMPLES)
    offset, scatter = norm.ppf(np.clip(points, 1e-9, 1.0 - 1e-9)).T
    offset = offset * process.accuracy_mm / SIGMAS
    shift = tuple(np.log1p(offset / flexure.thickness) for flexure in (housing.low, housing.high))
    low, high = surrogate.factors((shift[0], shift[1]))
    E = 1.0 + process.E_scatter * scatter
    prints = [Springs(K_l=nominal.K_l * a, K_h=nominal.K_h * b) for a, b in zip(E * low, E * high, strict=True)]
    read = [fruit_stiffness(nominal, force_ratio(one, K_m_max, q), q) / K_m_max - 1.0 for one in prints]
    return Bands(
        K_l_N_per_m=_band([1e3 * one.K_l for one in prints]),
        K_h_N_per_m=_band([1e3 * one.K_h for one in prints]),
        P_max=_band([force_ratio(one, K_m_max, q) for one in prints]),
        NL=_band([nonlinearity(one, K_m_max, targets.NL_definition, q) for one in prints]),
        modulus_error=_band(read),
        calibrated_modulus_error=calibrated_error(judged),
        surrogate_error=surrogate.corner_error,
    )


def calibrated_error(judged: Judged) -> float:
    """Return the error of the fruit stiffness read from P when both stiffnesses are known to 1 % [1]."""
    springs, K_m, q = judged.springs, judged.K_m_max, judged.asymmetry
    P = force_ratio(springs, K_m, q)

    def read(K_l: float, K_h: float) -> float:
        return fruit_stiffness(Springs(K_l=K_l, K_h=K_h), P, q)

    errors = (CALIBRATED * springs.K_l, CALIBRATED * springs.K_h)
    return propagated(read, (springs.K_l, springs.K_h), errors) / K_m


def _band(values: list[float]) -> Band:
    low, high = np.quantile(values, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL])
    return float(low), float(high)
