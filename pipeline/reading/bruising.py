"""How hard the tips press the skin: the mean pressure over what they touch, level and at the largest tilt."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from cad.quantity import Estimate
from pipeline.reading.placed import Placed, directed
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.storage.plain import first_largest

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class SkinPressure:
    """The largest mean pressure under a tip at one modulus, with its error, and the limit of the fruit [MPa]."""

    E: float
    placed: Placed
    pressure: Estimate
    limit: float

    @property
    def share(self) -> float:
        """Return the pressure over its limit [1]."""
        return self.pressure.value / self.limit


def skin_pressures(sensor: PressedSensor) -> tuple[SkinPressure, ...]:
    """Return the largest pressure at each modulus shown, at full travel; none where the fruit has no limit.

    Raises as `pose_forces`.
    """
    design = sensor.design
    limits = design.fruit.bruise_limits_MPa
    if not limits:
        return ()
    placed = _placed(design)
    poses = [each.pressed(E, design.press.travel_mm) for E in design.fruit.E_MPa for each in placed]
    solved = sensor.in_poses(poses)
    shape = len(limits), len(placed)
    pressures = np.nan_to_num(solved.mean_pressure).max(axis=1).reshape(shape)
    errors = np.nan_to_num(solved.error).reshape(shape)
    worst = [first_largest(row) for row in pressures.tolist()]
    return tuple(
        SkinPressure(
            E=E,
            placed=placed[worst[i]],
            pressure=Estimate(float(pressures[i, worst[i]]), float((pressures * errors)[i, worst[i]]), "MPa"),
            limit=limits[i],
        )
        for i, E in enumerate(design.fruit.E_MPa)
    )


def _placed(design: Design) -> list[Placed]:
    """Return the pose of the design, and where a reading allows for tilt the sensor tilted as far as it may be."""
    own = Placed(tilt_deg=(design.press.tilt_deg, design.press.roll_deg))
    tilts = [] if design.reading is None else directed(design.reading.tilt_deg)
    return [own, *(Placed(tilt_deg=tilt) for tilt in tilts)]
