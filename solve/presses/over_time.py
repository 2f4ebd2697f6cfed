"""Presses over time: on flesh that relaxes, with growing contacts, and on springs that creep.

**Flesh.** Forces follow from presses on elastic flesh: E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438. Elastic
forces n cause the indentations, and the forces are F = n - sum g_i m_i, tau_i dm_i/dt = n - m_i.

**Springs.** A spring of Kelvin elements deflects by d = (a_0 F + sum a_i m_i) / K, tau_i dm_i/dt = F - m_i. Loads are
linear between samples, and integrated exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from sensor.arrays import Floats
from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes
from solve.presses.pressing import CELLS, Pressing, Slope

Arms = Sequence[tuple[float, float]]
"""Shares [1] and times [s]."""

_DECADES = np.arange(-3.0, 6.5, 0.5)  # log10 of the times of Kelvin elements [s]


class _Memory:
    """The memory of arms for the forces of tips [N], which are linear from one time to the next."""

    def __init__(self, arms: Arms, tips: int) -> None:
        """Start at rest."""
        self.shares, self.times = np.array(arms, dtype=np.float64).reshape(-1, 2).T
        self.kept = np.zeros((len(self.times), tips))  # m_i
        self.before = np.zeros(tips)

    def ahead(self, step: float) -> tuple[float, Floats]:
        """Return the factor of the forces at the end of a step [s] in the memory, and the part from before [N]."""
        decay = np.exp(-step / self.times)
        # The mean of the decay over the step.
        mean = np.where(step > 0.0, (1.0 - decay) / np.maximum(step / self.times, 1e-12), 1.0)
        self._from_before = decay[:, None] * self.kept + (mean - decay)[:, None] * self.before
        self._fresh = 1.0 - mean
        return float(self.shares @ self._fresh), np.asarray(self.shares @ self._from_before)

    def end(self, forces: Floats) -> None:
        """End the step with forces [N]."""
        self.kept = self._from_before + self._fresh[:, None] * forces
        self.before = forces


def creep_of(exponent: float, at_s: float) -> tuple[float, Arms]:
    """Return Kelvin elements whose compliance grows as a power of time, with this exponent [1], and is 1 at `at_s` [s].

    They are a_0 and the arms a_i, tau_i, fitted from a millisecond to a week, within a thousandth for the 0.01 of PETG.
    """
    if exponent == 0.0:
        return 1.0, ()
    t = np.geomspace(1e-3, 6e5, 200)
    taus = 10.0**_DECADES
    columns = np.column_stack([np.ones(len(t)), 1.0 - np.exp(-t[:, None] / taus)])
    found, _ = nnls(columns, (t / at_s) ** exponent)
    return float(found[0]), tuple(zip(found[1:].tolist(), taus.tolist(), strict=True))


@dataclass(frozen=True, kw_only=True)
class Way:
    """The motion of a sensor: travels [mm] from the first touch at times [s], while its slope grows by `drift` [1]."""

    travels: Sequence[float] | Floats
    times: Sequence[float] | Floats
    drift: Slope = (0.0, 0.0)


def pressed_over_time(
    pressing: Pressing, way: Way, flesh: Arms = (), creep: tuple[float, Arms] = (1.0, ())
) -> tuple[Floats, Floats]:
    """Return the forces of the domes [N] and the deflections of their springs [mm], both (samples, tips).

    `flesh` has shares g_i [1] and times tau_i [s], `creep` the elements of the springs as from `creep_of`. Raises
    ArithmeticError if elastic forces decrease on flesh that relaxes, because the law does not hold for shrinking
    contacts.
    """
    K = pressing.sensor.K
    of_flesh, of_springs = _Memory(flesh, len(K)), _Memory(creep[1], len(K))
    last = max(way.travels)
    forces, deflections = [], []
    elastic = np.zeros(len(K))
    for travel, step in zip(way.travels, np.diff(way.times, prepend=way.times[0]), strict=True):
        relaxed, lost = of_flesh.ahead(step)
        crept, sunk = of_springs.ahead(step)
        fresh, soft = 1.0 - relaxed, creep[0] + crept
        pressing.give, pressing.recovered = soft * fresh / K, (soft * lost - sunk) / K
        before, elastic = elastic, pressing.forces(travel, np.multiply(way.drift, travel / last))
        if len(flesh) and (elastic < before * (1.0 - 1e-3)).any():
            raise ArithmeticError(travel)
        force = np.maximum(fresh * elastic - lost, 0.0)
        of_flesh.end(elastic)
        of_springs.end(force)
        forces.append(force)
        deflections.append((soft * force + sunk) / K)
    return np.array(forces), np.array(deflections)


def press_over_time(
    sensor: SprungDomes,
    fruit: EllipsoidFruit,
    travels: Sequence[float] | Floats,
    times: Sequence[float] | Floats,
    arms: Arms,
    cells: int = CELLS,
) -> Floats:
    """Return the forces of the domes on flesh that relaxes, at travels [mm] and times [s], (samples, tips) [N].

    `arms` are the shares and times of the flesh. The springs are elastic.
    """
    return pressed_over_time(Pressing(sensor, fruit, cells), Way(travels=travels, times=times), arms)[0]
