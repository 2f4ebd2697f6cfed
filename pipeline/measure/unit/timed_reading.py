"""Readings of flesh that relaxes: E at the first instant by the relaxation of the design, and how far it relaxes.

By what the forces were until then elastic flesh that was entered as far would answer with other ones: those tell E,
whatever the speed of the press was.
"""

import math
from dataclasses import replace
from functools import reduce

import numpy as np

from cad.arrays import Floats
from cad.theory.contrast_law import ContrastLaw
from cad.theory.pair_line import PressSums
from cad.theory.relaxation import Relaxation
from pipeline.measure.unit.contrast_press import contrast_reading
from pipeline.measure.unit.fruit_reading import FruitReading, checked_reading
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.pair_press import Blocks
from solve.contact.relaxing import Memory

LATE = 0.95  # of the hold: at its end the sensor may already be on its way out
SEATED = 0.25  # of the deepest: from there on the faces of a pair are seated


class RelaxingPress:
    """One press of flesh that relaxes, and its hold, in a memory that does not grow.

    Moments count from the deepest sample, which is when the press stops.
    """

    def __init__(self, sensor: MeasuringUnit, relaxation: Relaxation) -> None:
        """Begin a press."""
        design = sensor.design
        stop = design.stop_s
        self._sensor = sensor
        self._memory = Memory(relaxation)
        self._moments = (0.0, design.read_s - stop, LATE * (design.release_s - stop))
        self._found: dict[float, Floats] = {}  # forces at the moments and those of elastic flesh, (2, tips) [N]
        self._before: tuple[float, Floats] | None = None
        self._largest = 0.0
        self._stop = 0.0
        self._line = Blocks()

    def add(self, t: float, forces: Floats) -> None:
        """Take the forces of the next sample [N] and its time [s]."""
        t_before, before = self._before or (t, np.array([forces, forces]))
        elastic = forces
        if t > t_before:
            fresh, lost = self._memory.step(np.array([t - t_before]))
            elastic = ((forces + lost) / fresh)[0]
        self._memory.keep(elastic)
        both = np.array([forces, elastic])
        if forces.sum() > self._largest:
            self._largest = float(forces.sum())
            self._stop = t
            self._found = {}
        for moment in self._moments:
            due = self._stop + moment
            if moment not in self._found and t >= due:
                part = (due - t_before) / (t - t_before) if t > t_before else 1.0
                self._found[moment] = before + part * (both - before)
        self._before = (t, both)
        if self._sensor.law is None and self._moments[-1] not in self._found:
            self._line.add(float(elastic[-1] - elastic[0]), self._deflection(forces))

    def reading(self, press: FruitReading) -> FruitReading:
        """Return what the press tells, of a pair with the uncertainty of its `press` read as elastic.

        E is that at the first instant, beside it the apparent one at the chosen moment. The relaxation is the apparent
        modulus late in the hold over that at the stop [1], None where the press ended before.
        """
        stop, at, late = self._moments
        if at not in self._found:
            return FruitReading(flags=("released_early",))
        law = self._sensor.law
        lead = 0.0
        if law is None:
            if press.E is None or press.u is None:
                return press
            slope, lead = self._slope_and_lead()
            E = self._sensor.own_less_other / slope
            reading = checked_reading(self._sensor, E, press.u, self._found[at][0], lead=lead)
            reading = replace(reading, samples=press.samples, noise=press.noise)
        else:
            forces, elastic = self._found[at]
            bent = np.array(law.C) @ (forces - elastic)  # springs are bent by the forces that there are
            reading = contrast_reading(self._sensor, replace(law, gaps=tuple((law.gaps + bent).tolist())), elastic)
        apparent = {moment: self._apparent(law, lead, both[0]) for moment, both in self._found.items()}
        reading = replace(reading, others={"apparent": apparent[at]})
        return replace(reading, relaxation=apparent[late] / apparent[stop]) if late in apparent else reading

    def _deflection(self, forces: Floats) -> float:
        """Return by how much farther the low spring of a pair is bent than the high one [mm]."""
        return float(np.subtract(self._sensor.C[0], self._sensor.C[1]) @ forces)

    def _slope_and_lead(self) -> tuple[float, float]:
        """Return the slope [mm/N] and the lead [mm] of the line of a pair, straight over elastic forces."""
        deepest = max(block.stiff for block in self._line.sums)
        sums = reduce(PressSums.joined, [block for block in self._line.sums if block.stiff > SEATED * deepest])
        slope = sums.soft_stiff / sums.soft_soft
        return slope, sums.stiff - slope * sums.soft

    def _apparent(self, law: ContrastLaw | None, lead: float, forces: Floats) -> float:
        """Return the modulus [MPa] that forces [N] tell as if the flesh were elastic; nan where they tell none.

        The high tip of a pair stands before the low one by a lead [mm].
        """
        if law is None:
            return self._sensor.own_less_other * float(forces[1] - forces[0]) / (self._deflection(forces) - lead)
        reading = contrast_reading(self._sensor, law, forces)
        return math.nan if reading.E is None else reading.E
