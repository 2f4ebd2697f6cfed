"""A square of domes like that of the preset of mangoes, on a cheek, and the law that reads it."""

import numpy as np
from stored_presses import square

from sensor.theory.contrast_rise import RiseLaw, RollingDomes
from solve.presses.pressed_bodies import EllipsoidFruit

SQUARE = square(side=6.3, K_low=0.056, K_high=0.635, dome_radius=9.8)
TRAVELS = 1.13 * np.arange(1, 17) / 16.0
_WEIGHTS = (-0.5, 0.5, -0.5, 0.5)


def on_cheek(E: float) -> tuple[EllipsoidFruit, RollingDomes, RiseLaw]:
    """Return a fruit of a modulus [MPa], the domes on it, and their law."""
    fruit = EllipsoidFruit(E=E, R1=47.0, R2=110.0, azimuth=30.0)
    domes = RollingDomes(
        positions=tuple(map(tuple, SQUARE.positions.tolist())),
        weights=_WEIGHTS,
        dome_radius=SQUARE.dome_radius,
        mean_curvature=0.5 * (1.0 / fruit.R1 + 1.0 / fruit.R2),
        poisson=fruit.poisson,
    )
    return fruit, domes, domes.law(np.diag(1.0 / SQUARE.K).tolist())
