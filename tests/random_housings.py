"""Housings at random in every process, with leaves of any length: nothing is solved for them."""

from collections.abc import Iterator

import numpy as np
from random_designs import settings

from cad.parts.assembly import draw_sensor
from cad.parts.layout import housing_for
from cad.parts.sensor import SensorSolids
from pipeline.options import load_design
from pipeline.sensor import refuse_unsolvable
from sensor.design.parameters import Design
from sensor.quantity import InputError

DRAWN = 20  # settings for each design; some three in ten are refused


def housed_designs(seed: int, count: int) -> Iterator[tuple[Design, SensorSolids]]:
    """Yield designs with their sensors, every third with the seats of a Hall read-out.

    Raises RuntimeError if nearly all settings are refused.
    """
    rng = np.random.default_rng(seed)
    made = 0
    for _ in range(DRAWN * count):
        if made == count:
            return
        keys = settings(rng)
        if made % 3 == 0:
            keys["readout.amplifier"] = "ADS1220"
        lengths = (round(rng.uniform(8.0, 30.0), 3), round(rng.uniform(5.0, 18.0), 3))
        deflections = (round(rng.uniform(0.1, 0.6), 3), round(rng.uniform(0.02, 0.2), 3))
        try:
            design = load_design("paper", {"name": f"random-{made}", **keys})
            refuse_unsolvable(design)
            sensor = draw_sensor(design, housing_for(design, design.process, lengths, deflections))
        except InputError:
            continue
        made += 1
        yield design, sensor
    if made < count:
        msg = f"only {made} of {DRAWN * count} random settings were taken"
        raise RuntimeError(msg)
