"""A press that is summed from several forces on, so that its beginning can be left out afterwards.

A flat tip that leans touches with an edge first. It is seated, and its law is that of a flat tip, once it is pressed in
by its side times the lean. (K. L. Johnson, Contact Mechanics, 1985, 5.2. A tilted punch stays whole while M / F <
side/6). How far tips lean is known only when the press is over. So sums begin anew at loads that rise by a constant
factor, in a memory that does not grow. Those are read that begin when the tips are seated.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from instrument.press.measuring import MeasuringUnit
from sensor.arrays import Floats
from sensor.theory.contrast_rise import RiseError, RiseLaw, RiseReading, RisingPress, Samples

FACTOR = 1.25  # of one load over the one before
MOST_LOADS = 16
ROUNDS = 3  # of finding modulus and lean, and leaving out what is not seated at them


@dataclass(frozen=True, kw_only=True)
class Seating:
    """Loads, E times depth [N/mm], from which on a press is summed, and the forces of the tips there [N].

    Tips are seated at a load of E (per_offset |offset| + by_skin) of an offset [mm]. per_offset is side over spacing
    [1], by_skin the side times the slope of the skin [mm]. Tips without a flat face have one load alone.
    """

    loads: tuple[float, ...]
    least_forces: tuple[Floats, ...]
    per_offset: float = 0.0
    by_skin: float = 0.0

    def load(self, E: float, offset: float) -> int:
        """Return which load seats tips on flesh of E [MPa] at an offset [mm]: the last one where none does."""
        needed = E * (self.per_offset * abs(offset) + self.by_skin)
        return sum(load < needed for load in self.loads[:-1])


def seating_of(sensor: MeasuringUnit) -> Seating:
    """Return from which loads on the presses of a unit are summed."""
    tips = sensor.design.tips
    least = sensor.least_forces
    if not sensor.reads_moments:
        return Seating(loads=(0.0,), least_forces=(least,))
    per_load = 1.0 / np.diag(sensor.report.contact.compliance_per_mm)
    first = float((least / per_load).min())
    last = float((np.array(sensor.report.read_out.full_scale_N) / per_load).min())
    rising = [last / FACTOR**step for step in range(1, MOST_LOADS)]
    loads = [first, *(load for load in reversed(rising) if load > first)]
    return Seating(
        loads=tuple(loads),
        least_forces=(least, *(np.maximum(least, load * per_load) for load in loads[1:])),
        per_offset=tips.side_mm / tips.spacing_mm,
        by_skin=tips.side_mm * 0.5 * tips.spacing_mm / sensor.design.fruit.radii_mm[0],
    )


class SeatedPress:
    """One press, sample by sample: a `RisingPress` from each load of the seating on."""

    def __init__(self, sensor: MeasuringUnit, law: RiseLaw, *, lag: int = 1) -> None:
        """Begin a press; its channels are those of the law, the forces of the tips first.

        `lag` is from how many samples before noise is independent.
        """
        self._seating = seating_of(sensor)
        channels = len(law.contrast.weights)
        self._presses = []
        for forces in self._seating.least_forces:
            least = np.concatenate([forces, np.zeros(channels - len(forces))])
            self._presses.append(RisingPress(law, sensor.noises, least, lag=lag))

    def add(self, forces: Samples, elapsed: float | None = None) -> None:
        """Take the channels of the next sample: the forces of all tips [N] and what the law has behind them.

        What times do is told where the time elapsed since the sample before [s] is given.
        """
        for press in self._presses:
            press.add(forces, elapsed)

    @property
    def deepest(self) -> Floats:
        """Return the deepest sample."""
        return np.asarray(self._presses[0].deepest, dtype=np.float64)

    def reading(self) -> tuple[int, RiseReading]:
        """Return the load from which on the tips are seated, and the reading from there on; raises RiseError.

        Where none seats them, or too few samples are left, the last load that has a reading.
        """
        load, found = 0, self._presses[0].reading()
        for _ in range(ROUNDS):
            seated = self._seating.load(found.E, found.offset)
            if seated == load:
                break
            load, found = self.part(seated)
        return load, found

    def moduli_without(self, load: int, several: int) -> Iterator[float]:
        """Yield the modulus [MPa] from a load on, without each `several` samples in a row; nan where it has none."""
        return self._presses[load].moduli_without(several)

    def part(self, load: int) -> tuple[int, RiseReading]:
        """Return a load, or the last one before that has a reading, and the reading from there on; raises RiseError."""
        for earlier in range(load, 0, -1):
            try:
                return earlier, self._presses[earlier].reading(whole=False)
            except RiseError:
                continue
        return 0, self._presses[0].reading()
