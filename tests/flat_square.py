"""A square of flat tips that touch whole at any tilt: forces in closed form, where reading is exact."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import PressMotion, Tips
from solve.contact.linear_response import spring_compliance
from solve.contact.pose_forces import Pose, PoseForces
from solve.contact.scene import Scene
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

FORCE_ERROR = 1e-3
SPRINGS = (1.2, 20.0)  # low and high [N/mm]


def square_design(**reading: Any) -> Design:
    """Return the design of a square of flat tips on a block, with fields of its reading."""
    return Design(
        name="square",
        targets=None,
        springs=GivenSprings(K_l_N_per_m=1e3 * SPRINGS[0], K_h_N_per_m=1e3 * SPRINGS[1]),
        fruit=Fruit(length_mm=30.0, width_mm=30.0, E_MPa=(0.5, 1.0, 2.0, 3.5), bruise_limit_MPa=(0.5, 1.0, 2.0, 3.0)),
        tips=Tips(layout="square", spacing_mm=6.0),
        press=PressMotion(travel_mm=0.6),
        reading=ReadingRequirements(**reading),
    )


def square_contact() -> FruitCompliance:
    """Return the compliance of a half-space under the square: 1 / (1.15 sides) under a tip, Boussinesq's beside it."""
    places = np.array(square_design().tips.places_mm)
    apart = np.hypot(*(np.subtract.outer(axis, axis) for axis in places.T))
    S = 0.91 / np.where(apart > 0.0, np.pi * apart, 1.15)
    info = SolveInfo(method="closed form", dofs=0, seconds=0.0, status="half-space")
    return FruitCompliance(tips=square_design().tips.names, S=S, difference_error=1e-4, s11_error=1e-4, info=info)


def square_springs() -> Floats:
    """Return the compliance of the springs of the square [mm/N], (tips, tips)."""
    return spring_compliance(*SPRINGS, *SPRINGS)


def linear_pose_forces(scene: Scene, contact: FruitCompliance, C: Floats, poses: Sequence[Pose]) -> PoseForces:
    """Return the forces of flat tips that follow any tilt; a tip that would be pulled is off.

    Their common error is that of a fruit that gives way by `FORCE_ERROR` more than it does.
    """
    places = np.array(scene.tips.places_mm)
    rows, errors = [], []
    for pose in poses:
        lowered = pose.travel + places @ np.tan(np.radians(np.add(pose.stand.tilt_deg, pose.stand.tilt_change_deg)))
        if pose.stand.from_touch:
            lowered = lowered - (places @ np.tan(np.radians(pose.stand.tilt_deg))).max()
        compliance = np.asarray(C) + contact.S / pose.E
        pushed = np.linalg.solve(compliance, lowered)
        softer = np.linalg.solve(compliance, contact.S / pose.E @ pushed)
        rows.append(np.where(pushed > 0.0, pushed, 0.0))
        errors.append(np.where(pushed > 0.0, FORCE_ERROR * softer, 0.0))
    F: Floats = np.array(rows)
    shape = F.shape
    return PoseForces(
        F=F,
        F_error=FORCE_ERROR * F,
        common_error=np.array(errors),
        F_flesh=np.zeros(shape),
        error=np.full(len(F), FORCE_ERROR),
        touching=F > 0.0,
        contact_radius=np.full(shape, 0.5),
        mean_pressure=F / scene.tips.face_mm2,
        pressure_error=np.zeros(shape),
        face_mm=np.zeros(len(F)),
    )
