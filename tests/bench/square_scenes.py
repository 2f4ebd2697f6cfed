"""Random squares of domes on spheres of half-space, judged by boundary elements that find the contact cell by cell.

The reference (`tests/reference/domes_on_sphere.py`) shares nothing with the contact engine: Love's rectangles on the
skin of the sphere, and conjugate gradients for the cells that touch.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from reference.domes_on_sphere import DomeSensor, dome_forces

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from cad.quantity import InputError
from pipeline.bench.hard.reference_check import ReferenceCheck
from solve.contact.poses import Pose, pose_forces
from solve.contact.scene import Scene
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import level_compliance, nodes_between
from solve.fruit.split import contact_footprints

SOURCE = "boundary elements of domes on a sphere, 28 cells a side"
CELLS = 1.5e-3  # what 28 cells a side leave: their step from 20 to 28 is 0.2 % at most


@dataclass(frozen=True)
class SquareScene:
    """Four domes on a sphere in one pose: modulus [MPa], travel [mm], tilt [deg], compliance of the springs [mm/N]."""

    fruit: Fruit
    tips: Tips
    pose: Pose
    C: np.ndarray


def random_square(rng: np.random.Generator) -> SquareScene:
    """Draw a scene; whether all domes touch within their faces is seen where it is solved."""
    spacing, radius = float(rng.uniform(3.5, 8.0)), float(rng.uniform(25.0, 60.0))
    side = spacing * float(rng.uniform(0.8, 0.95))
    dome = side * float(rng.uniform(1.0, 2.5))
    travel, turn = spacing * float(rng.uniform(0.04, 0.08)), rng.uniform(0.0, 2.0 * np.pi)
    tilt = float(rng.uniform(0.0, 0.8)) * np.degrees(travel / spacing)
    K_l, K_h = 10.0 ** rng.uniform(-1.0, 0.3), 10.0 ** rng.uniform(0.3, 1.3)
    return SquareScene(
        fruit=Fruit(shape="sphere", radius_mm=radius, thickness_mm=0.5 * radius, poisson=float(rng.uniform(0.2, 0.45))),
        tips=Tips(layout="square", shape="dome", dome_radius_mm=dome, side_mm=side, spacing_mm=spacing),
        pose=Pose(
            E=float(rng.uniform(0.5, 3.5)),
            travel=travel,
            tilt_deg=(tilt * float(np.cos(turn)), tilt * float(np.sin(turn))),
        ),
        C=np.diag(np.tile([1.0 / K_l, 1.0 / K_h], 2)),
    )


def square_checks(scene: SquareScene) -> tuple[ReferenceCheck, ...] | None:
    """Return the least certain force of a low and of a high tip; None where a dome is off, or runs off its face."""
    footprints = contact_footprints(scene.fruit, scene.tips)
    S = level_compliance(footprints, scene.fruit.poisson, np.zeros(()), nodes_between(footprints))
    info = SolveInfo(method="half-space", dofs=0, seconds=0.0, status="")
    known = FruitCompliance(tips=scene.tips.names, S=S, error_pair=0.0, error_own=0.0, info=info)
    where = Scene(fruit=scene.fruit, tips=scene.tips, press=Press(travel_mm=scene.pose.travel))
    found = pose_forces(where, known, scene.C, [scene.pose])
    if not (found.F > 0.0).all():
        return None
    radius = scene.fruit.radius_mm or 0.0
    sensor = DomeSensor(
        places=np.array(scene.tips.places_mm),
        dome=scene.tips.dome_radius_mm,
        C=scene.C,
        radius=radius,
        poisson=scene.fruit.poisson,
    )
    truth, _ = dome_forces(sensor, scene.pose.E, scene.pose.travel, scene.pose.tilt_deg)
    F, error = found.F[0], found.F_error[0]
    ratio = np.abs(F - truth) / (error + CELLS * truth)
    worst = [max(kind, key=lambda tip: ratio[tip]) for kind in scene.tips.kinds]
    return tuple(
        ReferenceCheck(
            name=name,
            value=float(F[tip]),
            error=float(error[tip]),
            reference=float(truth[tip]),
            reference_error=float(CELLS * truth[tip]),
            source=SOURCE,
        )
        for name, tip in zip(("F_l of a square", "F_h of a square"), worst, strict=True)
    )


def square_scenes(count: int, seed: int) -> Iterator[Sequence[ReferenceCheck]]:
    """Yield the checks of a number of scenes whose domes all touch within their faces."""
    rng, found = np.random.default_rng(seed), 0
    while found < count:
        try:
            checks = square_checks(random_square(rng))
        except InputError:  # no such fruit, or a pose too steep
            continue
        if checks is not None:
            found += 1
            yield checks
