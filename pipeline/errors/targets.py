"""P_max and NL of a sensor: from the two-spring law if it is exact, and otherwise from presses in the scene."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.errors.error_records import LevelTargets
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import ScenePress, spring_fractions
from sensor.arrays import Floats
from sensor.design.parameters import Targets
from sensor.quantity import Estimate
from sensor.theory.two_spring_law import (
    Springs,
    curve_nonlinearity,
    force_ratio,
    fruit_stiffness,
    nonlinearity,
    spring_deflection,
)
from solve.contact.linear_response import SensorResponse
from solve.contact.response import SAFETY
from solve.error_estimate import propagate_errors

# Smallest travel at which errors are evaluated [mm]. Relative changes are not defined at a travel of 0.
LEAST_TRAVEL = 1e-6

Law = Callable[[float, float, float, float], float]
"""A function of K_l, K_h, the fruit stiffness under the low tip [N/mm], and `stiffness_ratio` [1]."""


@dataclass(frozen=True, kw_only=True)
class ForceRatioCurve:
    """The force ratio P as a function of the fruit stiffness, with the errors of its parameters.

    `K_m_max` [N/mm] is the stiffness of the fruit at E_max under the low tip. `stiffness_ratio` [1] is the stiffness of
    the fruit under the high tip divided by its stiffness under the low tip. `spring_errors` [N/mm] are the errors of
    the two stiffnesses, and `K_m_error` [N/mm] is the error of `K_m_max`. `stiffening` is K_m / `K_m_max` [1] at the
    fractions `curve_shares` of E_max on a fruit with a skin. `stiffening` is empty if K_m is proportional to the
    modulus.
    """

    springs: Springs
    K_m_max: float
    spring_errors: tuple[float, ...] = (0.0, 0.0)
    K_m_error: float = 0.0
    stiffness_ratio: float = 1.0
    stiffening: tuple[float, ...] = ()

    def P_max(self) -> Estimate:
        """Return the force ratio at the largest fruit stiffness [1]."""
        return self._estimate(lambda K_l, K_h, K_m, ratio: force_ratio(Springs(K_l=K_l, K_h=K_h), K_m, ratio))

    def NL(self, targets: Targets) -> Estimate:
        """Return the nonlinearity [1], as the targets define it."""

        def law(K_l: float, K_h: float, K_m: float, ratio: float) -> float:
            return nonlinearity(Springs(K_l=K_l, K_h=K_h), K_m, targets.NL_definition, ratio, self.stiffening)

        return self._estimate(law)

    def fruit_stiffness(self, P: float) -> float:
        """Return the fruit stiffness [N/mm] at which the force ratio is P, by the paper's equation (4).

        P increases with the fruit stiffness, from `stiffness_ratio` on a fruit that is almost fluid to K_h / K_l on a
        rigid fruit. The result is 0 for a smaller P, and infinite for a larger P.
        """
        if self.stiffness_ratio >= P:
            return 0.0
        if self.springs.K_h / self.springs.K_l <= P:
            return math.inf
        return fruit_stiffness(self.springs, P, self.stiffness_ratio)

    def modulus_converter(self, P: Floats, E: Floats) -> Callable[[float], float] | None:
        """Return a function that converts a force ratio [1] at one travel to the modulus [MPa].

        `P` (moduli,) [1] holds the force ratios at the moduli `E` (moduli,) [MPa], softest first. The function converts
        a ratio to a fruit stiffness by the two-spring law. The modulus is then interpolated linearly in this stiffness,
        in which it is nearly linear. The function returns nan for a ratio that the springs cannot produce.

        The result is None if an entry of `P` is unknown (nan), or if P does not increase with the modulus.
        """

        def stiffness(ratio: float) -> float:
            """Return the fruit stiffness [N/mm] at a force ratio, or nan if the ratio is not finite.

            The ratio is scaled so that P[0], on the softest fruit, becomes the limit of the law for a soft fruit.
            """
            scaled_ratio = ratio / float(P[0]) * self.stiffness_ratio
            return self.fruit_stiffness(scaled_ratio) if math.isfinite(scaled_ratio) else math.nan

        nodes = np.array([stiffness(ratio) for ratio in P.tolist()])  # fruit stiffnesses at the moduli [N/mm]
        if not (np.diff(nodes) > 0.0).all():  # a node that is nan also fails this comparison
            return None

        def modulus(ratio: float) -> float:
            """Return the modulus [MPa] at a force ratio [1]."""
            K_m = stiffness(ratio)
            return _interpolate_modulus(K_m, nodes, E) if math.isfinite(K_m) else math.nan

        return modulus

    def deflections(self, K_m: Floats | float, travel: Floats | float) -> Floats:
        """Return the deflection of each spring [mm], shape (2, ...), with the low spring first.

        `K_m` is the fruit stiffness under the low tip [N/mm], and `travel` is the travel of the sensor [mm]. Their
        shapes must broadcast.
        """
        K_m = np.asarray(K_m, dtype=np.float64)
        travel = np.maximum(LEAST_TRAVEL, travel)
        low = spring_deflection(self.springs.K_l, K_m, travel)
        high = spring_deflection(self.springs.K_h, np.asarray(self.stiffness_ratio * K_m), travel)
        return np.array([low, high])

    def _estimate(self, law: Law) -> Estimate:
        """Return the value of a law, with the error caused by the errors of the springs and of the fruit stiffness."""
        # At the centre of the fruit, both tips press on the same stiffness, so its error does not change the ratio.
        ratio_error = 0.0 if self.stiffness_ratio == 1.0 else self.K_m_error / self.K_m_max
        values = (*self.springs.stiffnesses, self.K_m_max, self.stiffness_ratio)
        errors = (*self.spring_errors, self.K_m_error, ratio_error * self.stiffness_ratio)
        return Estimate(law(*values), propagate_errors(law, values, errors))


def _interpolate_modulus(K_m: float, nodes: Floats, E: Floats) -> float:
    """Return the modulus [MPa] at the fruit stiffness `K_m` [N/mm], interpolated linearly.

    `nodes` (moduli,) [N/mm] are the fruit stiffnesses at the moduli `E` (moduli,) [MPa], in ascending order. Above the
    last node, the modulus is extrapolated from the last two nodes. Up to the first node, it is 0.
    """
    if K_m <= nodes[0]:
        return 0.0
    if K_m <= nodes[-1]:
        return float(np.interp(K_m, nodes, E))
    slope = (E[-1] - E[-2]) / (nodes[-1] - nodes[-2])
    return float(E[-1] + slope * (K_m - nodes[-1]))


def force_ratio_curve(pair: PressedSensor) -> ForceRatioCurve:
    """Return the force ratio of a pair as a function of the fruit stiffness, with the errors of its parameters.

    The fruit stiffness comes from the solved contact, even if the springs were sized for another stiffness.
    """
    sizing = pair.sizing
    K_m = sizing.K_m_max_contact
    return ForceRatioCurve(
        springs=pair.springs.stiffnesses,
        K_m_max=K_m,
        spring_errors=pair.springs.errors,
        K_m_error=pair.contact.difference_error * K_m,
        stiffness_ratio=sizing.stiffness_ratio,
        stiffening=sizing.stiffening,
    )


def force_errors_of_springs(sensor: PressedSensor, E: float) -> Floats:
    """Return the relative error of the force on each tip [1] that the numerical error of its spring causes.

    The shape is (tips,). `E` [MPa] is the modulus of the fruit. The spring contributes only a fraction of the
    compliance, so only this fraction of its relative error reaches the force.
    """
    errors = [spring.error / spring.stiffness for spring in sensor.springs.springs.values()]  # low spring, high spring
    return spring_fractions(sensor.contact, sensor.C, E) * sensor.design.tips.each(*errors)


@dataclass(frozen=True, kw_only=True)
class SceneTargets:
    """P_max and NL of the scene [1], or None if a tip is out of contact, and their values for a level sensor."""

    P_max: Estimate | None
    NL: Estimate | None
    level: LevelTargets


def evaluate_targets(sensor: PressedSensor, targets: Targets, press: ScenePress | None) -> SceneTargets:
    """Return P_max and NL of a sensor with their errors; `targets` defines NL.

    P_max and NL come from the forces in `press`. If `press` is None or all its tips touch at once, they come from the
    two-spring law, which is then exact. A sensor of more than two tips is represented by a pair.
    """
    pair = sensor.pair
    law = force_ratio_curve(pair)
    P_max, NL = law.P_max(), law.NL(targets)
    level = LevelTargets(P_max=P_max.value, P_max_error=P_max.error, NL=NL.value, NL_error=NL.error)
    if press is None or press.level:
        return SceneTargets(P_max=P_max, NL=NL, level=level)
    return SceneTargets(P_max=_scene_P_max(pair, press.curve), NL=_scene_NL(law, targets, press.curve), level=level)


def _scene_P_max(pair: PressedSensor, curve: SensorResponse) -> Estimate | None:
    """Return P at E_max and full travel [1] with its error, or None if a tip is out of contact.

    The error contains the errors of the contact cells, of the compliance of the fruit, and of the springs.
    """
    P = float(curve.P[-1, -1])  # the last modulus is E_max, and the last travel is full travel
    if not math.isfinite(P):
        return None
    # P is a ratio of two forces, so their relative errors add.
    spring_errors = float(force_errors_of_springs(pair, float(curve.E[-1])).sum())
    return Estimate(P, P * (float(curve.P_error[-1, -1]) + spring_errors))


def _scene_NL(law: ForceRatioCurve, targets: Targets, curve: SensorResponse) -> Estimate | None:
    """Return NL at full travel [1], as `targets` define it, or None if a tip is out of contact.

    `curve` is the response of the scene. The error of NL has two parts. The first part is due to the errors of the
    springs and of the compliance; `law` gives it for a level sensor. The second part is due to the contact cells. The
    error due to the cells is estimated from the change of NL with coarser cells. This change may happen to be 0 at one
    travel, so the larger change at the last two travels is used.
    """
    E = curve.E.tolist()
    coarse_P = curve.P * (1.0 - curve.P_step)  # P on the coarser cells
    largest_step = 0.0
    for travel in (-2, -1):  # indices of the last two travels; full travel comes last, because its NL is returned
        NL = curve_nonlinearity(curve.P[:, travel].tolist(), E, targets.NL_definition)
        coarse_NL = curve_nonlinearity(coarse_P[:, travel].tolist(), E, targets.NL_definition)
        step = abs(NL - coarse_NL)
        if not math.isfinite(step):
            return None
        largest_step = max(largest_step, step)
    return Estimate(NL, SAFETY * largest_step + law.NL(targets).error)
