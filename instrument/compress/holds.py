"""Relaxation of flesh from the hold after a loading, as the Prony series in `fruit.relaxation`."""

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


@dataclass(frozen=True, kw_only=True)
class RelaxationArm:
    """One arm of a Prony series: its share [1] of the force at the first instant and its time [s], each at 95 %."""

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
    """The relaxation in a hold: the arms of the flesh, none if the force falls by no more than its noise.

    `hold_s` is the duration of the hold; it does not show slower arms. `lost_in_loading` is the share of the force at
    the first instant that was lost before the hold [1].
    """

    arms: tuple[RelaxationArm, ...]
    hold_s: float
    lost_in_loading: float = report_field(
        "%", "share of the force that was lost in the loading", key="lost_in_loading_percent", times=100.0
    )


def held_relaxation(specimen: Specimen, hold: slice, touch_mm: float, zero_N: float) -> HeldRelaxation:
    """Return the relaxation of a specimen in its hold, from the travel at its touch [mm] and the zero of its force [N].

    The force falls as F_inf + sum A_i exp(-t / tau_i), with the number of arms that the criterion of Schwarz selects
    (G. Schwarz, Ann. Statist. 6 (1978) 461, doi:10.1214/aos/1176344136). An arm of share g relaxes during a loading
    n(s) already: A = g integral of exp(-(T - s) / tau) dn, with n as the depth to the power of 3/2 (Hertz). Raises
    InputError for a hold that is shorter than the loading.
    """
    time = np.asarray(specimen.time, dtype=np.float64)
    depth = np.maximum(specimen.travel[: hold.start + 1] - touch_mm, 0.0)
    touched = max(int((depth > 0.0).argmax()) - 1, 0)  # the last row before the touch
    before = time[hold.start] - time[touched : hold.start + 1]
    since = time[hold] - time[hold.start]
    hold_s = float(since[-1])
    if hold_s < before[0]:
        bound = f"at least as long as the loading, {before[0]:.3g} s"
        hint = "hold for longer, or cut the rows of the hold off"
        name = f"{specimen}: hold"
        raise validation_error(name, float(f"{hold_s:.3g}"), "s", bound, hint)

    last, fall = _fitted_fall(since, specimen.force[hold] - zero_N)
    entered = depth[touched:] ** POINT_CONTACT / depth[-1] ** POINT_CONTACT
    middles = 0.5 * (before[1:] + before[:-1])
    kept = [float(np.exp(-middles / arm.time.value) @ np.diff(entered)) for arm in fall]
    at_once = last + sum(arm.share.value / part for arm, part in zip(fall, kept, strict=True))  # [N]
    arms = []
    lost = 0.0
    for arm, part in zip(fall, kept, strict=True):
        share = arm.share.times(1.0 / (part * at_once), "1")
        arms.append(replace(arm, share=share))
        lost += share.value * (1.0 - part)
    return HeldRelaxation(arms=tuple(arms), hold_s=hold_s, lost_in_loading=lost)


def _fitted_fall(t: Floats, force: Floats) -> tuple[float, list[RelaxationArm]]:
    """Return the final force [N] of a relaxation over times [s], and its arms, fastest first, with shares in N.

    Schwarz's criterion selects their number.
    """
    last = float(force.mean())
    arms: list[RelaxationArm] = []
    least = _criterion(force - last, 1)
    step = float(np.median(np.diff(t)))
    for count in range(1, MOST_ARMS + 1):
        times = np.geomspace(max(step, 1e-6 * t[-1]), t[-1], count + 2)
        start = [force[-1], *[max(force[0] - force[-1], 0.0) / count + 1e-9] * count, *np.log(times[1:-1])]
        lowest = [-np.inf] + [0.0] * count + [np.log(times[0])] * count
        highest = [np.inf] * (1 + count) + [np.log(times[-1])] * count
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", OptimizeWarning)
                found, covariance = curve_fit(_falling, t, force, start, bounds=(lowest, highest), max_nfev=4000)
        except (RuntimeError, OptimizeWarning):  # more arms than the force determines
            continue
        value = _criterion(force - _falling(t, *found), len(found))
        errors = COVERAGE * np.sqrt(np.diag(covariance))
        amplitudes = found[1 : 1 + count]
        taus = np.exp(found[1 + count :])
        if value < least and (amplitudes > errors[1 : 1 + count]).all():
            least = value
            last = float(found[0])
            arms = []
            for i in np.argsort(taus).tolist():
                share = Estimate(float(amplitudes[i]), float(errors[1 + i]), "N")
                time = Estimate(float(taus[i]), float(taus[i] * errors[1 + count + i]), "s")
                arms.append(RelaxationArm(share=share, time=time))
    return last, arms


def _falling(t: Floats, last: float, *parameters: float) -> Floats:
    """Return last + sum A_i exp(-t / tau_i) [N]; the parameters are all A_i [N], then the logarithms of all tau_i."""
    count = len(parameters) // 2
    amplitudes = np.array(parameters[:count])
    rates = np.exp(-np.array(parameters[count:]))
    return np.asarray(last + np.exp(-np.outer(t, rates)) @ amplitudes)


def _criterion(residual: Floats, parameters: int) -> float:
    """Return Schwarz's criterion of a fit from its residual; the smallest value is the best."""
    count = len(residual)
    mean_square = max(float(np.mean(residual**2)), np.finfo(np.float64).tiny)
    return count * math.log(mean_square) + parameters * math.log(count)
