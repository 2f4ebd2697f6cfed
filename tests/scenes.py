"""The paper's scene and a piece of a ball, as the tests of solves take them."""

import numpy as np

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from solve.contact.scene import Scene

BLOCK = Fruit()
SPHERE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
SPRINGS = np.diag([1.0 / 0.9057, 1.0 / 20.831])  # [mm/N], of the paper's targets


def scene_of(fruit: Fruit = BLOCK, tilt: float = 0.0, roll: float = 0.0, **tips: object) -> Scene:
    """Return the scene of a pair on a fruit, tilted and rolled [deg]."""
    return Scene(fruit=fruit, tips=Tips(**tips), press=PressMotion(tilt_deg=tilt, roll_deg=roll))
