"""The tilt at which the first tip leaves the fruit."""

from cad.design.reading import Reading
from cad.quantity import Estimate
from pipeline.reading.placed import Placed, directed, read_moduli
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import scene_of
from solve.contact.scene import STEEPEST_DEG

MOST_DEG = 15.0
_WITHIN = 0.1  # [deg] of the steepest scene that contact is solved for
_RESOLVED_DEG = 0.05


def lift_tilt(sensor: PressedSensor, reading: Reading) -> Estimate:
    """Return the least tilt, of all directions and moduli, at which a tip is off the fruit at full travel [deg].

    The sensor stands in the middle of the design's fruit. Where no tip lifts before, 15 deg or the steepest press that
    contact is solved for. Raises as `pose_forces`.
    """
    design, travel = sensor.design, sensor.design.press.travel_mm
    scene = scene_of(design)
    most = min(MOST_DEG, STEEPEST_DEG - scene.steepest_deg - _WITHIN)

    def all_touch(tilt: float) -> bool:
        poses = [
            Placed(tilt_deg=direction).pressed(E, travel)
            for E in read_moduli(design.fruit)
            for direction in directed(tilt)
        ]
        return bool(sensor.in_poses(poses).touching.all())

    touching, lifted = 0.0, most
    for tilt in (min(reading.tilt_deg, most), most):
        if all_touch(tilt):
            touching = tilt
        else:
            lifted = tilt
            break
    while lifted - touching > _RESOLVED_DEG:
        middle = 0.5 * (touching + lifted)
        touching, lifted = (middle, lifted) if all_touch(middle) else (touching, middle)
    return Estimate(touching, lifted - touching, "deg")
