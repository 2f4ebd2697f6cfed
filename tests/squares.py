"""A square of four domed tips as the tests take it: a gentle design, and one of its two equal plates."""

import functools
from dataclasses import replace
from pathlib import Path

from cad.parts.assembly import finished_part
from cad.parts.hall_seats import hall_seats
from cad.parts.housing import Housing
from cad.parts.layout import housing_for
from cad.parts.sensor import SensorSolids
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings, Print
from sensor.design.processes import PROCESSES, Process
from sensor.design.tips import PressMotion, Tips

BALL = Path(__file__).with_name("designs") / "ball.toml"
"""A square of domes on a ball of a mango's size, for which presses by finite elements were found."""
RESIN = PROCESSES["sla-resin"]
GENTLE = Design(
    name="gentle-square",
    targets=None,
    springs=GivenSprings(K_l_N_per_m=1200.0, K_h_N_per_m=20000.0),
    fruit=Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0),
    tips=Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.4, spacing_mm=6.0),
    press=PressMotion(travel_mm=0.4),
    print=Print(process="sla-resin"),
)
LENGTHS = (20.438, 11.09)  # [mm] leaves of its springs in resin, low then high
DEFLECTIONS = (0.3, 0.1)  # [mm] of its springs at full travel


@functools.cache
def square_housing(design: Design = GENTLE, lengths: tuple[float, float] = LENGTHS) -> Housing:
    """Return one plate of a square with leaves of the lengths [mm]."""
    return housing_for(design, PROCESSES[design.print.process], lengths, DEFLECTIONS)


@functools.cache
def square_sensor(housing: Housing | None = None, design: Design = GENTLE) -> SensorSolids:
    """Return the sensor of a square, its plate as it is made."""
    housing = housing or square_housing(design)
    part = finished_part(housing)
    return SensorSolids(
        housing=housing, part=part, fruit=design.fruit, tips=design.tips, press=design.press, name=design.name
    )


@functools.cache
def hall_square(housing: Housing | None = None) -> SensorSolids:
    """Return the gentle square with the seats of a Hall read-out."""
    return with_seats(square_sensor(housing), RESIN)


def with_seats(sensor: SensorSolids, process: Process) -> SensorSolids:
    """Return a sensor with the seats of a Hall read-out, its part as it is made."""
    seats = hall_seats(sensor.housing, sensor.press, process)
    return replace(sensor, part=finished_part(sensor.housing, seats), seats=seats)


def gentle(**tips: object) -> Design:
    """Return the gentle square with other tips."""
    return replace(GENTLE, tips=replace(GENTLE.tips, **tips))
