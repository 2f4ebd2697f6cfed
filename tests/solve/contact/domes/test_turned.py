"""Four domes on fruit whose principal directions are turned against them, by boundary elements of another program."""

import numpy as np
import pytest
from stored_presses import STORED

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from solve.contact.domes.fruit_under_domes import FruitUnderDomes
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.scene import Scene

SENSOR = STORED["sensor"]
PRESSES = [pytest.param(press, id="{R1}-{R2}-{azimuth}-{tilt}".format(**press)) for press in STORED["presses"]]
TIPS = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.9, spacing_mm=6.0)
ORDER = [TIPS.places_mm.index(tuple(place)) for place in SENSOR["positions"]]
SPRINGS = np.diag([1.0 / (0.15 if kind == "low" else 1.4) for kind in TIPS.springs])  # [mm/N]


def forces(press):
    """Return the forces of the law on a half-space [N], in the order of the reference, (travels, tips)."""
    toward = np.radians(press["tilt_azimuth"])
    slopes = np.tan(np.radians(press["tilt"])) * np.array([np.cos(toward), np.sin(toward)])
    tilt, roll = np.degrees(np.arctan(slopes)).tolist()
    fruit = Fruit(
        shape="ellipsoid", radius_mm=press["R1"], radius_across_mm=press["R2"], azimuth_deg=press["azimuth"],
        length_mm=24.0, width_mm=24.0, thickness_mm=12.0,
    )  # fmt: skip
    scene = Scene(fruit=fruit, tips=TIPS, press=PressMotion(travel_mm=0.9, tilt_deg=tilt, roll_deg=roll))
    first_touch = 0.0  # of the pose, as the reference counts its travel
    for _ in range(6):
        unloaded = dome_poses([scene], np.array([first_touch]))
        apart = unloaded.approach(np.zeros(unloaded.centres.shape))
        first_touch -= float((apart.interference / apart.cosine).max())
    travel = np.array(press["travel"])
    none = np.zeros((len(travel), 4, 4))
    body = FruitUnderDomes(
        poisson=STORED["poisson"], remainder=none, bound=none, size=np.inf, feet=np.array(TIPS.places_mm)
    )
    poses = dome_poses([scene] * len(travel), travel + first_touch)
    return dome_forces(poses, np.full(len(travel), press["E"]), SPRINGS, body).F[:, ORDER]


@pytest.mark.parametrize("press", PRESSES)
def test_forces_are_those_of_boundary_elements(press):
    """Within 1 %: the reference has 0.2 to 0.5 %, small strain up to 0.4 %, small slopes 1 - cos(4 deg) = 0.24 %."""
    expected = np.array(press["forces"])
    assert np.abs(forces(press) - expected).max() <= 0.01 * expected.max()
