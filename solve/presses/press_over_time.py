"""Presses as a function of time, on viscoelastic flesh that relaxes, with springs that creep.

**Flesh.** While contacts grow, the forces follow from presses on elastic flesh: E. H. Lee, J. R. M. Radok, J. Appl.
Mech. 27 (1960) 438. Let n be the forces that elastic flesh would require for the same indentations. Then the forces are
F = n - sum g_i m_i, where tau_i dm_i/dt = n - m_i.

**Springs.** A spring of Kelvin elements deflects by d = (a_0 F + sum a_i m_i) / K, where tau_i dm_i/dt = F - m_i.

The loads n and F are assumed to be linear between samples, so that the history variables m_i are integrated exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from sensor.arrays import Floats
from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes
from solve.presses.pressing import CELLS, Pressing, Slope

Arms = Sequence[tuple[float, float]]
"""The arms of a viscoelastic law: pairs of a coefficient g_i or a_i [1] and a time constant tau_i [s]."""

_LOG_TIME_CONSTANTS = np.arange(-3.0, 6.5, 0.5)  # log10 of the time constants of Kelvin elements [s]
_ALLOWED_DECREASE = 1e-3  # relative decrease of an elastic force up to which the contact is still treated as growing


class _Memory:
    """The history variables m_i of the arms of a viscoelastic law, under forces [N] that are linear between samples.

    At the end of a time step, sum g_i m_i is a known part plus a factor times the forces, which are not yet known.
    `begin_step` returns the factor and the known part. Once the forces are solved, `end_step` updates m_i.
    """

    def __init__(self, arms: Arms, tips: int) -> None:
        """Start with all m_i and all forces equal to 0."""
        # The array is reshaped, because without arms it would have no second axis.
        self.coefficients, self.times = np.array(arms, dtype=np.float64).reshape(-1, 2).T
        self.variables = np.zeros((len(self.times), tips))  # m_i
        self.last_forces = np.zeros(tips)

    def begin_step(self, step: float) -> tuple[float, Floats]:
        """Return c [1] and k (tips,) [N], for which sum g_i m_i = c F + k at the end of a time `step` [s].

        The sum is over the arms of the law, with their coefficients g_i and their history variables m_i. F are the
        forces at the end of the step, which are not yet known. An arm with x = step / tau decays by exp(-x), and its
        mean decay over the step is (1 - exp(-x)) / x. The terms of each arm are kept for `end_step`.
        """
        decay = np.exp(-step / self.times)
        # For a step of 0, the mean decay is 1, and the lower bound only avoids the division 0 / 0.
        mean_decay = np.where(step > 0.0, (1.0 - decay) / np.maximum(step / self.times, 1e-12), 1.0)
        self._known = decay[:, None] * self.variables + (mean_decay - decay)[:, None] * self.last_forces
        self._factors = 1.0 - mean_decay
        return float(self.coefficients @ self._factors), np.asarray(self.coefficients @ self._known)

    def end_step(self, forces: Floats) -> None:
        """Update m_i, given the forces (tips,) [N] at the end of the step."""
        self.variables = self._known + self._factors[:, None] * forces
        self.last_forces = forces


def fit_kelvin_elements(exponent: float, at_s: float) -> tuple[float, Arms]:
    """Return the Kelvin elements, a_0 and arms (a_i, tau_i), of the creep compliance (t / at_s) ** exponent [1].

    The elements are fitted to this power law for times t from a millisecond to a week. `at_s` [s] is the time at which
    the creep compliance is 1. For PETG, whose exponent is 0.01, the error of the fit is below 0.1 %.
    """
    if exponent == 0.0:  # an elastic spring
        return 1.0, ()
    t = np.geomspace(1e-3, 6e5, 200)  # from a millisecond to a week [s]
    time_constants = 10.0**_LOG_TIME_CONSTANTS
    # The columns are the instantaneous deflection, and the creep of one Kelvin element each.
    columns = np.column_stack([np.ones(len(t)), 1.0 - np.exp(-t[:, None] / time_constants)])
    # The least squares are nonnegative, because a Kelvin element cannot have a negative compliance.
    compliances, _ = nnls(columns, (t / at_s) ** exponent)
    return float(compliances[0]), tuple(zip(compliances[1:].tolist(), time_constants.tolist(), strict=True))


@dataclass(frozen=True, kw_only=True)
class PressMotionOverTime:
    """The motion of a sensor: its travel [mm] since the first touch, at the given times [s].

    The slope of the sensor changes by `drift` [1] along x and y, in proportion to the travel.
    """

    travels: Sequence[float] | Floats
    times: Sequence[float] | Floats
    drift: Slope = (0.0, 0.0)


class _CreepingPress:
    """A press on flesh that relaxes, with springs that creep, which is advanced from sample to sample."""

    def __init__(self, pressing: Pressing, flesh: Arms, creep: tuple[float, Arms]) -> None:
        """Start before the first sample, without forces. The arguments are those of `press_with_creep`."""
        self.pressing = pressing
        tips = len(pressing.sensor.K)
        self.instantaneous_compliance, creep_arms = creep
        self.flesh_memory = _Memory(flesh, tips)
        self.spring_memory = _Memory(creep_arms, tips)
        self.elastic: Floats = np.zeros(tips)  # the forces n that elastic flesh would require [N]

    def advance(self, travel: float, step: float, changed_slope: Slope) -> tuple[Floats, Floats]:
        """Press to a travel [mm] within a time `step` [s], and return the forces [N] and spring deflections [mm].

        Both results have the shape (tips,). The slope of the sensor has changed by `changed_slope` [1] since the first
        touch. Raises ArithmeticError like `press_with_creep`.
        """
        K = self.pressing.sensor.K
        # At the end of this step, F = force_factor n - relaxed and d = (compliance_factor F + crept) / K.
        relaxation_factor, relaxed = self.flesh_memory.begin_step(step)
        creep_factor, crept = self.spring_memory.begin_step(step)
        force_factor = 1.0 - relaxation_factor
        compliance_factor = self.instantaneous_compliance + creep_factor
        # So d is the deflection of an elastic spring under the force n with a modified compliance, minus a deflection
        # that has recovered. An elastic solve with such springs therefore gives n.
        self.pressing.spring_compliance = compliance_factor * force_factor / K
        self.pressing.recovered = (compliance_factor * relaxed - crept) / K
        elastic = self.pressing.forces(travel, changed_slope)
        if self.flesh_memory.times.size:  # the flesh relaxes
            _check_growth(self.elastic, elastic, travel)
        self.elastic = elastic
        force = np.maximum(force_factor * elastic - relaxed, 0.0)  # a dome cannot pull on the fruit
        self.flesh_memory.end_step(elastic)
        self.spring_memory.end_step(force)
        return force, (compliance_factor * force + crept) / K


def press_with_creep(
    pressing: Pressing, motion: PressMotionOverTime, flesh: Arms = (), creep: tuple[float, Arms] = (1.0, ())
) -> tuple[Floats, Floats]:
    """Return the forces on the domes [N] and the deflections of their springs [mm], both (samples, tips).

    `pressing` is the sensor on the fruit before the press, and is pressed further with each sample of the `motion`.
    `flesh` holds the arms (g_i, tau_i) of the flesh, which is elastic without arms. `creep` holds the Kelvin elements
    of the springs, as returned by `fit_kelvin_elements`. By default, the springs do not creep. Raises ArithmeticError
    if a contact cannot be solved, or if an elastic force decreases on flesh that relaxes. The law of Lee and Radok does
    not hold for such shrinking contacts.
    """
    creeping_press = _CreepingPress(pressing, flesh, creep)
    last_travel = max(motion.travels)
    forces = []
    deflections = []
    time_steps = np.diff(motion.times, prepend=motion.times[0])  # the step to the first sample is 0
    for travel, step in zip(motion.travels, time_steps, strict=True):
        changed_slope = np.multiply(motion.drift, travel / last_travel)
        force, deflection = creeping_press.advance(travel, step, changed_slope)
        forces.append(force)
        deflections.append(deflection)
    return np.array(forces), np.array(deflections)


def _check_growth(previous_elastic: Floats, elastic: Floats, travel: float) -> None:
    """Raise ArithmeticError if an elastic force [N] has decreased since the previous sample, as in a shrinking contact.

    Both arrays have shape (tips,). `travel` [mm] is the travel of the current sample.
    """
    if (elastic < previous_elastic * (1.0 - _ALLOWED_DECREASE)).any():
        msg = (
            f"The elastic force on a dome decreases at a travel of {travel:.3g} mm, although the flesh relaxes. "
            "Use increasing travels."
        )
        raise ArithmeticError(msg)


def press_over_time(
    sensor: SprungDomes,
    fruit: EllipsoidFruit,
    travels: Sequence[float] | Floats,
    times: Sequence[float] | Floats,
    arms: Arms,
    cells: int = CELLS,
) -> Floats:
    """Return the forces on the domes [N], shape (samples, tips), on flesh that relaxes, with elastic springs.

    `travels` (samples,) [mm] are measured from the first touch, at the `times` (samples,) [s]. `arms` are the arms
    (g_i, tau_i) of the flesh. `cells` is the number of cells per side of the contact grid under each dome. Raises
    ArithmeticError like `press_with_creep`.
    """
    motion = PressMotionOverTime(travels=travels, times=times)
    forces, _ = press_with_creep(Pressing(sensor, fruit, cells), motion, arms)
    return forces
