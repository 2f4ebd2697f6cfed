"""The paper's scene, a piece of a ball and a small housing, as the tests of solves take them."""

import numpy as np

from cad.parts.housing import Housing
from sensor.design.fruit import Fruit
from sensor.design.tips import Press, Tips
from sensor.theory.leaf_spring import Flexure
from solve.contact.scene import Scene

BLOCK = Fruit()
SPHERE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
SMALL_HOUSING = Housing(
    low=Flexure(thickness=0.8, length=9.0, depth=4.0, separation=8.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=7.0, depth=4.0, separation=8.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=6.0, shuttle_width=4.0, neck_level=2.5, lower_leaf_level=4.7,
    low_top_level=15.0, high_top_level=15.2, cavity_level=15.5, top_level=20.0, protrusion=1.0, wall_width=6.0,
)  # fmt: skip
"""Short leaves, so that meshes of other programs are small."""
SPRINGS = np.diag([1.0 / 0.9057, 1.0 / 20.831])  # [mm/N], of the paper's targets


def scene_of(fruit: Fruit = BLOCK, tilt: float = 0.0, roll: float = 0.0, **tips: object) -> Scene:
    """Return the scene of a pair on a fruit, tilted and rolled [deg]."""
    return Scene(fruit=fruit, tips=Tips(**tips), press=Press(tilt_deg=tilt, roll_deg=roll))
