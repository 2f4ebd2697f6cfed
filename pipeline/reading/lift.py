"""The tilt at which the first tip leaves the fruit."""

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from cad.design.reading import Reading
from cad.quantity import Estimate
from pipeline.reading.placed import Placed, directed, read_moduli
from pipeline.stages.response import scene_of
from solve.contact.poses import pose_forces
from solve.contact.scene import STEEPEST_DEG
from solve.fruit.compliance import FruitCompliance

Floats = NDArray[np.float64]

MOST_DEG = 15.0
_WITHIN = 0.1  # [deg] of the steepest scene that contact is solved for
_RESOLVED_DEG = 0.05


def lift_tilt(design: Design, reading: Reading, contact: FruitCompliance, C: Floats) -> Estimate:
    """Return the least tilt, of all directions and moduli, at which a tip is off the fruit at full travel [deg].

    C (tips, tips) [mm/N] is the compliance of the springs. Where no tip lifts before, 15 deg or the steepest press that
    contact is solved for. Raises as `pose_forces`.
    """
    scene, travel = scene_of(design), design.press.travel_mm
    most = min(MOST_DEG, STEEPEST_DEG - scene.steepest_deg - _WITHIN)

    def all_touch(tilt: float) -> bool:
        poses = [
            Placed(tilt_deg=direction).pressed(E, travel)
            for E in read_moduli(design.fruit)
            for direction in directed(tilt)
        ]
        return bool(pose_forces(scene, contact, C, poses).touching.all())

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
