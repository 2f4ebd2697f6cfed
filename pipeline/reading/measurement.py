"""The measurement model: how the forces of whole presses become a modulus, corrected by those of a level sensor."""

import functools
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from pipeline.reading.poses import Placement
from pipeline.reading.pressed_sensor import RISE_TRAVELS, PressedSensor
from pipeline.reading.read_out import LevelReading, correct_reading
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.design.reading import PRESS_S
from sensor.theory.contrast_law import ReadingError
from sensor.theory.contrast_rise import (
    Rise,
    RiseLaw,
    RiseReading,
    RollingDomes,
    UnevenSlopes,
    form_slopes,
    read_rise,
    rise_modulus,
    rise_of,
    uneven_slopes,
)
from solve.contact.linear_response import linear_response, travels

LEVEL_MODULI = 9
MODULI_BEYOND_RANGE = 25  # straight lines between them miss a skin by less than 1e-4
BEYOND = 1.25  # of both ends of the range


@dataclass(frozen=True, kw_only=True)
class RiseModel:
    """Reads a whole press by the rise of its contrast, corrected by level readings where there are any."""

    law: RiseLaw
    level: tuple[LevelReading, ...] = ()
    method: ClassVar[str] = "rise of the contrast over a press"

    def reading(self, press: Floats, noises: Floats, least_forces: Floats | float = 0.0) -> RiseReading:
        """Return what forces [N], shape (samples, tips), tell; `noises` and `least_forces` are those of `read_rise`.

        Samples are at even steps of the travel; what times do is that of a press by hand of `PRESS_S`. E is corrected
        by the level readings. Raises RiseError.
        """
        found = read_rise(self.law, self._rise(press, least_forces), noises)
        return replace(found, E=correct_reading(found.E, self.level))

    def modulus(self, press: Floats) -> float:
        """Return the modulus [MPa] of forces [N], shape (samples, tips); raises RiseError."""
        return correct_reading(rise_modulus(self.law, self._rise(press)), self.level)

    def change(self, press: Floats, more: Floats) -> float:
        """Return the size of the relative change of the modulus [1] if the forces of a press change by `more` [N]."""
        return abs(self.modulus(press + more) / self.modulus(press) - 1.0)

    def uneven(self, press: Floats, wave_numbers: Floats, relative_radius: float) -> UnevenSlopes:
        """Return what uneven skin and flesh do to the modulus of a press, as `uneven_slopes`; raises RiseError."""
        return uneven_slopes(self.law, self._rise(press), wave_numbers, relative_radius)

    def form(self, press: Floats, domes: RollingDomes, cap_radii: Sequence[float]) -> Floats:
        """Return what the form of its domes does to the modulus of a press, as `form_slopes`; raises RiseError."""
        return form_slopes(self.law, self._rise(press), domes, cap_radii)

    def _rise(self, press: Floats, least_forces: Floats | float = 0.0) -> Rise:
        return rise_of(press, press.shape[1], least_forces, t=times_by_hand(len(press)))


@functools.lru_cache(maxsize=16)
def times_by_hand(samples: int) -> Floats:
    """Return the time of each of some samples at even steps of the travel X [s], in a press by hand of `PRESS_S`.

    A hand slows to a stop: x = X (1 - (1 - t / T)^2).
    """
    return np.asarray(PRESS_S * (1.0 - np.sqrt(1.0 - np.linspace(0.0, 1.0, samples + 1)[1:])))


def rise_model(sensor: PressedSensor) -> RiseModel:
    """Return the model that reads whole presses of a sensor, with what shape and skin of its fruit add taken off."""
    return RiseModel(law=sensor.law, level=level_readings(sensor))


def level_readings(sensor: PressedSensor) -> tuple[LevelReading, ...]:
    """Return what the law says of presses of a level sensor at moduli, from the first touch to full travel.

    Under a skin they reach beyond the range of the fruit. There are none where the law holds all of such a press.
    """
    if sensor.is_exact_seated and not sensor.scene.curved:
        return ()
    design = sensor.design
    moduli = _moduli_over_range(design) if sensor.contact.skin is None else _moduli_beyond_range(design)
    return _read_by_law(sensor, moduli, sensor.presses(moduli, [Placement()]).F[:, 0])


def seated_level_readings(sensor: PressedSensor) -> tuple[LevelReading, ...]:
    """Return what the law of a pair says of level flat tips whose faces are seated; none where that is exact.

    The forces are in closed form, where those of cells are some parts in a thousand off. Tips without a flat face have
    none to seat: theirs are those of `level_readings`.
    """
    if sensor.is_exact_seated:
        return ()
    if not sensor.design.tips.tip_shape.has_flat_face:
        return level_readings(sensor)
    x = travels(sensor.design.press.travel_mm, RISE_TRAVELS)
    moduli = _moduli_beyond_range(sensor.design)
    presses = [linear_response(sensor.contact.at(E).S, sensor.C, [E], x).F[0] for E in moduli]
    return _read_by_law(sensor, moduli, presses)


def _read_by_law(sensor: PressedSensor, moduli: Sequence[float], presses: Iterable[Floats]) -> tuple[LevelReading, ...]:
    """Return what the law of a sensor says of a press at each modulus [MPa]."""
    model = RiseModel(law=sensor.law)
    rows = []
    for E, press in zip(moduli, presses, strict=True):
        with suppress(ReadingError):  # a press too short for its rise
            rows.append(LevelReading(E_MPa=E, read_MPa=model.modulus(press)))
    return tuple(rows)


def _moduli_over_range(design: Design) -> list[float]:
    """Return moduli over the range of a fruit [MPa]."""
    return list(np.geomspace(min(design.fruit.E_MPa), design.fruit.largest_E_MPa, LEVEL_MODULI).tolist())


def _moduli_beyond_range(design: Design) -> list[float]:
    """Return moduli over the range of a fruit and beyond both ends [MPa], close enough for the curve of a skin."""
    least, largest = min(design.fruit.E_MPa), design.fruit.largest_E_MPa
    return list(np.geomspace(least / BEYOND, largest * BEYOND, MODULI_BEYOND_RANGE).tolist())
