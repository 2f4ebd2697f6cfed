"""The part of a press in which flat tips are fully seated.

A tilted flat tip touches with an edge first. It is seated, which means in full contact, once its depth exceeds its side
times its tilt. From then on the law of a flat tip holds. A tilted punch stays in full contact while M / F < side/6,
where M is the moment and F the force on it (Johnson, Contact Mechanics, 1985, 5.2). The tilt is known only from the
reading of the press. So the press is read again from the load at which the tips are seated. This load is one of a
geometric series, which the firmware uses too.
"""

from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from instrument.press.measuring import MeasuringUnit
from instrument.press.touches import PressSamples
from sensor.arrays import Floats
from sensor.theory.contrast_rise import Rise, RiseError, RiseLaw, RiseReading, read_rise, select_rise

LOAD_RATIO = 1.25  # ratio of successive loads
MAX_LOADS = 16  # maximum number of loads
MAX_ITERATIONS = 3  # number of iterations, each of which chooses the load that seats the tips and reads the modulus


@dataclass(frozen=True, kw_only=True)
class Seating:
    """The loads at which the evaluated part of a press may begin.

    A load is the product of modulus and depth [N/mm]. `least_forces` holds the tip forces (tips,) [N] at each load;
    only samples above them are used. Tips are seated at the load E (per_offset |offset| + by_skin), where the offset of
    a press is in mm. `per_offset` is the side of a tip divided by the spacing [1], and `by_skin` is the side times the
    slope of the skin [mm]. Tips without a flat face have only the load 0.
    """

    loads: tuple[float, ...]
    least_forces: tuple[Floats, ...]
    per_offset: float = 0.0
    by_skin: float = 0.0

    def load_index(self, E: float, offset: float) -> int:
        """Return the index of the load at which tips are seated on flesh of modulus E [MPa], at an offset [mm].

        This is the last index if the tips are not seated at any load.
        """
        seating_load = E * (self.per_offset * abs(offset) + self.by_skin)
        return sum(load < seating_load for load in self.loads[:-1])


def seating_of(sensor: MeasuringUnit) -> Seating:
    """Return the loads at which flat tips may be seated, from the first touch to nearly full scale.

    Only a pair of flat tips has several loads: the load at the first touch, and a geometric series that ends one step
    below full scale. Other tips have the single load 0, because they need no seating.
    """
    tips = sensor.report.design.tips
    least_forces = sensor.least_forces
    if not sensor.reads_moments:
        return Seating(loads=(0.0,), least_forces=(least_forces,))
    # A load is E times depth [N/mm], so the force of a tip divided by its load is a length [mm].
    force_per_load = 1.0 / np.diag(sensor.report.contact.compliance_per_mm)
    first_load = float((least_forces / force_per_load).min())
    full_load = float((np.array(sensor.report.read_out.full_scale_N) / force_per_load).min())
    decreasing_loads = [full_load / LOAD_RATIO**step for step in range(1, MAX_LOADS)]
    higher_loads = [load for load in reversed(decreasing_loads) if load > first_load]
    # At every load, the tips must at least touch.
    higher_forces = [np.maximum(least_forces, load * force_per_load) for load in higher_loads]
    return Seating(
        loads=(first_load, *higher_loads),
        least_forces=(least_forces, *higher_forces),
        per_offset=tips.side_mm / tips.spacing_mm,
        # Under a tip of a level pair, the slope of the skin is half the spacing divided by the radius.
        by_skin=tips.side_mm * 0.5 * tips.spacing_mm / sensor.report.design.fruit.radii_mm[0],
    )


class Seated(NamedTuple):
    """The uncorrected reading of a press, the part of the press that was read, and the channels of its deepest sample.

    `deepest_channels` (channels,) [N] has the columns of `PressSamples.channels`.
    """

    reading: RiseReading
    rise: Rise
    deepest_channels: Floats


def seated_reading(sensor: MeasuringUnit, law: RiseLaw, press: PressSamples, lag: int) -> Seated:
    """Return the reading of a press from the load at which its tips are seated.

    That load depends on the modulus and the tilt, which are read from the samples above it. So the press is read
    several times. If the samples above a load do not determine a modulus, the next lower load is used. `law` must have
    the same channels as the press. Samples that are `lag` samples apart have independent noise. If the load still
    changes after MAX_ITERATIONS, the last reading is returned. Raises RiseError if the whole press does not determine a
    modulus.
    """
    seating = seating_of(sensor)
    read_from_load = partial(_reading_from_load, sensor, law, press, lag, seating)
    tried_index = 0
    index, rise, reading = read_from_load(tried_index)  # the whole press
    deepest_channels = rise.forces[-1]  # the rise ends with the deepest sample
    for _ in range(MAX_ITERATIONS):
        seating_index = seating.load_index(reading.E, reading.offset)
        # A load that has just been tried in vain would lead to the same lower load again.
        if seating_index in (index, tried_index):
            break
        tried_index = seating_index
        index, rise, reading = read_from_load(tried_index)
    return Seated(reading, rise, deepest_channels)


def _reading_from_load(
    sensor: MeasuringUnit, law: RiseLaw, press: PressSamples, lag: int, seating: Seating, index: int
) -> tuple[int, Rise, RiseReading]:
    """Read a press from the load number `index` of `seating`, or from the next lower load that yields a modulus.

    The load number 0 selects the whole press. Return the number of the load that was used, the part of the press above
    it, and its reading. Raises RiseError if not even the whole press determines a modulus.
    """
    for higher_load in range(index, 0, -1):
        with suppress(RiseError):
            least_forces = seating.least_forces[higher_load]
            return higher_load, *_reading_from(sensor, law, press, lag, least_forces, whole=False)
    return 0, *_reading_from(sensor, law, press, lag, seating.least_forces[0], whole=True)


def _reading_from(
    sensor: MeasuringUnit, law: RiseLaw, press: PressSamples, lag: int, least_forces: Floats, *, whole: bool
) -> tuple[Rise, RiseReading]:
    """Return the part of a press in which all tip forces exceed `least_forces` (tips,) [N], and its reading.

    Raises RiseError if that part does not determine a modulus. With `whole`, RiseError is also raised if the force
    rises too little after the last tip has touched.
    """
    # The channels after the tip forces are forces of elastic flesh, which only have to be positive.
    flesh_limits = np.zeros(press.channels.shape[1] - press.tips)
    channel_limits = np.concatenate([least_forces, flesh_limits])
    rise = select_rise(press.channels, press.tips, channel_limits, t=press.t, lag=lag)
    return rise, read_rise(law, rise, sensor.noises, whole=whole)
