"""Readings of flesh that relaxes: E at the first instant by the relaxation of the design, and how far it relaxes.

By what the forces were until then elastic flesh that was entered as far would answer with other ones: those tell E,
whatever the speed of the press was.
"""

import math
from dataclasses import replace

import numpy as np

from cad.arrays import Floats
from cad.theory.contrast_law import ContrastLaw, ReadingError, pair_law, ratio_modulus
from cad.theory.contrast_rise import RiseError, RiseLaw
from cad.theory.relaxation import Relaxation
from pipeline.measure.unit.contrast_press import contrast_reading
from pipeline.measure.unit.fruit_reading import FruitReading, checked_reading
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.seating import SeatedPress
from solve.contact.relaxing import Memory

LATE = 0.95  # of the hold: at its end the sensor may already be on its way out


class RelaxingPress:
    """One press of flesh that relaxes, and its hold, in a memory that does not grow.

    Moments count from the deepest sample, which is when the press stops.
    """

    def __init__(self, sensor: MeasuringUnit, relaxation: Relaxation, lag: int = 1) -> None:
        """Begin a press; `lag` is from how many samples before noise is independent."""
        design = sensor.design
        stop = design.stop_s
        self._sensor = sensor
        self._memory = Memory(relaxation)
        self._moments = (0.0, design.read_s - stop, LATE * (design.release_s - stop))
        self._found: dict[float, Floats] = {}  # forces at the moments and those of elastic flesh, (2, tips) [N]
        self._before: tuple[float, Floats] | None = None
        self._largest = 0.0
        self._stop = 0.0
        self._pair = SeatedPress(sensor, _pair_over_time(sensor), beside=2, lag=lag) if sensor.is_pair else None

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
        if self._pair is not None:
            self._pair.add(both.ravel())

    def reading(self, press: FruitReading) -> FruitReading:
        """Return what the press tells, of a pair with the uncertainty of its `press` read as elastic.

        E is that at the first instant, beside it the apparent one at the chosen moment. The relaxation is the apparent
        modulus late in the hold over that at the stop [1], None where the press ended before.
        """
        stop, at, late = self._moments
        if at not in self._found:
            return FruitReading(flags=("released_early",))
        sensor = self._sensor
        forces, elastic = self._found[at]
        lead = 0.0
        if self._pair is not None:
            if press.E is None or press.u is None:
                return press
            try:
                _, found = self._pair.reading()
            except RiseError as error:
                return FruitReading(flags=(error.flag,))
            lead = found.offset
            reading = checked_reading(sensor, sensor.rise_corrected(found.E), press.u, forces, lead=lead)
            reading = replace(reading, samples=press.samples, noise=press.noise)
            if "too_fast" in press.flags:
                reading = reading.flagged("too_fast")
        else:
            law = sensor.law
            bent = np.array(law.C) @ (forces - elastic)  # springs are bent by the forces that there are
            reading = contrast_reading(sensor, replace(law, gaps=tuple((law.gaps + bent).tolist())), elastic)
        apparent = {moment: self._apparent(lead, both[0]) for moment, both in self._found.items()}
        reading = replace(reading, others={"apparent": apparent[at]})
        return replace(reading, relaxation=apparent[late] / apparent[stop]) if late in apparent else reading

    def _apparent(self, lead: float, forces: Floats) -> float:
        """Return the modulus [MPa] that forces [N] tell as if the flesh were elastic; nan where they tell none.

        The high tip of a pair stands before the low one by a lead [mm].
        """
        sensor = self._sensor
        if not sensor.is_pair:
            reading = contrast_reading(sensor, sensor.law, forces)
            return math.nan if reading.E is None else reading.E
        try:
            return ratio_modulus(sensor.C, sensor.own_less_other, forces.tolist(), lead)
        except ReadingError:
            return math.nan


def _pair_over_time(sensor: MeasuringUnit) -> RiseLaw:
    """Return the law of a pair whose channels are its forces, which bend the springs, and those of elastic flesh."""
    contrast = pair_law(sensor.C, sensor.own_less_other)
    still = np.zeros((2, 2))
    law = ContrastLaw(
        weights=contrast.weights * 2,
        gaps=contrast.gaps * 2,
        C=np.block([[np.array(contrast.C), still], [still, still]]).tolist(),
        S=np.block([[still, still], [still, np.array(contrast.S)]]).tolist(),
    )
    return RiseLaw(contrast=law)
