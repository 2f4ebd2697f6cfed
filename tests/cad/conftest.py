"""One small housing that the tests of files and checks share; parts are frozen, so no test can change it."""

from dataclasses import replace

import pytest

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from cad.parts.housing import Housing
from cad.parts.housing_solid import housing_part
from cad.parts.sensor import Sensor
from cad.theory.leaf_spring import Flexure


@pytest.fixture(scope="session")
def housing():
    low = Flexure(thickness=0.8, length=25.0, depth=6.0, separation=14.0, fillet=0.5)
    return Housing(
        low=low, high=replace(low, thickness=1.2, length=13.0), tip_side=1.0, tip_height=1.0, spacing=8.0,
        shuttle_width=6.0, neck_level=3.5, lower_leaf_level=5.6, low_top_level=22.0, high_top_level=22.45,
        cavity_level=22.75, top_level=28.75, protrusion=1.7,
    )  # fmt: skip


@pytest.fixture(scope="session")
def sensor(housing):
    return Sensor(housing=housing, part=housing_part(housing), fruit=Fruit(), tips=Tips(), press=Press())
