"""Flesh that relaxes: the forces that elastic flesh would answer with, and what a hold after the press tells.

Elastic flesh that was entered as far would answer with other forces. They and those that bend the springs tell the
modulus at the first instant, whatever the speed of the press was (`RiseLaw.over_time`). What the forces of one moment
tell, as if flesh were elastic, is an apparent modulus.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from instrument.press.fruit_reading import FruitReading
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.theory.contrast_law import ContrastLaw, ReadingError, read_modulus
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation

LATE = 0.95  # of the hold: at its end the sensor may already be on its way out


class RelaxingFlesh:
    """The flesh under the tips of a sensor, sample by sample, by the relaxation of the design."""

    def __init__(self, relaxation: Relaxation, least_forces: Floats) -> None:
        """Begin with the tips off; a force counts above its least one [N], (tips,)."""
        self._relaxation = relaxation
        self._least = least_forces
        self._lift()

    def _lift(self) -> None:
        self._memory = Memory(self._relaxation)
        self._before: float | None = None

    def channels(self, forces: Floats, t: float) -> Floats:
        """Return the forces of the sample at a time [s], then those of elastic flesh [N], (2 tips,).

        The time rises from sample to sample.
        """
        felt = np.where(forces > self._least, forces, 0.0)
        elastic = felt
        if not felt.any():
            self._lift()
        elif self._before is None:
            self._memory.keep(elastic)
            self._before = t
        else:
            fresh, lost = self._memory.step(np.array([t - self._before]))
            elastic = ((felt + lost) / fresh)[0]
            self._memory.keep(elastic)
            self._before = t
        return np.concatenate([forces, elastic])


class Hold:
    """The forces of a press at the moments of its hold, which count from its deepest sample."""

    def __init__(self, design: Design) -> None:
        """Begin a press."""
        stop = design.stop_s
        self._at, self._late = design.read_s - stop, LATE * (design.release_s - stop)
        self._found: dict[float, Floats] = {}  # forces at moments after the stop, (tips,) [N]
        self._before: tuple[float, Floats] | None = None
        self._largest = 0.0
        self._stop = 0.0

    def add(self, forces: Floats, t: float) -> None:
        """Take the forces of all tips [N] in the next sample and its time [s]."""
        t_before, before = self._before or (t, forces)
        if forces.sum() > self._largest:
            self._largest = float(forces.sum())
            self._stop = t
            self._found = {}
        for moment in (0.0, self._at, self._late):
            due = self._stop + moment
            if moment not in self._found and t >= due:
                part = (due - t_before) / (t - t_before) if t > t_before else 1.0
                self._found[moment] = before + part * (forces - before)
        self._before = (t, forces)

    def beside(
        self, reading: FruitReading, contrast: ContrastLaw, offset: float, stiffened: Callable[[float], float]
    ) -> FruitReading:
        """Return a reading with what its hold tells, by a contrast with an offset [mm].

        `stiffened` returns the stiffness of the springs, so long after the stop [s], over that of the weighing [1].

        These are the apparent modulus at the moment of the design, and the relaxation. That is the apparent modulus
        late in the hold over that at the stop [1], None where the press ended before. A press that ended before the
        moment of the design has no reading.
        """
        if self._at not in self._found:
            return FruitReading(flags=("released_early",))
        try:
            apparent = {
                moment: stiffened(moment) * read_modulus(contrast, F.tolist(), offset)
                for moment, F in self._found.items()
            }
        except ReadingError:
            return reading
        reading = replace(reading, others={**reading.others, "apparent": apparent[self._at]})
        if self._late not in apparent:
            return reading
        return replace(reading, relaxation=apparent[self._late] / apparent[0.0])
