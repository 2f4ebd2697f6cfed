"""Sensors with leaves of spring steel as the tests of files and checks take them: a pair, and a plate of a square."""

import functools
from dataclasses import replace

from squares import GENTLE

from cad.parts.assembly import sensor_of
from cad.parts.housing import Housing
from cad.parts.layout import housing_for
from cad.parts.sensor import SensorSolids
from sensor.design.leaves import leaves_of
from sensor.design.parameters import Design, GivenSprings, Print
from sensor.theory.two_spring_law import Springs

STEEL = Print(leaves="spring-steel", leaf_thickness_low_mm=0.1, leaf_thickness_high_mm=0.3)
PAIR = Design(name="steel", print=STEEL, springs=GivenSprings(K_l_N_per_m=970.0, K_h_N_per_m=19000.0))
SQUARE = replace(GENTLE, name="steel-square", print=replace(STEEL, leaf_thickness_high_mm=0.15))
LENGTHS = (15.5, 16.0)  # [mm] free, low then high
DEFLECTIONS = (0.5, 0.11)  # [mm] of the springs at full travel


def steel_housing(design: Design = PAIR) -> Housing:
    """Return the housing of a design with strips of the lengths [mm]."""
    K_l, K_h = design.springs.K_l_N_per_m, design.springs.K_h_N_per_m
    assert K_l is not None
    assert K_h is not None
    leaves = leaves_of(design, Springs(K_l=1e-3 * K_l, K_h=1e-3 * K_h))
    return housing_for(design, design.process, LENGTHS, DEFLECTIONS, leaves)


@functools.cache
def steel_sensor(design: Design = PAIR) -> SensorSolids:
    """Return the sensor of a design with strips."""
    return sensor_of(design, steel_housing(design))
