"""Six presses of a square of domes on ellipsoids: forces that another program of boundary elements found once."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes

STORED: dict[str, Any] = json.loads(Path(__file__).with_name("presses_on_ellipsoids.json").read_text(encoding="utf-8"))
"""`sensor`, `poisson`, `presses` (lengths in mm, forces in N, moduli in MPa, angles in degrees), and their source."""


def square(side: float = 6.0, K_low: float = 0.15, K_high: float = 1.4, dome_radius: float = 10.0) -> SprungDomes:
    """Return a square of a side [mm] with low and high springs [N/mm] in turn, by default the stored one."""
    corners = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return SprungDomes(dome_radius=dome_radius, positions=corners, K=np.array([K_low, K_high, K_low, K_high]))


def random_fruits(count: int, seed: int) -> Iterator[EllipsoidFruit]:
    """Yield random mangoes: any azimuth, tilts up to 4 degrees evenly over all slopes."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield EllipsoidFruit(
            E=math.exp(rng.uniform(math.log(0.5), math.log(3.5))),
            R1=rng.uniform(42.0, 53.0),
            R2=rng.uniform(86.0, 144.0),
            azimuth=rng.uniform(-90.0, 90.0),
            tilt=4.0 * math.sqrt(rng.uniform()),
            tilt_azimuth=rng.uniform(0.0, 360.0),
        )
