"""How far a printed sensor may be off before it is calibrated: bands from the scatter of its process.

Thickness error and modulus are taken as common to all springs, as they are in one print. So t of each leaf shifts by
one offset, E by one factor. The stiffnesses follow a surrogate in ln t that finite elements pin at both ends.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from cad.parts.housing import Housing
from mesh.housing.sweep import flexure_mesh
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.springs.leaf_lengths import COARSE
from pipeline.springs.mounts import mount_layers
from pipeline.storage.cache import cached
from pipeline.verdicts.errors.causes import CALIBRATED
from pipeline.verdicts.errors.scatter_bands import Interval, ScatterBands
from pipeline.verdicts.targets import ForceRatioCurve, characteristic
from sensor.arrays import Floats
from sensor.design.parameters import Targets
from sensor.design.processes import Process
from sensor.quantity import COVERAGE
from sensor.theory.two_spring_law import Springs, force_ratio
from solve.error_estimate import propagate_errors
from solve.housing.stiffness import tip_compliance

Stiffnesses = Callable[[Housing], tuple[float, ...]]

SAMPLES = 1024
LEVEL = 0.95


@dataclass(frozen=True, kw_only=True)
class StiffnessSurrogate:
    """ln K / K_nominal = slope s + curve s^2 in s = ln t / t_nominal of each spring [1], and its corner error."""

    slopes: tuple[float, ...]
    curves: tuple[float, ...]
    corner_error: float

    def factors(self, shifts: Floats) -> Floats:
        """Return K / K_nominal [1] at the shifts s of the leaves, both of shape (springs, ...)."""
        rows = zip(self.slopes, self.curves, shifts, strict=True)
        return np.stack([np.exp(slope * s + curve * s * s) for slope, curve, s in rows])


def print_scatter(sensor: PressedSensor) -> ScatterBands | None:
    """Return the bands of prints of a sensor, the surrogate solved by finite elements and kept; None where not made."""
    springs = sensor.springs
    housing = springs.housing
    process = springs.process
    if housing is None:
        return None
    law = characteristic(sensor)
    targets = sensor.design.nominal_targets

    def coarse(changed: Housing) -> tuple[float, ...]:
        mesh = flexure_mesh(changed, COARSE)
        return tip_compliance(mesh, process.E_MPa, process.poisson, mount_layers(changed)).K

    surrogate = cached(
        "surrogate",
        {"housing": housing, "process": process},
        lambda: fit_surrogate(housing, process.accuracy_mm, coarse),
        StiffnessSurrogate,
    )
    return scatter_bands(housing, process, law, targets, surrogate)


def thicken_leaves(housing: Housing, offsets: Sequence[float]) -> Housing:
    """Return the housing with the thickness of the leaves of each spring changed by an offset [mm]."""
    flexures = {}
    for arm, offset in zip(housing.arms, offsets, strict=True):
        flexures[arm.name] = replace(arm.flexure, thickness=arm.flexure.thickness + offset)
    return housing.with_flexures(flexures)


def fit_surrogate(housing: Housing, offset: float, stiffnesses: Stiffnesses) -> StiffnessSurrogate:
    """Return the surrogate through the stiffnesses of leaves all thinner, nominal, all thicker by the offset [mm].

    Its error is measured at points that were not fitted, the corners: one spring thicker, the next one thinner.
    """
    count = len(housing.arms)
    nominal = np.array(stiffnesses(housing))

    def stiffness_factors(offsets: Sequence[float]) -> Floats:
        ratios: Floats = np.array(stiffnesses(thicken_leaves(housing, offsets))) / nominal
        return ratios

    thinner = [-offset] * count
    thicker = [offset] * count
    # the parabola through nominal, thinner and thicker: ln K / K_nominal over s is a straight line
    shifts = np.array([_shifts(housing, thinner), _shifts(housing, thicker)])
    ratios = np.log([stiffness_factors(thinner), stiffness_factors(thicker)]) / shifts
    curves = (ratios[1] - ratios[0]) / (shifts[1] - shifts[0])
    slopes = ratios[0] - curves * shifts[0]
    surrogate = StiffnessSurrogate(slopes=tuple(slopes.tolist()), curves=tuple(curves.tolist()), corner_error=0.0)
    corner_error = 0.0
    for sign in (-1.0, 1.0):
        mixed = [sign * offset * (-1.0) ** spring for spring in range(count)]
        predicted = surrogate.factors(_shifts(housing, mixed))
        corner_error = max(corner_error, float(np.abs(predicted / stiffness_factors(mixed) - 1.0).max()))
    return replace(surrogate, corner_error=corner_error)


def _shifts(housing: Housing, offsets: Sequence[float]) -> Floats:
    """Return ln t / t_nominal of the leaves of each spring whose thickness is off [mm], shape (springs,)."""
    pairs = zip(housing.arms, offsets, strict=True)
    return np.array([math.log1p(offset / arm.flexure.thickness) for arm, offset in pairs])


def scatter_bands(
    housing: Housing, process: Process, law: ForceRatioCurve, targets: Targets, surrogate: StiffnessSurrogate
) -> ScatterBands:
    """Return the bands of prints over a Sobol sample of thickness offset and modulus, both normal.

    P is the one that each print shows on fruit of the largest stiffness; its modulus is read with the nominal springs.
    """
    normal = _normal_sample(2)
    thickness_offset = normal[:, 0] * process.accuracy_mm / COVERAGE
    modulus_factor = 1.0 + process.E_scatter * normal[:, 1]
    shifts = np.stack([np.log1p(thickness_offset / arm.flexure.thickness) for arm in housing.arms])
    return _bands_of(modulus_factor * surrogate.factors(shifts), law, targets, surrogate.corner_error)


def _normal_sample(count: int) -> Floats:
    """Return a Sobol sample of standard normal numbers, shape (samples, count)."""
    from scipy.stats import qmc  # a tenth of all imports, and only fabrication needs it

    points = qmc.Sobol(count, seed=1).random(SAMPLES)
    normal: Floats = ndtri(np.clip(points, 1e-9, 1.0 - 1e-9))
    return normal


def _bands_of(factors: Floats, law: ForceRatioCurve, targets: Targets, surrogate_error: float) -> ScatterBands:
    """Return the bands of sensors whose springs are as stiff as nominal times factors, shape (springs, samples)."""
    K_m_max = law.K_m_max
    prints = [law.springs.scaled(pair) for pair in factors.T.tolist()]
    P_max = [force_ratio(springs, K_m_max, law.stiffness_ratio) for springs in prints]
    NL = [replace(law, springs=springs).NL(targets).value for springs in prints]
    return ScatterBands(
        K_l_N_per_m=_band([1e3 * springs.K_l for springs in prints]),
        K_h_N_per_m=_band([1e3 * springs.K_h for springs in prints]),
        P_max=_band(P_max),
        NL=_band(NL),
        modulus_error=_band([law.modulus_fraction(law.fruit_stiffness(P)) - 1.0 for P in P_max]),
        calibrated_modulus_error=calibrated_error(law),
        surrogate_error=surrogate_error,
    )


def calibrated_error(law: ForceRatioCurve) -> float | None:
    """Return the error of the fruit stiffness read from P when both stiffnesses are known to `CALIBRATED` [1].

    None where some such springs show no such P.
    """
    P = force_ratio(law.springs, law.K_m_max, law.stiffness_ratio)

    def read(K_l: float, K_h: float) -> float:
        return law.modulus_fraction(replace(law, springs=Springs(K_l=K_l, K_h=K_h)).fruit_stiffness(P))

    K = law.springs.stiffnesses
    error = propagate_errors(read, K, [CALIBRATED * stiffness for stiffness in K])
    return error if math.isfinite(error) else None


def _band(values: list[float]) -> Interval:
    """Return the ends of the middle 95 %; None for one that lies beyond all numbers."""
    ends = np.quantile(values, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], method="inverted_cdf")
    low, high = (float(end) if math.isfinite(end) else None for end in ends)
    return low, high
