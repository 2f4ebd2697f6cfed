"""The memory of earlier forces in flesh that relaxes. In each arm of its Prony series, tau_i dm_i/dt = n - m_i.

Here n is the force with which elastic flesh would resist the same indentation. The force of flesh that relaxes is then
F(t) = n(t) - sum g_i m_i(t): E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438, doi:10.1115/1.3644020.
"""

import numpy as np

from sensor.arrays import Floats
from sensor.theory.relaxation import Relaxation


class Memory:
    """The memory m_i of elastic forces n in each arm of a Prony series; n is piecewise linear in time."""

    def __init__(self, relaxation: Relaxation) -> None:
        """Start without any previous force."""
        self._shares = np.array(relaxation.shares)[:, None, None]
        self._times = np.array(relaxation.times)[:, None]
        self._kept: Floats | float = 0.0
        self._mean: Floats | float = 1.0
        self._memory: Floats | float = 0.0
        self._elastic: Floats | float = 0.0

    def step(self, seconds: Floats) -> tuple[Floats, Floats]:
        """Return `fresh` and `lost` in F = fresh n - lost, where n are the elastic forces [N] at the end of a step.

        `seconds` (presses,) is the duration of the step. `fresh` [1] has shape (presses, 1), and `lost` [N] has shape
        (presses, tips) or (presses, 1). Elastic forces are linear in time during a step, so each arm is integrated
        exactly.
        """
        step = (seconds / self._times)[..., None]  # duration divided by the time constant of each arm [1]
        decay = np.exp(-step)
        # mean of the decay during the step
        self._mean = np.divide(-np.expm1(-step), step, out=np.ones_like(step), where=step > 0.0)
        self._kept = decay * self._memory + (self._mean - decay) * self._elastic
        fresh = 1.0 - (self._shares * (1.0 - self._mean)).sum(axis=0)
        return fresh, (self._shares * self._kept).sum(axis=0)

    def keep(self, elastic: Floats) -> None:
        """Store the elastic forces [N] at the end of a step."""
        self._memory = self._kept + (1.0 - self._mean) * elastic
        self._elastic = elastic
