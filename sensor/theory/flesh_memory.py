"""The forces of flesh that relaxes, from the history variables m_i of its Prony series.

Let n be the force with which elastic flesh would resist the same indentation. The force F of flesh that relaxes is

    F(t) = n(t) - sum_i g_i m_i(t),    tau_i dm_i/dt = n - m_i.

See E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438, doi:10.1115/1.3644020.
"""

import numpy as np

from sensor.arrays import Floats
from sensor.theory.relaxation import Relaxation


class Memory:
    """The history variables m_i of the terms of a Prony series, for elastic forces n piecewise linear in time."""

    def __init__(self, relaxation: Relaxation) -> None:
        """Start without any previous force."""
        # The arrays below have the axes (terms, presses, tips). Before the first step, a number replaces such an array.
        self._shares = np.array(relaxation.shares)[:, None, None]
        self._times = np.array(relaxation.times)[:, None]  # (terms, 1), divided into the step of each press
        self._known_memory: Floats | float = 0.0  # the part of the next m_i that earlier forces determine
        self._mean_decay: Floats | float = 1.0
        self._memory: Floats | float = 0.0
        self._elastic: Floats | float = 0.0

    def step(self, seconds: Floats) -> tuple[Floats, Floats]:
        """Return `factor` and `loss` in F = factor n - loss, the forces of the flesh [N] at the end of a step.

        Here n are the elastic forces [N] at the end of the step. They need not be known yet; pass them to `keep`
        before the next step. `factor` [1], (presses, 1), is the part of n that has not relaxed.
        `loss` [N], (presses, tips) or (presses, 1), is the relaxation of earlier forces. `seconds` (presses,) is the
        duration of the step. Elastic forces are linear in time during a step, so each term of the series is integrated
        exactly. With x = step / tau_i and the mean decay c = (1 - exp(-x)) / x, the history variable at the end of the
        step is

            m_i = exp(-x) m_i(start) + (c - exp(-x)) n(start) + (1 - c) n.
        """
        duration = (seconds / self._times)[..., None]  # relative to the time constant tau_i of each term [1]
        decay = np.exp(-duration)
        self._mean_decay = np.divide(-np.expm1(-duration), duration, out=np.ones_like(duration), where=duration > 0.0)
        self._known_memory = decay * self._memory + (self._mean_decay - decay) * self._elastic
        factor = 1.0 - (self._shares * (1.0 - self._mean_decay)).sum(axis=0)
        loss = (self._shares * self._known_memory).sum(axis=0)
        return factor, loss

    def keep(self, elastic: Floats) -> None:
        """Store the elastic forces [N], (presses, tips), at the end of a step."""
        self._memory = self._known_memory + (1.0 - self._mean_decay) * elastic
        self._elastic = elastic
