"""The forces with which elastic flesh would respond to the same indentation as flesh that relaxes.

Together with the forces on the springs they give the modulus at the first instant, for any speed of the press
(`RiseLaw.over_time`).
"""

import numpy as np

from sensor.arrays import Floats
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation


class RelaxingFlesh:
    """The flesh under the tips of a sensor, updated sample by sample with the relaxation of the design."""

    def __init__(self, relaxation: Relaxation, least_forces: Floats) -> None:
        """Begin with the tips out of contact; forces up to `least_forces` (tips,) [N] are taken as zero."""
        self._relaxation = relaxation
        self._least = least_forces
        self._memory = Memory(relaxation)
        self._last_t: float | None = None

    def channels(self, forces: Floats, t: float) -> Floats:
        """Return the forces of a sample (tips,), followed by the forces of elastic flesh [N]: (2 tips,) numbers.

        The time `t` [s] must rise from sample to sample. A lift of all tips is taken as a full recovery of the flesh.
        """
        contact_forces = np.where(forces > self._least, forces, 0.0)
        elastic = contact_forces
        if not contact_forces.any():
            self._memory, self._last_t = Memory(self._relaxation), None
            return np.concatenate([forces, contact_forces])
        if self._last_t is not None:
            fresh, lost = self._memory.step(np.array([t - self._last_t]))  # force = fresh elastic - lost
            elastic = ((contact_forces + lost) / fresh)[0]
        self._memory.keep(elastic)
        self._last_t = t
        return np.concatenate([forces, elastic])
