"""What a finished sensor is read by: its read-out, the scale of its channels, and what is known of its errors."""

from dataclasses import dataclass

import numpy as np

from cad.design.parameters import Design
from pipeline.reading.placed import Placed, press_of
from pipeline.reading.pressed_sensor import PressedSensor, pressed_sensor
from pipeline.reading.read_out import LineReadOut, ReadOut
from pipeline.reading.readings import Readings
from pipeline.response.scene_press import ScenePress, scene_of
from pipeline.response.tip_curve import tip_curve
from pipeline.springs.fitted_springs import FittedSprings
from solve.contact.large_response import flesh_error
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance

LEVEL_MODULI = 9
DEPTHS_BETWEEN = 4  # rows of the curve at large strain to each step of its solved depths


@dataclass(frozen=True, kw_only=True)
class LevelReading:
    """What is read [MPa] of a fruit of modulus E [MPa] by a level sensor in its middle: the shape of the fruit."""

    E: float
    read: float


@dataclass(frozen=True, kw_only=True)
class DepthFactor:
    """The force of a tip over the linear one [1] at a depth [tip sides], and its relative error [1]."""

    depth: float
    factor: float
    error: float


@dataclass(frozen=True, kw_only=True)
class SensorReadOut:
    """The read-out of a sensor, largest force of each channel [N] (tips,), the error of the model as a share of E [1].

    `level` are readings over the range of E which a contrast is corrected by; the line of a pair needs none. `deep` is
    the curve of a tip at large strain, none where the flesh is linear.
    """

    read_out: ReadOut
    full_scale: tuple[float, ...]
    model_error: float
    level: tuple[LevelReading, ...] = ()
    deep: tuple[DepthFactor, ...] = ()


def sensor_read_out(
    design: Design, contact: FruitCompliance, springs: FittedSprings, press: ScenePress, readings: Readings | None
) -> SensorReadOut:
    """Return what a sensor is read by; raises SolveError when a solve is not exact."""
    sensor = pressed_sensor(design, contact, springs.C, press.ahead)
    error = max(contact.error_own, contact.error_pair)
    full_scale = press.hardest.F[-1, -1]
    if readings is not None and readings.assessed.full_scale is not None:
        full_scale = np.array(readings.assessed.full_scale)
    if readings is not None and readings.assessed.bias is not None:
        error = max(error, readings.assessed.bias.error)
    return SensorReadOut(
        read_out=sensor.read_out,
        full_scale=tuple(np.maximum(full_scale, 0.0).tolist()),
        model_error=error,
        level=() if isinstance(sensor.read_out, LineReadOut) else _level(sensor),
        deep=_deep(scene_of(design)) if design.press.strain == "large" else (),
    )


def _deep(scene: Scene) -> tuple[DepthFactor, ...]:
    """Return the curve of a tip, with depths between those that were solved: straight lines will do between them."""
    curve = tip_curve(scene)
    places = np.arange(DEPTHS_BETWEEN * (len(curve.depths) - 1) + 1) / DEPTHS_BETWEEN
    depths = np.interp(places, np.arange(len(curve.depths)), curve.depths)
    rows = zip(depths.tolist(), curve.factor(depths).tolist(), flesh_error(scene, curve, depths).tolist(), strict=True)
    return tuple(DepthFactor(depth=depth, factor=factor, error=error) for depth, factor, error in rows)


def _level(sensor: PressedSensor) -> tuple[LevelReading, ...]:
    """Return the readings of a level sensor at moduli where all tips touch, each contact on the face of its dome."""
    fruit, samples = sensor.design.fruit, sensor.read_out.samples
    moduli = np.geomspace(min(fruit.E_MPa), sensor.design.largest_E_MPa, LEVEL_MODULI).tolist()
    poses = [pose for E in moduli for pose in press_of(Placed(), E, sensor.design, samples)]
    forces = sensor.in_poses(poses).F.reshape(len(moduli), samples, -1)
    rows = []
    for E, press in zip(moduli, forces, strict=True):
        if np.nanmin(press[-1]) > 0.0 and np.isfinite(press).all():
            rows.append(LevelReading(E=E, read=sensor.read_out.modulus(press)))
    return tuple(rows)
