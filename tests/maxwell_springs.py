"""Virtual prints: springs of generalised Maxwell material, integrated in small steps of time; no law of the product's.

The force of a spring is F = K (d - sum g_i m_i), with tau_i dm_i/dt = d - m_i (E. H. Lee, J. R. M. Radok, J. Appl.
Mech. 27 (1960) 438), by the trapezoidal rule.
"""

from dataclasses import dataclass, replace

import numpy as np
from measured_units import readings_at

from sensor.theory.contrast_law import ContrastLaw
from solve.contact.relaxing import elastic_forces

PETG = ((0.015, 0.3), (0.02, 3.0), (0.025, 30.0), (0.03, 300.0))
"""Shares and times [s] as of a glassy copolyester: 1.5 to 3 % of its stiffness in each decade, the more the later."""


@dataclass
class MaxwellSprings:
    """Springs of some stiffnesses at the first instant [N/mm], each with the same arms."""

    K: np.ndarray
    arms: tuple[tuple[float, float], ...] = PETG

    def __post_init__(self):
        self.shares, self.times = np.array(self.arms).T[:, :, None]
        self.m = np.zeros((len(self.arms), len(self.K)))
        self.d = np.zeros(len(self.K))

    def ahead(self, step):
        """Return c and h of d = c F / K + h after a step of time [s]."""
        a = 0.5 * step / self.times
        kept = ((1.0 - a) * self.m + a * self.d) / (1.0 + a)
        c = 1.0 / (1.0 - (self.shares * a / (1.0 + a)).sum(axis=0))
        return c, c * (self.shares * kept).sum(axis=0)

    def end(self, step, d):
        """End a step of time [s] with deflections [mm]."""
        a = 0.5 * step / self.times
        self.m = ((1.0 - a) * self.m + a * (self.d + d)) / (1.0 + a)
        self.d = d

    def load(self, F):
        """Load them at once by forces [N]."""
        self.d = self.d + F / self.K

    def hang(self, F, seconds, steps=2000):
        """Return the deflections [mm] under forces [N] that have hung for so long; early steps are short."""
        self.load(F)
        for step in np.diff(seconds * (np.arange(steps + 1) / steps) ** 3):
            c, h = self.ahead(step)
            self.end(step, c * F / self.K + h)
        return self.d


def weighed_stiffness(K, seconds=30.0):
    """Return the stiffnesses [N/mm] that weights tell after so long."""
    return np.ones(len(K)) / MaxwellSprings(K).hang(np.ones(len(K)), seconds)


def pressed(measured, E, duration, K, samples=60, steps=8):
    """Return times [s] and deflections [mm] of a press by hand on fruit of E [MPa], on springs K [N/mm] of Maxwell's.

    The contact is that of the closed law that reads a level press.
    """
    elastic = measured.measuring()
    law = elastic.rise_law.contrast
    if elastic.report.read_out.is_pair:
        S = measured.contact.at(E).S
        law = ContrastLaw(weights=(-1.0, 1.0), gaps=(0.0, 0.0), C=law.C, S=S.tolist())
    springs = MaxwellSprings(K)
    step = duration / samples / steps
    times, deflections = [0.0], [np.zeros(len(K))]
    for number in range(1, samples * steps + 1):
        c, h = springs.ahead(step)
        at = replace(law, C=np.diag(c / K).tolist(), gaps=tuple((np.array(law.gaps) + h).tolist()))
        x = measured.design.press.travel_mm * (1.0 - (1.0 - number / samples / steps) ** 2)
        (F,) = elastic_forces(at, np.array([elastic.uncorrected_modulus(E)]), np.array([min(law.gaps) + x]))
        springs.end(step, c * F / K + h)
        if number % steps == 0:
            times.append(number * step)
            deflections.append(springs.d)
    return np.array(times), np.array(deflections)


def read_by_command(sensor, times, forces, rest=0.5):
    """Return what the command reads of a log that begins and ends in the air [N], (samples, tips)."""
    air = np.zeros((10, forces.shape[1]))
    before = np.linspace(-rest, -rest / 10, 10)
    t = np.concatenate([before, times, times[-1] + rest + before + 0.1 * rest]) + rest
    (reading,) = readings_at(sensor, t, np.vstack([air, forces, air]))
    return reading
