"""The memory of earlier forces in flesh that relaxes: tau dm/dt = n - m in each arm of its Prony series.

Let n be the forces with which elastic flesh would resist the same indentation. The forces of flesh that relaxes are
then F(t) = n(t) - sum g_i m_i(t): E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438, doi:10.1115/1.3644020.
"""

import numpy as np

from sensor.arrays import Floats
from sensor.theory.relaxation import Relaxation


class Memory:
    """The memory m of the elastic forces n in each arm, tau dm/dt = n - m, for n piecewise linear in time."""

    def __init__(self, relaxation: Relaxation) -> None:
        """Start without a force."""
        self._shares = np.array(relaxation.shares)[:, None, None]
        self._times = np.array(relaxation.times)[:, None]
        self._kept: Floats | float = 0.0
        self._mean: Floats | float = 1.0
        self._memory: Floats | float = 0.0
        self._elastic: Floats | float = 0.0

    def step(self, seconds: Floats) -> tuple[Floats, Floats]:
        """Return `fresh` and `lost` of F = fresh n - lost at the end of a step, with n the elastic forces there [N].

        `seconds` (presses,) is the duration of the step; `fresh` [1] has shape (presses, 1), `lost` [N] (presses, tips)
        or (presses, 1). Elastic forces are linear in time over a step, so each arm is integrated exactly.
        """
        step = (seconds / self._times)[..., None]  # over the time of each arm [1]
        decay = np.exp(-step)
        self._mean = np.divide(-np.expm1(-step), step, out=np.ones_like(step), where=step > 0.0)  # mean of the decay
        self._kept = decay * self._memory + (self._mean - decay) * self._elastic
        fresh = 1.0 - (self._shares * (1.0 - self._mean)).sum(axis=0)
        return fresh, (self._shares * self._kept).sum(axis=0)

    def keep(self, elastic: Floats) -> None:
        """End the step with elastic forces [N]."""
        self._memory = self._kept + (1.0 - self._mean) * elastic
        self._elastic = elastic
