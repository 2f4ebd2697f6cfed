"""Readings of flesh that relaxes: E at the first instant by the forces of the chosen moment, and how far it relaxes.

Moments count from the deepest sample, which is when the press stops.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial, reduce

import numpy as np
from numpy.typing import NDArray

from cad.quantity import COVERAGE
from cad.theory.pair_line import PressSums
from cad.theory.relaxation import Relaxation
from pipeline.measure.unit.fruit_reading import FruitReading, checked_reading, contrast_reading
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.pair_press import Blocks, single_reading
from pipeline.report.stored import StoredRelaxation

Floats = NDArray[np.float64]

LATE = 0.95  # of the hold: at its end the sensor may already be on its way out
SEATED = 0.25  # of the deepest: from there on the faces of a pair are seated


class HeldForces:
    """Forces of a press [N] at moments after its deepest sample [s], between samples as they come."""

    def __init__(self, moments: Sequence[float]) -> None:
        """Begin a press."""
        self._moments = moments
        self._largest = 0.0
        self._stop = 0.0
        self._before: tuple[float, Floats] | None = None
        self.found: dict[float, Floats] = {}
        self.longest_step = 0.0

    def add(self, t: float, forces: Floats) -> None:
        """Take the next sample."""
        if forces.sum() > self._largest:
            self._largest = float(forces.sum())
            self._stop = t
            self.found = {}
        t_before, forces_before = self._before or (t, forces)
        self.longest_step = max(self.longest_step, t - t_before)
        for moment in self._moments:
            due = self._stop + moment
            if moment not in self.found and t >= due:
                part = (due - t_before) / (t - t_before) if t > t_before else 1.0
                self.found[moment] = forces_before + part * (forces - forces_before)
        self._before = (t, forces)


class ElasticForces:
    """What elastic flesh that was entered as far would answer with, by the forces of flesh that relaxes.

    The memory of each arm follows tau dm/dt = n - m, n straight between samples: `solve/contact/relaxing.py`.
    """

    def __init__(self, relaxation: Relaxation) -> None:
        """Begin a press."""
        self._shares = np.array(relaxation.shares)[:, None]
        self._times = np.array(relaxation.times)[:, None]
        self._memory: Floats | float = 0.0
        self._before: tuple[float, Floats] | None = None

    def of(self, t: float, forces: Floats) -> Floats:
        """Return the elastic forces [N] at the time [s] of the next sample."""
        elastic = forces
        if self._before is not None and t > self._before[0]:
            step = (t - self._before[0]) / self._times
            decay = np.exp(-step)
            mean = -np.expm1(-step) / step
            kept = decay * self._memory + (mean - decay) * self._before[1]
            fresh = 1.0 - float((self._shares * (1.0 - mean)).sum())
            elastic = (forces + (self._shares * kept).sum(axis=0)) / fresh
            self._memory = kept + (1.0 - mean) * elastic
        self._before = (t, elastic)
        return elastic


class RelaxingPress:
    """One press of flesh that relaxes, and its hold, in a memory that does not grow."""

    def __init__(self, sensor: MeasuringUnit, relaxation: StoredRelaxation) -> None:
        """Begin a press."""
        self._sensor = sensor
        self._relaxation = relaxation
        stop = relaxation.stop_s
        self._moments = (0.0, relaxation.at_s - stop, LATE * (relaxation.t_s[-1] - stop))
        self._held = HeldForces(self._moments)
        self._elastic = ElasticForces(Relaxation(sensor.design.fruit.relaxation or ()))
        self._line = Blocks()

    def add(self, t: float, forces: Floats) -> None:
        """Take the forces of the next sample [N] and its time [s]."""
        self._held.add(t, forces)
        if self._sensor.law is None and self._moments[-1] not in self._held.found:
            elastic = self._elastic.of(t, forces)
            self._line.add(float(elastic[-1] - elastic[0]), self._deflection(forces))

    def reading(self, press: FruitReading) -> FruitReading:
        """Return what the press tells, of a pair with the uncertainty of its `press` read as elastic.

        E is that at the first instant, beside it the apparent one at the chosen moment. The relaxation is the apparent
        modulus late in the hold over that at the stop [1], None where the press ended before.
        """
        stop, at, late = self._moments
        found = self._held.found
        if at not in found:
            return FruitReading(flags=("released_early",))
        sensor = self._sensor
        if sensor.law is None:
            if press.E is None or press.u is None:
                return press
            slope, lead = self._slope_and_lead()
            read: Callable[[Floats], float] = partial(self._pair_modulus, lead)
            tilt = sensor.pair_tilt_deg(lead)
            E = sensor.own_less_other / slope
            direction = 0.0 if tilt >= 0.0 else 180.0
            reading = checked_reading(sensor, E, press.u, found[at], tilt=abs(tilt), direction=direction)
            reading = replace(reading, others={"apparent": read(found[at])})
        else:
            read = self._contrast_modulus
            reading = contrast_reading(sensor, sensor.law, found[at])
            reading = at_first_instant(sensor, self._relaxation, reading, found[at], self._held.longest_step)
        return replace(reading, relaxation=read(found[late]) / read(found[stop])) if late in found else reading

    def _deflection(self, forces: Floats) -> float:
        """Return by how much farther the low spring of a pair is bent than the high one [mm]."""
        return float(np.subtract(self._sensor.C[0], self._sensor.C[1]) @ forces)

    def _slope_and_lead(self) -> tuple[float, float]:
        """Return the slope [mm/N] and the lead [mm] of the line of a pair, straight over elastic forces."""
        deepest = max(block.stiff for block in self._line.sums)
        sums = reduce(PressSums.joined, [block for block in self._line.sums if block.stiff > SEATED * deepest])
        slope = sums.soft_stiff / sums.soft_soft
        return slope, sums.stiff - slope * sums.soft

    def _pair_modulus(self, lead: float, forces: Floats) -> float:
        """Return the apparent modulus [MPa] that forces of a pair with a lead [mm] tell."""
        return self._sensor.own_less_other * float(forces[1] - forces[0]) / (self._deflection(forces) - lead)

    def _contrast_modulus(self, forces: Floats) -> float:
        """Return the apparent modulus [MPa] that forces tell by their contrast; nan where they tell none."""
        reading = reading_as_elastic(self._sensor, forces)
        return math.nan if reading.E is None else reading.E


def reading_as_elastic(sensor: MeasuringUnit, forces: Floats) -> FruitReading:
    """Return what one reading tells as if the flesh were elastic: forces [N] in the order of the tips."""
    return single_reading(sensor, forces) if sensor.law is None else contrast_reading(sensor, sensor.law, forces)


def at_first_instant(
    sensor: MeasuringUnit, relaxation: StoredRelaxation, reading: FruitReading, forces: Floats, step: float = 0.0
) -> FruitReading:
    """Return a reading with E at the first instant for the apparent one of the chosen moment, which stands beside it.

    The moment may be off by a `step` [s]: its deviation is that of a uniform distribution.
    """
    if reading.E is None or reading.u is None:
        return reading
    times = np.array(relaxation.t_s)
    is_held = times >= relaxation.stop_s
    now = int(np.argmin(np.abs(times[is_held] - relaxation.at_s)))
    E_log = np.log([row.E_MPa for row in relaxation.moduli])
    held = np.log(np.array([row.E_apparent_MPa for row in relaxation.moduli], dtype=np.float64)[:, is_held])
    fallen = float(np.interp(math.log(reading.E), held[:, now], held[:, now] - E_log))
    E = reading.E * math.exp(-fallen)
    rates = np.gradient(held, times[is_held], axis=1)  # [1/s]
    by_time = COVERAGE / math.sqrt(3.0) * step * float(np.abs(rates[:, now]).max())
    u = math.hypot(reading.u, by_time)
    told = checked_reading(sensor, E, u, forces, tilt=reading.tilt, direction=reading.direction)
    return replace(told, others={"apparent": reading.E})
