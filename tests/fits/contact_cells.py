"""SAFETY and RIM of unilateral contact: errors on the product's cells against much finer ones.

`python tests/fits contact_cells` (1 minute): error over bar of tilted and rounded tips and of spheres,
where the bar is SAFETY times the step from coarser cells, RIM over the touching cells, and the compliance's own.
"""

from collections.abc import Sequence
from functools import cache
from unittest.mock import patch

import numpy as np
from fits.comparison import Comparison, covering, fitted

from cad.design.parameters import Fruit, Press, Tips
from solve.contact import response
from solve.contact.scene import Scene
from solve.contact.scene_cells import HALF_CELLS
from solve.fruit.split import split_compliance

FRUIT = Fruit()
ORDER = 1.5  # of the cells' error in their number
SPARE = 5.0  # the bar takes the largest step near by, and few scenes are looked at
FINER = (34, 48)  # cells a side
SPRINGS = np.diag([1.0 / 0.906, 1.0 / 20.83])  # [mm/N] of the paper's targets
MODULI, TRAVELS = (0.5, 3.5), np.linspace(0.1, 0.6, 6)  # [MPa], [mm]
PARTLY = (
    Scene(fruit=FRUIT, tips=Tips(), press=Press(tilt_deg=1.0)),
    Scene(fruit=FRUIT, tips=Tips(), press=Press(tilt_deg=3.0)),
    Scene(fruit=FRUIT, tips=Tips(fillet_mm=0.05), press=Press()),
    Scene(fruit=FRUIT, tips=Tips(fillet_mm=0.1), press=Press()),
)
SPHERES = tuple(
    Scene(fruit=FRUIT, tips=Tips(shape="sphere", side_mm=side), press=Press(tilt_deg=1.0)) for side in (1.0, 3.0)
)


@cache
def product(scene: Scene) -> response.SensorResponse:
    return pressed(scene)


def pressed(scene: Scene) -> response.SensorResponse:
    return response.scene_response(scene, split_compliance(FRUIT, Tips()), SPRINGS, MODULI, TRAVELS)


@cache
def errors(scene: Scene) -> np.ndarray:
    """Return the largest relative error of a force [1], shape (moduli, travels)."""
    F = product(scene).F
    with patch("solve.contact.scene_cells.HALF_CELLS", FINER):
        truth = pressed(scene).F
    touching = (F > 0.0) & (truth > 0.0)
    return np.abs(np.divide(F, truth, out=np.ones_like(F), where=touching) - 1.0).max(axis=2)


def of_bar(scene: Scene) -> float:
    """Return the largest error of the forces over the bar that the product gives [1]."""
    return float(np.nanmax(errors(scene) / product(scene).F_error))


def of_rim(scene: Scene) -> float:
    """Return the largest error of the forces times the number of touching cells [1]."""
    with patch.object(response, "SAFETY", 0.0):
        rim = pressed(scene).F_error
        with patch.object(response, "RIM", 0.0):
            rim = rim - pressed(scene).F_error
    return float(np.nanmax(response.RIM * errors(scene) / rim))


def compared(partly: Sequence[Scene] = PARTLY, spheres: Sequence[Scene] = SPHERES) -> list[Comparison]:
    left = 1.0 / ((HALF_CELLS[1] / HALF_CELLS[0]) ** ORDER - 1.0)
    return [
        fitted(f"SAFETY, what order {ORDER:g} leaves of the step", response.SAFETY, left, 0.2),
        covering("bar of tilted and rounded tips", 1.0, [of_bar(scene) for scene in partly], SPARE),
        covering("bar of spheres", 1.0, [of_bar(scene) for scene in spheres], SPARE),
    ]


def details() -> list[str]:
    return [f"RIM {response.RIM:g}, error times touching cells of spheres: {[of_rim(scene) for scene in SPHERES]}"]
