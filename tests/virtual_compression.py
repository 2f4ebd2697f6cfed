"""A compression test of a ball of known modulus: what a testing machine would write of it, with its faults."""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats
from sensor.theory.hertz import force_factor

# F over Hertz's law of a ball between slippery plates, by the travel over the height: neo-Hooke at finite strain,
# nu 0.3, solved with finite elements that share nothing with the product, each to 0.3 %. Between them the ratio goes
# smoothly with the root of the travel, from 1 at the touch.
OVER_HERTZ = {0.01: 1.046, 0.02: 1.069, 0.05: 1.120, 0.10: 1.190}


def over_hertz(strain: Floats) -> Floats:
    """Return F over Hertz's law at travels over the height [1]."""
    roots = np.sqrt(list(OVER_HERTZ))
    powers = np.arange(1, 4)
    excess = np.array(list(OVER_HERTZ.values())) - 1.0
    coefficients, *_ = np.linalg.lstsq(roots[:, None] ** powers, excess)
    return 1.0 + np.sqrt(strain)[:, None] ** powers @ coefficients


def true_force(E: float, travel: Floats, radius: float = 35.0, poisson: float = 0.3) -> Floats:
    """Return the force [N] on a ball of a modulus [MPa] at travels of plates towards each other [mm]."""
    stiffness = force_factor(E / (1.0 - poisson**2), radius / 8.0)  # each side takes half of the travel
    return stiffness * travel**1.5 * over_hertz(travel / (2.0 * radius))


@dataclass(frozen=True, kw_only=True)
class VirtualTest:
    """A ball between two plates at finite strain, and what a machine adds.

    The plate first travels `gap_mm`. Then the skin settles: the ball yields `toe_mm` more than its law, most of it
    before `toe_share` of the force at failure. At `failure_strain` of the height, 2 `radius_mm`, the flesh breaks. The
    load cell shows `offset_N`, `drift_N_per_mm` of the travel, and noise with a standard deviation of `noise_percent`
    of the force at failure.
    """

    E_MPa: float = 2.0
    poisson: float = 0.3
    radius_mm: float = 35.0
    gap_mm: float = 0.8
    toe_mm: float = 0.15
    toe_share: float = 0.03
    failure_strain: float = 0.07
    offset_N: float = 0.3
    drift_N_per_mm: float = 0.0
    noise_percent: float = 1.0
    rows: int = 600
    seed: int = 1

    @property
    def first_touch_mm(self) -> float:
        """Return the travel at which the law begins, the settling of the skin left out [mm]."""
        return self.gap_mm + self.toe_mm

    def curve(self) -> tuple[Floats, Floats]:
        """Return travel [mm] and force [N], shape (rows,) each, even in the travel."""
        depth = np.linspace(0.0, self.failure_strain * 2.0 * self.radius_mm, 4000)
        force = true_force(self.E_MPa, depth, self.radius_mm, self.poisson)
        strongest = force[-1]
        settled = self.toe_mm * (1.0 - np.exp(-force / (self.toe_share * strongest)))
        travelled = self.gap_mm + depth + settled
        # Broken flesh: the force drops by 30 % within 0.3 mm and rises a little after.
        broken = travelled[-1] + np.array([0.3, 1.5])
        travel = np.linspace(0.0, broken[-1], self.rows)
        left = strongest * np.array([0.7, 0.77])
        exact = np.interp(travel, np.append(travelled, broken), np.append(force, left))
        noise = np.random.default_rng(self.seed).normal(0.0, 0.01 * self.noise_percent * strongest, self.rows)
        return travel, exact + self.offset_N + self.drift_N_per_mm * travel + noise

    def csv(self) -> str:
        """Return the test as a file of two columns, `travel_mm,force_N`."""
        rows = zip(*self.curve(), strict=True)
        return "travel_mm,force_N\n" + "".join(f"{x:.5f},{F:.5f}\n" for x, F in rows)
