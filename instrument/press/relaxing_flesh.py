"""The forces that elastic flesh would exert at the same indentation as flesh that relaxes.

From these forces and the forces on the springs, `RiseLaw.relaxing_law` reads the instantaneous modulus at any speed of
the press.
"""

import numpy as np

from sensor.arrays import Floats
from sensor.theory.flesh_memory import Memory
from sensor.theory.relaxation import Relaxation


class RelaxingFlesh:
    """The flesh under the tips of a sensor, which relaxes as the design states.

    The flesh remembers the forces of earlier samples, so the samples must be added one after the other.
    """

    def __init__(self, relaxation: Relaxation, least_forces: Floats) -> None:
        """Begin with the tips out of contact; forces up to `least_forces` (tips,) [N] are taken as zero."""
        self._relaxation = relaxation
        self._least = least_forces
        self._memory = Memory(relaxation)
        self._last_t: float | None = None

    def channels(self, forces: Floats, t: float) -> Floats:
        """Return the `forces` (tips,) [N] of a sample, followed by the forces (tips,) [N] of elastic flesh.

        The elastic forces are stored for the next sample. The time `t` [s] must increase from sample to sample. When
        all tips lift off, the flesh is assumed to recover fully.
        """
        contact_forces = np.where(forces > self._least, forces, 0.0)
        if not contact_forces.any():
            self._memory = Memory(self._relaxation)
            self._last_t = None
            return np.concatenate([forces, contact_forces])
        elastic_forces = contact_forces  # in the first sample in contact, nothing has relaxed yet
        if self._last_t is not None:
            # The measured force is fresh * elastic - lost. Here `fresh` depends on the time step, and `lost` also on
            # the elastic forces of earlier samples.
            fresh, lost = self._memory.step(np.array([t - self._last_t]))
            elastic_forces = ((contact_forces + lost) / fresh)[0]
        self._memory.keep(elastic_forces)
        self._last_t = t
        return np.concatenate([forces, elastic_forces])
