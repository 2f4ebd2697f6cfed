"""Small sensors that the tests of files and checks share; parts are frozen, so no test can change them."""

from dataclasses import replace

import pytest
from squares import square_sensor

from cad.parts.assembly import draw_sensor
from cad.parts.housing import Housing
from cad.parts.housing_solid import housing_part
from cad.parts.layout import housing_for
from cad.parts.sensor import SensorSolids
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES
from sensor.design.tips import PressMotion, Tips
from sensor.theory.leaf_spring import Flexure


@pytest.fixture(scope="session")
def housing():
    low = Flexure(thickness=0.8, length=25.0, depth=6.0, separation=14.0, fillet=0.5)
    return Housing(
        low=low, high=replace(low, thickness=1.2, length=13.0), tip_side=1.0, tip_height=1.0, spacing=8.0,
        shuttle_width=6.0, neck_level=3.5, lower_leaf_level=5.6, low_top_level=22.0, high_top_level=22.45,
        cavity_level=22.75, top_level=28.75, protrusion=1.7, cover_level=1.857,
    )  # fmt: skip


@pytest.fixture(scope="session")
def sensor(housing):
    return SensorSolids(housing=housing, part=housing_part(housing), fruit=Fruit(), tips=Tips(), press=PressMotion())


@pytest.fixture(scope="session")
def square():
    """Return the sensor of a gentle square, its plate as it is made."""
    return square_sensor()


@pytest.fixture(scope="session")
def pinned():
    """Return a sensor of PETG with pins of 1 mm: pocket 1 + 2 x 0.05, foot 2 (1.1 + 0.8) for walls and gable."""
    design = Design(tips=Tips(socket="pin"))
    return draw_sensor(design, housing_for(design, PROCESSES["fdm-petg"], (20.0, 12.0), (0.5, 0.11)))
