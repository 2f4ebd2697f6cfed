"""Fit of a Prony series for `fruit.relaxation` to the force of a compression test, which relaxes in a hold."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeWarning, curve_fit

from instrument.compress.pressed_shapes import POINT_CONTACT
from instrument.compress.specimens import Specimen
from sensor.arrays import Floats
from sensor.quantity import COVERAGE, Estimate, report_field, validation_error

MOST_ARMS = 3
"""Maximum number of arms of a Prony series."""
_MOST_EVALUATIONS = 4000  # maximum number of evaluations of the force in a fit
# Two small numbers that keep the time constants and the guessed amplitudes above zero.
_LEAST_TIME_FRACTION = 1e-6  # shortest time constant, as a fraction of the hold
_LEAST_AMPLITUDE_N = 1e-9


@dataclass(frozen=True, kw_only=True)
class RelaxationArm:
    """One arm of a Prony series: its share [1] of the instantaneous force, and its time constant [s].

    The error bars of both are half widths at 95 %.
    """

    share: Estimate = report_field(
        "1",
        "share of the instantaneous force",
        inline=lambda it: {"share": it.share.value, "u_share_percent": it.share.percent},
    )
    time: Estimate = report_field(
        "s",
        "time constant with which this share decays",
        inline=lambda it: {"time_s": it.time.value, "u_time_percent": it.time.percent},
    )


@dataclass(frozen=True, kw_only=True)
class HeldRelaxation:
    """The relaxation measured in a hold: the arms of the Prony series, or none if noise explains the fall of the force.

    `hold_s` is the duration of the hold; arms that are much slower cannot be measured. `lost_in_loading` [1] is the
    fraction of the instantaneous force that relaxed before the hold.
    """

    arms: tuple[RelaxationArm, ...]
    hold_s: float
    lost_in_loading: float = report_field(
        "%", "share of the force that relaxed during the loading", key="lost_in_loading_percent", times=100.0
    )


def fit_relaxation(specimen: Specimen, hold: slice, touch_mm: float, zero_N: float) -> HeldRelaxation:
    """Fit the relaxation of a specimen to the force in its hold, as a Prony series.

    In the hold, with t = 0 at its start, the force is

        F(t) = F_inf + sum A_i exp(-t / tau_i).

    An arm with share g_i already relaxes during the loading. Let n(s) be the elastic force at the time s, relative to
    its value at the end T of the loading. Then

        A_i = F_0 g_i r_i,    r_i = integral of exp(-(T - s) / tau_i) dn(s),    F_0 = F_inf + sum A_i / r_i,

    where F_0 is the instantaneous force, the force of an infinitely fast loading to the same depth. r_i is the fraction
    of the arm that remains at the end of the loading. By Hertz's law, n is proportional to depth^(3/2).

    `specimen` has times, and the deflection of the machine is already subtracted from its travel. `hold` selects the
    rows of the hold, `touch_mm` is the travel at first contact, and `zero_N` is the zero of the load cell. Raises
    InputError for a hold that is shorter than the loading.
    """
    time = np.asarray(specimen.time, dtype=np.float64)
    # The hold begins with the row in which the loading ends.
    depth = np.maximum(specimen.travel[: hold.start + 1] - touch_mm, 0.0)
    touch_row = max(int((depth > 0.0).argmax()) - 1, 0)  # last row before first contact
    before_hold = time[hold.start] - time[touch_row : hold.start + 1]  # T - s, from first contact on
    since_start = time[hold] - time[hold.start]
    hold_s = float(since_start[-1])
    _check_duration(specimen, hold_s, loading_s=float(before_hold[0]))
    final_force, fitted_arms = _fit_arms(since_start, specimen.force[hold] - zero_N)
    remaining = _remaining_fractions(fitted_arms, before_hold, depth[touch_row:])
    # This is F_0. The shares of the fitted arms are still the amplitudes A_i.
    instantaneous_force = final_force + sum(arm.share.value / r for arm, r in zip(fitted_arms, remaining, strict=True))
    arms = []
    lost = 0.0
    for arm, r in zip(fitted_arms, remaining, strict=True):
        share = arm.share.times(1.0 / (r * instantaneous_force), "1")  # g_i = A_i / (F_0 r_i)
        arms.append(replace(arm, share=share))
        lost += share.value * (1.0 - r)
    return HeldRelaxation(arms=tuple(arms), hold_s=hold_s, lost_in_loading=lost)


def _check_duration(specimen: Specimen, hold_s: float, loading_s: float) -> None:
    """Raise InputError if the hold of a `specimen` is shorter than its loading; both durations are in seconds."""
    if hold_s < loading_s:
        bound = f"at least as long as the loading, {loading_s:.3g} s"
        hint = "hold for longer, or remove the rows of the hold from the table"
        name = f"{specimen}: hold"
        raise validation_error(name, float(f"{hold_s:.3g}"), "s", bound, hint)


def _remaining_fractions(arms: Sequence[RelaxationArm], before_hold: Floats, depth: Floats) -> list[float]:
    """Return for each arm the fraction r_i [1] that remains at the end of the loading.

    `before_hold` (rows,) [s] is the time T - s from each row of the loading to its end, and `depth` (rows,) [mm] is the
    depth in this row. The integral in `fit_relaxation` is evaluated by the midpoint rule.
    """
    elastic_force = depth**POINT_CONTACT / depth[-1] ** POINT_CONTACT  # n, the fraction of the final force [1]
    midpoints = 0.5 * (before_hold[1:] + before_hold[:-1])
    return [float(np.exp(-midpoints / arm.time.value) @ np.diff(elastic_force)) for arm in arms]


def _fit_arms(t: Floats, force: Floats) -> tuple[float, list[RelaxationArm]]:
    """Fit a sum of exponentials to the forces [N] of a hold, with the number of arms that the data determine.

    `t` [s] is the time since the start of the hold; both arrays have the shape (rows,). Returns the final force F_inf
    [N] and the arms, the fastest first. The shares of these arms are still the amplitudes A_i [N], not fractions of the
    force. Schwarz's criterion chooses the number of arms, among the fits in which every amplitude exceeds its error.
    """
    # Without arms, the fit is the mean force, its only parameter.
    final_force = float(force.mean())
    arms: list[RelaxationArm] = []
    best_criterion = _schwarz_criterion(force - final_force, 1)
    step = float(np.median(np.diff(t)))
    for count in range(1, MOST_ARMS + 1):
        fitted = _fit_exponentials(t, force, count, step)
        if fitted is None:
            continue
        parameters, covariance = fitted
        criterion = _schwarz_criterion(force - _relaxing_force(t, *parameters), len(parameters))
        errors = COVERAGE * np.sqrt(np.diag(covariance))
        amplitude_indices = slice(1, 1 + count)  # the parameters are F_inf, all A_i, and all ln tau_i
        are_significant = (parameters[amplitude_indices] > errors[amplitude_indices]).all()
        if criterion < best_criterion and are_significant:
            best_criterion = criterion
            final_force = float(parameters[0])
            arms = _arms_of_fit(parameters, errors, count)
    return final_force, arms


def _arms_of_fit(parameters: Floats, errors: Floats, count: int) -> list[RelaxationArm]:
    """Return the `count` arms of a fit, the fastest first; their shares are still the amplitudes A_i [N].

    `parameters` are the parameters of `_relaxing_force`: F_inf, all amplitudes A_i, and the logarithms of all time
    constants tau_i. `errors` are their errors at 95 %.
    """
    amplitudes = parameters[1 : 1 + count]
    amplitude_errors = errors[1 : 1 + count]
    taus = np.exp(parameters[1 + count :])
    tau_errors = taus * errors[1 + count :]  # the relative error of tau is the error of its logarithm
    arms = []
    for i in np.argsort(taus).tolist():
        share = Estimate(float(amplitudes[i]), float(amplitude_errors[i]), "N")
        time = Estimate(float(taus[i]), float(tau_errors[i]), "s")
        arms.append(RelaxationArm(share=share, time=time))
    return arms


def _fit_exponentials(t: Floats, force: Floats, count: int, step: float) -> tuple[Floats, Floats] | None:
    """Fit a constant force and `count` decaying exponentials to the forces (rows,) [N] at the times `t` (rows,) [s].

    `step` [s] is the typical time between two rows; the time constants lie between it and the duration of the hold.
    Returns the parameters of `_relaxing_force` and their covariance, or None if the data do not determine them.
    """
    # Initial guess: equal amplitudes, and time constants at equal ratios between one time step and the whole hold.
    longest = t[-1]
    shortest = max(step, _LEAST_TIME_FRACTION * longest)
    guessed_times = np.geomspace(shortest, longest, count + 2)[1:-1]  # without the two bounds
    guessed_amplitude = max(force[0] - force[-1], 0.0) / count + _LEAST_AMPLITUDE_N
    initial_guess = [force[-1], *[guessed_amplitude] * count, *np.log(guessed_times)]
    lower = [-np.inf] + [0.0] * count + [np.log(shortest)] * count
    upper = [np.inf] * (1 + count) + [np.log(longest)] * count
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", OptimizeWarning)  # SciPy only warns if the covariance is undetermined
            parameters, covariance = curve_fit(
                _relaxing_force, t, force, initial_guess, bounds=(lower, upper), max_nfev=_MOST_EVALUATIONS
            )
    except (RuntimeError, OptimizeWarning):
        return None
    return parameters, covariance


def _relaxing_force(t: Floats, final_force: float, *parameters: float) -> Floats:
    """Return the force F_inf + sum A_i exp(-t / tau_i) [N] at the times `t` [s].

    `final_force` is F_inf [N]. `parameters` are all amplitudes A_i [N], followed by the logarithms of all tau_i [s].
    """
    count = len(parameters) // 2  # number of arms
    amplitudes = np.array(parameters[:count])
    rates = np.exp(-np.array(parameters[count:]))  # 1 / tau_i [1/s]
    return np.asarray(final_force + np.exp(-np.outer(t, rates)) @ amplitudes)


def _schwarz_criterion(residuals: Floats, parameters: int) -> float:
    """Return Schwarz's criterion (BIC) of a fit with a number of `parameters`; the best fit has the smallest value.

    `residuals` (rows,) [N] are the measured minus the fitted forces. G. Schwarz, Ann. Statist. 6 (1978) 461,
    doi:10.1214/aos/1176344136.
    """
    count = len(residuals)
    mean_square = max(float(np.mean(residuals**2)), np.finfo(np.float64).tiny)  # so that its logarithm is finite
    return count * math.log(mean_square) + parameters * math.log(count)
