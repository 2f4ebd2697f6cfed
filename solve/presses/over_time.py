"""Presses on flesh that relaxes, in contacts that grow.

They follow from presses on elastic flesh: E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438. Elastic forces n
make the indentations, and the forces are n - sum g_i m_i, tau_i dm_i/dt = n - m_i.
"""

from collections.abc import Sequence

import numpy as np

from sensor.arrays import Floats
from solve.presses.bodies import EllipsoidFruit, SprungDomes
from solve.presses.pressing import CELLS, Pressing


def press_over_time(
    sensor: SprungDomes,
    fruit: EllipsoidFruit,
    travels: Sequence[float] | Floats,
    times: Sequence[float] | Floats,
    arms: Sequence[tuple[float, float]],
    cells: int = CELLS,
) -> Floats:
    """Return the forces of the domes on flesh that relaxes, at travels [mm] and times [s], (samples, tips) [N].

    `arms` are shares g_i [1] and times tau_i [s]. Elastic forces run straight from sample to sample. Raises
    ArithmeticError if they fall: contacts that shrink have no such forces.
    """
    pressing = Pressing(sensor, fruit, cells)
    shares, taus = np.array(arms).T
    kept = np.zeros((len(taus), len(sensor.K)))  # m_i
    elastic = np.zeros(len(sensor.K))
    found = []
    for travel, step in zip(travels, np.diff(times, prepend=times[0]), strict=True):
        decay = np.exp(-step / taus)
        mean = np.where(step > 0.0, (1.0 - decay) / np.maximum(step / taus, 1e-12), 1.0)  # of the decay over the step
        from_before = decay[:, None] * kept + (mean - decay)[:, None] * elastic
        fresh, lost = 1.0 - shares @ (1.0 - mean), shares @ from_before
        pressing.give, pressing.recovered = fresh / sensor.K, lost / sensor.K
        before, elastic = elastic, pressing.forces(travel)
        if (elastic < before * (1.0 - 1e-3)).any():
            raise ArithmeticError(travel)
        kept = from_before + (1.0 - mean)[:, None] * elastic
        found.append(np.maximum(fresh * elastic - lost, 0.0))
    return np.array(found)
