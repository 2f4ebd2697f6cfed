"""Write press.csv and press-counts.csv of docs/examples: a simulated press on a fruit of 1.5 MPa, for the tutorial.

`python tests/tutorial_press.py` does it in ten seconds. No law of the product is in it: the domes press a ball by
boundary elements, on springs of Maxwell material. Under the flesh lies a rigid stone, by the layer's surface Green's
function, K. L. Johnson, Contact Mechanics (1985), section 5.8.
"""

from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
from maxwell_springs import MaxwellSprings, weighed_stiffness
from scipy.special import j0

from solve.presses import pressing as presses
from solve.presses.grids import Grids
from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes
from solve.presses.pressing import Pressing

FOLDER = Path(__file__).parents[1] / "docs" / "examples"
FRUIT = EllipsoidFruit(E=1.5, R1=35.0, R2=35.0, tilt=0.3, tilt_azimuth=30.0, apex=(0.2, -0.1))
STONE_MM = 12.0  # below the skin
WEIGHED = np.array([0.1725, 1.74, 0.1725, 1.738])  # [N/mm] stiffnesses of the unit of weights.csv after 30 s
COUNTS_PER_N = np.array(
    [[5989891, 5788, 16079, -39622], [1133, 1041550, 133, -3273],
     [50668, 2237, 5481157, -26674], [1160, 8005, -3718, 1146809]]
)  # fmt: skip
ZERO = np.array([-98472, 165348, 94877, 174171])
PERIOD_S = 0.02
NOISE_N = 1e-4
TARE = 10  # samples
LAST = 12.0  # of the transform of the layer, over its thickness: the rest is below 1e-8
DOWN = np.arange(1, 26) * 0.02  # [mm] travels of the samples, from the first touch
WAY = np.concatenate([DOWN, [DOWN[-1]], DOWN[-2::-1]])


class GridsOverStone(Grids):
    """Grids on a layer that is bonded to a rigid stone; by how much that stiffens is even under one dome."""

    def deflection(self, forces):
        """Return pi E* times the deflection [N/mm] under forces of cells [N], (tips, cells, cells)."""
        apart = np.linalg.norm(self.centres[:, None] - self.centres, axis=-1)
        return super().deflection(forces) + (less_by_stone(apart) @ forces.sum(axis=(1, 2)))[:, None, None]


def less_by_stone(distance):
    """Return pi E* times what a stone changes of the deflection by a unit force at distances [mm], negative [1/mm]."""
    t = np.linspace(1e-4, LAST, 4000)
    k = 3.0 - 4.0 * FRUIT.poisson
    layer = (2.0 * k * np.sinh(2.0 * t) - 4.0 * t) / (2.0 * k * np.cosh(2.0 * t) + 4.0 * t**2 + 1.0 + k**2)
    return np.trapezoid((layer - 1.0) * j0(t * distance[..., None] / STONE_MM), t, axis=-1) / STONE_MM


def shown_forces(travels):
    """Return the forces [N] that the weighed springs show at travels [mm] from the first touch, (samples, tips)."""
    corners = 3.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    springs = MaxwellSprings(WEIGHED * WEIGHED[0] / weighed_stiffness(WEIGHED)[0])
    pressing = Pressing(SprungDomes(dome_radius=10.0, positions=corners, K=springs.K), FRUIT)
    nearest = pressing.nearest
    shown = []
    for travel in travels:
        c, h = springs.ahead(PERIOD_S)  # a spring of stiffness K / c whose dome stands back by h
        pressing.spring_compliance = c / springs.K
        pressing.fruit = replace(FRUIT, heights=tuple(-h))
        pressing.nearest = nearest + h
        with patch.object(presses, "Grids", GridsOverStone):
            F = pressing.forces(travel + nearest.min() - pressing.nearest.min())
        springs.end(PERIOD_S, c * F / springs.K + h)
        shown.append(WEIGHED * springs.d)
    return np.array(shown)


def main():
    """Write both files: ten samples in the air, a press of half a second, and the way back."""
    x = np.concatenate([np.linspace(-0.2, 0.0, TARE), WAY, np.linspace(0.0, -0.1, 5)])
    t = PERIOD_S * np.arange(len(x))
    forces = np.zeros((len(x), len(WEIGHED)))
    forces[TARE : TARE + len(WAY)] = shown_forces(WAY)
    forces += np.random.default_rng(1).normal(0.0, NOISE_N, forces.shape)
    counts = np.rint(forces @ COUNTS_PER_N.T + ZERO).astype(int)
    newtons = {"header": "t_s,x_mm,F_1_N,F_2_N,F_3_N,F_4_N", "fmt": ["%.2f", "%.3f", *["%.5f"] * 4]}
    logged = {"header": "t_s,counts_1,counts_2,counts_3,counts_4", "fmt": ["%.2f", *["%d"] * 4]}
    np.savetxt(FOLDER / "press.csv", np.column_stack([t, x, forces]), delimiter=",", comments="", **newtons)
    np.savetxt(FOLDER / "press-counts.csv", np.column_stack([t, counts]), delimiter=",", comments="", **logged)


if __name__ == "__main__":
    main()
