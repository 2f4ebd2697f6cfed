"""The measurement model: a modulus is read from the forces of a whole press and corrected by level presses."""

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
    UnevennessSensitivity,
    form_slopes,
    read_rise,
    rise_modulus,
    select_rise,
    unevenness_sensitivity,
)
from solve.contact.linear_response import linear_response, travels

LEVEL_MODULI = 9  # number of moduli of the level readings, for a fruit without a skin
MODULI_BEYOND_RANGE = 25  # number of moduli for a fruit with a skin, at which linear interpolation is accurate to 1e-4
RANGE_FACTOR = 1.25  # factor by which the moduli extend beyond both ends of the range of the fruit


@dataclass(frozen=True, kw_only=True)
class RiseModel:
    """A model that reads the modulus from the rise of the contrast in a whole press.

    `law` relates the contrast to the forces. `level` are level readings, by which all readings are corrected. If
    it is empty, readings are not corrected.
    """

    law: RiseLaw
    level: tuple[LevelReading, ...] = ()
    method: ClassVar[str] = "rise of the contrast over a press"

    def read(self, press: Floats, noises: Floats, least_forces: Floats | float = 0.0) -> RiseReading:
        """Return the reading of a press with forces (samples, tips) [N], corrected by the level readings.

        The samples are at equal steps of the travel. Their times are the times in a press by hand that lasts `PRESS_S`.
        `noises` (tips,) [N] and `least_forces` [N] are passed to `read_rise` and `select_rise`. Raises RiseError if no
        modulus can be determined from the press.
        """
        uncorrected = read_rise(self.law, self._rise(press, least_forces), noises)
        return replace(uncorrected, E=correct_reading(uncorrected.E, self.level))

    def read_modulus(self, press: Floats) -> float:
        """Return the corrected modulus [MPa] that is read from the forces of a press (samples, tips) [N].

        The forces have no noise. Raises RiseError if no modulus can be determined from them.
        """
        return correct_reading(rise_modulus(self.law, self._rise(press)), self.level)

    def modulus_change(self, press: Floats, force_change: Floats) -> float:
        """Return the magnitude of the relative change of the modulus read [1] if the forces change.

        `press` and `force_change` have the shape (samples, tips) [N]. Raises RiseError.
        """
        return abs(self.read_modulus(press + force_change) / self.read_modulus(press) - 1.0)

    def unevenness_slopes(self, press: Floats, wave_numbers: Floats, relative_radius: float) -> UnevennessSensitivity:
        """Return the slopes of ln E with respect to uneven skin and flesh in a press; raises RiseError."""
        return unevenness_sensitivity(self.law, self._rise(press), wave_numbers, relative_radius)

    def form_slopes(self, press: Floats, domes: RollingDomes, cap_radii: Sequence[float]) -> Floats:
        """Return the slopes of ln E with respect to form errors of the domes in a press; raises RiseError."""
        return form_slopes(self.law, self._rise(press), domes, cap_radii)

    def _rise(self, press: Floats, least_forces: Floats | float = 0.0) -> Rise:
        """Return the samples of a press from which its modulus is read, timed as in a press by hand."""
        return select_rise(press, press.shape[1], least_forces, t=times_by_hand(len(press)))


@functools.lru_cache(maxsize=16)
def times_by_hand(samples: int) -> Floats:
    """Return the times [s] of samples at equal steps of the travel, in a press by hand that lasts T = `PRESS_S`.

    A hand slows to a stop at the full travel X: x = X (1 - (1 - t / T)^2). The times solve this equation for t. The
    first sample is one step after the first touch, and the last sample is at full travel.
    """
    return np.asarray(PRESS_S * (1.0 - np.sqrt(1.0 - np.linspace(0.0, 1.0, samples + 1)[1:])))


def rise_model(sensor: PressedSensor) -> RiseModel:
    """Return the model that reads the modulus from whole presses of a sensor, with corrections by level readings."""
    return RiseModel(law=sensor.law, level=level_readings(sensor))


def level_readings(sensor: PressedSensor) -> tuple[LevelReading, ...]:
    """Simulate readings of level presses on fruit of several known moduli, by which other readings are corrected.

    These readings contain the effects of the fruit's shape and skin, which the law neglects. If the fruit has a skin,
    the moduli extend beyond the range of the fruit. The result is empty if the law is exact for a level press, because
    no correction is needed.
    """
    if sensor.is_exact_seated and not sensor.scene.is_fruit_curved:
        return ()
    design = sensor.design
    moduli = _moduli_over_range(design) if sensor.contact.skin is None else _moduli_beyond_range(design)
    level_presses = sensor.presses(moduli, [Placement()]).F[:, 0]  # (moduli, samples, tips) in the only placement
    return _read_by_law(sensor, moduli, level_presses)


def seated_level_readings(sensor: PressedSensor) -> tuple[LevelReading, ...]:
    """Simulate level readings of a pair whose flat tips touch with their whole faces.

    These readings correct the readings of a printed unit. The result is empty if the law is exact for such a press. The
    forces are computed in closed form, because forces from the contact solver have errors of a few parts in a thousand.
    Tips without a flat face have no closed form, so `level_readings` simulates them.
    """
    if sensor.is_exact_seated:
        return ()
    if not sensor.design.tips.tip_shape.has_flat_face:
        return level_readings(sensor)
    x = travels(sensor.design.press.travel_mm, RISE_TRAVELS)
    moduli = _moduli_beyond_range(sensor.design)
    # `F` has the shape (moduli, samples, tips), here with one modulus, because S depends on E under a skin
    presses = [linear_response(sensor.contact.at(E).S, sensor.C, [E], x).F[0] for E in moduli]
    return _read_by_law(sensor, moduli, presses)


def _read_by_law(sensor: PressedSensor, moduli: Sequence[float], presses: Iterable[Floats]) -> tuple[LevelReading, ...]:
    """Return the uncorrected reading of a press for each of the true `moduli` [MPa].

    `presses` holds the forces (samples, tips) [N] of one press for each modulus. Presses without a reading are omitted.
    """
    model = RiseModel(law=sensor.law)
    rows = []
    for E, press in zip(moduli, presses, strict=True):
        with suppress(ReadingError):  # a press may be too short to have enough rise
            rows.append(LevelReading(E_MPa=E, read_MPa=model.read_modulus(press)))
    return tuple(rows)


def _moduli_over_range(design: Design) -> list[float]:
    """Return moduli [MPa] in geometric progression over the range of the fruit."""
    return list(np.geomspace(min(design.fruit.E_MPa), design.fruit.largest_E_MPa, LEVEL_MODULI).tolist())


def _moduli_beyond_range(design: Design) -> list[float]:
    """Return moduli [MPa] over the range of the fruit and beyond both ends, in small enough steps for a skin."""
    smallest, largest = min(design.fruit.E_MPa), design.fruit.largest_E_MPa
    return list(np.geomspace(smallest / RANGE_FACTOR, largest * RANGE_FACTOR, MODULI_BEYOND_RANGE).tolist())
