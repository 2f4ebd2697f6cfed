"""Travel is that of the middle of the tips, from the first touch of a level sensor: by the geometry of rigid bodies.

Springs that are soft against the fruit leave the fruit as it is. Each force over its stiffness is then by how much a
rigid tip would stand in a rigid fruit. That is a matter of places only.
"""

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.split import split_compliance

K = 0.01  # [N/mm], a hundred thousandth of what the fruit has
E = 1000.0  # [MPa]
PIECE = {"length_mm": 40.0, "width_mm": 40.0}
BLOCK = Fruit(**PIECE)
BALL = Fruit(shape="sphere", radius_mm=60.0, thickness_mm=12.0, **PIECE)
PAIR, LINE, SQUARE = Tips(), Tips(layout="line", order="LHL"), Tips(layout="square")
DOMES = Tips(layout="square", shape="dome", dome_radius_mm=9.0, side_mm=5.8)
TURNS = ((0.0, 0.0), (0.01, 0.0), (-0.03, 0.0), (0.02, -0.01))
FRUITS = {"block": BLOCK, "ball": BALL}
LAYOUTS = {"pair": PAIR, "line": LINE, "square": SQUARE, "domes": DOMES}


def rows():
    """Return each layout on each fruit at one turn, each turn twice; the others are a study."""
    found = []
    for number, (name, tips) in enumerate(LAYOUTS.items()):
        for on, (kind, fruit) in enumerate(FRUITS.items()):
            for turn in range(len(TURNS)):
                marks = () if turn == (number + 2 * on) % len(TURNS) else pytest.mark.study
                found.append(pytest.param(tips, fruit, TURNS[turn], id=f"{name}-{kind}-{turn}", marks=marks))
    return found


def skin(fruit, x, y):
    """Return how far the skin lies below its apex [mm]."""
    return 0.0 * x if fruit is BLOCK else 60.0 - np.sqrt(60.0**2 - x**2 - y**2)


def sunk_faces(fruit, tips, turn, travel):
    """Return how far each flat face would stand in the fruit [mm], by the points of its faces: lever times turn."""
    inside = np.linspace(-0.5, 0.5, 101) * tips.side_mm
    x, y = np.meshgrid(inside, inside)
    faces = [(X + x, Y + y) for X, Y in tips.places_mm]
    level = min(skin(fruit, *face).min() for face in faces)
    return [np.max(travel + level + x * turn[0] + y * turn[1] - skin(fruit, x, y)) for x, y in faces]


def sunk_domes(fruit, tips, turn, travel):
    """Return how far each sphere moves back along the sensor's axis until it touches the fruit [mm]."""
    radius = tips.dome_radius_mm
    far = np.hypot(*np.array(tips.places_mm).T)
    # centres of level spheres over the apex where they first touch, less the radius
    touch = 0.0 if fruit is BLOCK else float(np.sqrt((60.0 + radius) ** 2 - far[0] ** 2)) - 60.0 - radius
    axis = np.array([*turn, 1.0]) / np.sqrt(1.0 + turn @ turn)
    sunk = []
    for X, Y in tips.places_mm:
        centre = np.array([X, Y, touch - travel - X * turn[0] - Y * turn[1]]) + radius * axis
        if fruit is BLOCK:
            sunk.append((radius - centre[2]) / axis[2])
            continue
        apart = centre + np.array([0.0, 0.0, 60.0])
        along = apart @ axis
        sunk.append(np.sqrt(along**2 - apart @ apart + (60.0 + radius) ** 2) - along)
    return sunk


@pytest.mark.parametrize(("tips", "fruit", "turn"), rows())
def test_travel_of_each_tip_is_that_of_the_middle_and_its_lever(tips, fruit, turn):
    """Cells at the rim of a face lie a hundredth of its side within, and places are exact to the square of the turn.

    A count from the first touch in the pose would be 0.04 to 0.14 mm off.
    """
    tilt, roll = np.degrees(np.arctan(turn)).tolist()
    scene = Scene(fruit=fruit, tips=tips, press=PressMotion(tilt_deg=tilt, roll_deg=roll))
    C = np.eye(len(tips.places_mm)) / K
    travels = [0.25, 0.5]
    found = scene_response(scene, split_compliance(fruit, tips.flat if tips is DOMES else tips), C, [E], travels)
    sunk = sunk_domes if tips is DOMES else sunk_faces
    expected = [np.maximum(sunk(fruit, tips, np.array(turn), travel), 0.0) for travel in travels]
    np.testing.assert_allclose(found.F[0] / K, expected, atol=1e-3)
