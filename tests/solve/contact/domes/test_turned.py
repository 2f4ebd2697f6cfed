"""Four domes on fruit whose principal directions are turned against them, by boundary elements of another program."""

import numpy as np
import pytest
from stored_presses import STORED

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from solve.contact.domes.fruit_under_domes import FruitUnderDomes
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.pose_forces import Stand, posed_scene
from solve.contact.scene import Scene

SENSOR = STORED["sensor"]
PRESSES = [pytest.param(press, id="{R1}-{R2}-{azimuth}-{tilt}".format(**press)) for press in STORED["presses"]]
TIPS = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.9, spacing_mm=6.0)
ORDER = [TIPS.places_mm.index(tuple(place)) for place in SENSOR["positions"]]
FRUIT = Fruit(
    shape="ellipsoid", radius_mm=40.0, radius_across_mm=90.0, length_mm=24.0, width_mm=24.0, thickness_mm=12.0
)
SCENE = Scene(fruit=FRUIT, tips=TIPS, press=PressMotion(travel_mm=0.9))
SPRINGS = np.diag([1.0 / (0.15 if kind == "low" else 1.4) for kind in TIPS.springs])  # [mm/N]


def forces(press):
    """Return the forces of the law on a half-space [N], in the order of the reference, (travels, tips)."""
    toward = np.radians(press["tilt_azimuth"])
    slopes = np.tan(np.radians(press["tilt"])) * np.array([np.cos(toward), np.sin(toward)])
    stand = Stand(
        from_touch=True, tilt_deg=tuple(np.degrees(np.arctan(slopes)).tolist()), azimuth_deg=press["azimuth"],
        radii_mm=(press["R1"], press["R2"]),
    )  # fmt: skip
    scenes = [posed_scene(SCENE, stand)] * len(press["travel"])
    none = np.zeros((len(scenes), 4, 4))
    body = FruitUnderDomes(
        poisson=STORED["poisson"],
        remainder=none,
        bound=none,
        boundary_distance=np.inf,
        contact_points=np.array(TIPS.places_mm),
    )
    poses = dome_poses(scenes, np.array(press["travel"]))
    return dome_forces(poses, np.full(len(scenes), press["E"]), SPRINGS, body).F[:, ORDER]


@pytest.mark.parametrize("press", PRESSES)
def test_forces_are_those_of_boundary_elements(press):
    """Within 1 %: the reference has 0.2 to 0.5 %, small strain up to 0.4 %, small slopes 1 - cos(4 deg) = 0.24 %."""
    expected = np.array(press["forces"])
    assert np.abs(forces(press) - expected).max() <= 0.01 * expected.max()
