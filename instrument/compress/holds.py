"""The relaxation of flesh, from the force in a hold after a loading, as the Prony series in `fruit.relaxation`."""

import math
import warnings
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeWarning, curve_fit

from instrument.compress.pressed_shapes import POINT_CONTACT
from instrument.compress.specimens import Specimen
from sensor.arrays import Floats
from sensor.quantity import COVERAGE, Estimate, report_field, validation_error

MOST_ARMS = 3
"""Maximum number of arms of a Prony series."""


@dataclass(frozen=True, kw_only=True)
class RelaxationArm:
    """One arm of a Prony series: its share [1] of the force at the first instant and its time constant [s], at 95 %."""

    share: Estimate = report_field(
        "1",
        "share of the force at the first instant",
        inline=lambda it: {"share": it.share.value, "u_share_percent": it.share.percent},
    )
    time: Estimate = report_field(
        "s",
        "time in which it falls",
        inline=lambda it: {"time_s": it.time.value, "u_time_percent": it.time.percent},
    )


@dataclass(frozen=True, kw_only=True)
class HeldRelaxation:
    """The relaxation in a hold: the arms of the flesh, or none if the force falls by no more than its noise.

    `hold_s` is the duration of the hold, which does not show slower arms. `lost_in_loading` is the fraction of the
    force at the first instant that relaxed before the hold [1].
    """

    arms: tuple[RelaxationArm, ...]
    hold_s: float
    lost_in_loading: float = report_field(
        "%", "share of the force that was lost in the loading", key="lost_in_loading_percent", times=100.0
    )


def held_relaxation(specimen: Specimen, hold: slice, touch_mm: float, zero_N: float) -> HeldRelaxation:
    """Fit the relaxation of a specimen to the force in its hold.

    `hold` are the rows of the hold, `touch_mm` is the travel at the touch, and `zero_N` the zero of the load cell. The
    force falls as F_inf + sum A_i exp(-t / tau_i). An arm of share g relaxes already during the loading, in which the
    elastic force n(s) rises to 1 at its end T. So A = F_0 g integral of exp(-(T - s) / tau) dn(s), where F_0 is the
    force that the same depth causes at the first instant. By Hertz's law n is proportional to the depth to the power of
    3/2. Raises InputError for a hold that is shorter than the loading.
    """
    time = np.asarray(specimen.time, dtype=np.float64)
    depth = np.maximum(specimen.travel[: hold.start + 1] - touch_mm, 0.0)
    touch_row = max(int((depth > 0.0).argmax()) - 1, 0)  # the last row before the touch
    before_hold = time[hold.start] - time[touch_row : hold.start + 1]  # T - s
    since_start = time[hold] - time[hold.start]
    hold_s = float(since_start[-1])
    if hold_s < before_hold[0]:
        bound = f"at least as long as the loading, {before_hold[0]:.3g} s"
        hint = "hold for longer, or cut the rows of the hold off"
        name = f"{specimen}: hold"
        raise validation_error(name, float(f"{hold_s:.3g}"), "s", bound, hint)

    final_force, fitted_arms = _fit_arms(since_start, specimen.force[hold] - zero_N)
    elastic = depth[touch_row:] ** POINT_CONTACT / depth[-1] ** POINT_CONTACT  # n
    middles = 0.5 * (before_hold[1:] + before_hold[:-1])
    # The fraction of each arm that is left at the end of the loading: the integral above by the midpoint rule.
    remaining = [float(np.exp(-middles / arm.time.value) @ np.diff(elastic)) for arm in fitted_arms]
    first_force = final_force + sum(arm.share.value / part for arm, part in zip(fitted_arms, remaining, strict=True))
    arms = []
    lost = 0.0
    for arm, part in zip(fitted_arms, remaining, strict=True):
        share = arm.share.times(1.0 / (part * first_force), "1")
        arms.append(replace(arm, share=share))
        lost += share.value * (1.0 - part)
    return HeldRelaxation(arms=tuple(arms), hold_s=hold_s, lost_in_loading=lost)


def _fit_arms(t: Floats, force: Floats) -> tuple[float, list[RelaxationArm]]:
    """Fit exponential arms to a force [N] that relaxes with the time `t` [s] since the start of the hold.

    Returns the final force [N] and the arms, fastest first, whose shares are amplitudes in N. The number of arms is the
    one that Schwarz's criterion selects, among fits in which every amplitude exceeds its error.
    """
    final_force = float(force.mean())
    arms: list[RelaxationArm] = []
    smallest = _schwarz_criterion(force - final_force, 1)
    step = float(np.median(np.diff(t)))
    for count in range(1, MOST_ARMS + 1):
        # Initial guess: equal amplitudes, and times spaced evenly in their logarithm from one step to the whole hold.
        times = np.geomspace(max(step, 1e-6 * t[-1]), t[-1], count + 2)
        start = [force[-1], *[max(force[0] - force[-1], 0.0) / count + 1e-9] * count, *np.log(times[1:-1])]
        lower = [-np.inf] + [0.0] * count + [np.log(times[0])] * count
        upper = [np.inf] * (1 + count) + [np.log(times[-1])] * count
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", OptimizeWarning)
                found, covariance = curve_fit(_relaxing_force, t, force, start, bounds=(lower, upper), max_nfev=4000)
        except (RuntimeError, OptimizeWarning):  # more arms than the force determines
            continue
        criterion = _schwarz_criterion(force - _relaxing_force(t, *found), len(found))
        errors = COVERAGE * np.sqrt(np.diag(covariance))
        amplitudes = found[1 : 1 + count]
        taus = np.exp(found[1 + count :])
        if criterion < smallest and (amplitudes > errors[1 : 1 + count]).all():
            smallest = criterion
            final_force = float(found[0])
            arms = []
            for i in np.argsort(taus).tolist():
                share = Estimate(float(amplitudes[i]), float(errors[1 + i]), "N")
                time = Estimate(float(taus[i]), float(taus[i] * errors[1 + count + i]), "s")
                arms.append(RelaxationArm(share=share, time=time))
    return final_force, arms


def _relaxing_force(t: Floats, final_force: float, *parameters: float) -> Floats:
    """Return the force F_inf + sum A_i exp(-t / tau_i) [N] at times [s].

    The parameters are all A_i [N], then the logarithms of all tau_i.
    """
    count = len(parameters) // 2
    amplitudes = np.array(parameters[:count])
    rates = np.exp(-np.array(parameters[count:]))
    return np.asarray(final_force + np.exp(-np.outer(t, rates)) @ amplitudes)


def _schwarz_criterion(residuals: Floats, parameters: int) -> float:
    """Return Schwarz's criterion of a fit with a number of `parameters`; the best fit has the smallest value.

    G. Schwarz, Ann. Statist. 6 (1978) 461, doi:10.1214/aos/1176344136.
    """
    count = len(residuals)
    mean_square = max(float(np.mean(residuals**2)), np.finfo(np.float64).tiny)
    return count * math.log(mean_square) + parameters * math.log(count)
