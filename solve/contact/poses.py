"""Forces of one sensor in many poses: tilted to any side, set down off centre, on fruits of other radii and moduli.

Domes follow their law in closed form. Flat tips are pressed on cells: all poses on one coarse grid, which stays where
it is on the fruit, and the poses that were pressed hardest or tilted most on a finer one too, for the error.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cad.design.fruit import Fruit
from solve.arrays import Flags, Floats, Ints
from solve.contact.domes.law import domes_on
from solve.contact.scene import Place, Scene, check_scene
from solve.contact.scene_cells import CELLS, SceneCells, interference, posed, scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.fruit.compliance import FruitCompliance

# Order 1.5 of the cells' error in their number: what is left of the coarse grid's, over the step to the fine one.
LEFT = 1.0 / (1.0 - (CELLS["rolled"][0] / CELLS["rolled"][1]) ** 1.5)
COMPARED = 8  # poses that are pressed on both grids


@dataclass(frozen=True, kw_only=True)
class Pose:
    """One press: modulus E [MPa], travel [mm], tilt along and across [deg], place off centre along and across [mm].

    `radius_mm` is the radius of the fruit along the tips, whose radius across goes with it; None for that of the scene.
    """

    E: float
    travel: float
    tilt_deg: Place = (0.0, 0.0)
    off_centre_mm: Place = (0.0, 0.0)
    radius_mm: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseForces:
    """Forces F of the tips [N], shape (poses, tips), nan in a pose whose contact runs off the face of a dome.

    `F_error` [N] is how far each may be off, of which `F_profile` [N] is what large strain decides about domes: by how
    much less a sphere's own profile would carry than Hertz's paraboloid in small strain. `error` (poses,) is the
    largest relative error of a force above 0 [1]; `touching` (poses, tips) says which tips touch; `contact_radius` [mm]
    and `mean_pressure` [MPa], (poses, tips), are those of a round contact of the same area; `face_mm` (poses,) [mm] is
    how wide the face of a dome must be to hold its contact, 0 for other tips.
    """

    F: Floats
    F_error: Floats
    F_profile: Floats
    error: Floats
    touching: Flags
    contact_radius: Floats
    mean_pressure: Floats
    face_mm: Floats


def pose_forces(scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose]) -> PoseForces:
    """Return the forces in many poses, given the compliance of the fruit in `scene` and of the springs C [mm/N].

    C has shape (tips, tips). A fruit of another radius keeps the block of the scene's. Raises InputError where a pose
    is too steep or outside the domain of contact, SolveError when a solve is not exact.
    """
    scenes = _scenes(scene, poses)
    for each in dict.fromkeys(scenes):
        check_scene(each)
    C = np.asarray(C, dtype=np.float64)
    if scene.tips.tip_shape.obeys_hertz:
        return _of_domes(scene, compliance, C, poses, scenes)
    return _on_cells(scene, compliance, C, poses, scenes)


def _scenes(scene: Scene, poses: Sequence[Pose]) -> list[Scene]:
    known: dict[tuple[Place, Place, float | None], Scene] = {}
    scenes = []
    for pose in poses:
        key = pose.tilt_deg, pose.off_centre_mm, pose.radius_mm
        if key not in known:
            known[key] = posed_scene(scene, pose)
        scenes.append(known[key])
    return scenes


def posed_scene(scene: Scene, pose: Pose) -> Scene:
    """Return the scene in a pose: its press turned, the sensor moved, the fruit of another radius."""
    tilt, roll = pose.tilt_deg
    along, across = (a + b for a, b in zip(scene.off_centre_mm, pose.off_centre_mm, strict=True))
    press = dataclasses.replace(scene.press, tilt_deg=tilt, roll_deg=roll)
    fruit = scene.fruit
    if pose.radius_mm is not None and fruit.radius_mm is not None:
        wide = fruit.radius_across_mm and fruit.radius_across_mm * pose.radius_mm / fruit.radius_mm
        fruit = _of_radius(fruit, pose.radius_mm, wide)
    return dataclasses.replace(scene, fruit=fruit, press=press, off_centre_mm=(along, across))


def _of_radius(fruit: Fruit, radius: float, across: float | None) -> Fruit:
    if not fruit.whole:
        return dataclasses.replace(fruit, radius_mm=radius, radius_across_mm=across)
    given = dataclasses.asdict(fruit) | {"radius_mm": radius, "radius_across_mm": across}
    return Fruit(**{name: value for name, value in given.items() if name not in ("length_mm", "width_mm")})


def _of_domes(
    scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> PoseForces:
    E, travel = (np.array([getattr(pose, name) for pose in poses]) for name in ("E", "travel"))
    domes = domes_on(scene, compliance, C, scenes, E, travel)
    face = domes.face.max(axis=1)
    off_face = face > scene.tips.side_mm
    return PoseForces(
        F=np.where(off_face[:, None], np.nan, domes.F),
        F_error=domes.error,
        F_profile=domes.profile,
        error=domes.relative_error.max(axis=1),
        touching=domes.F > 0.0,
        contact_radius=domes.contact_radius,
        mean_pressure=domes.mean_pressure,
        face_mm=face,
    )


def _on_cells(
    scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> PoseForces:
    farthest = max(pose.travel for pose in poses)
    steepest = max(scenes, key=_steepness)
    turned = dataclasses.replace(scene, press=steepest.press)
    coarse, fine = scene_cells(turned, compliance, farthest, all(each.mirrored for each in scenes))
    F, area = _pressed(turned, coarse, C, poses, scenes)
    chosen = _spread(scenes)
    finer, _ = _pressed(turned, fine, C, [poses[i] for i in chosen], [scenes[i] for i in chosen])
    error = LEFT * _largest_step(F[chosen], finer) + compliance.error_pair
    return PoseForces(
        F=F,
        F_error=error * F,
        F_profile=np.zeros_like(F),
        error=np.full(len(F), error),
        touching=F > 0.0,
        contact_radius=np.sqrt(area / np.pi),
        mean_pressure=F / np.where(area > 0.0, area, 1.0),
        face_mm=np.zeros(len(F)),
    )


def _spread(scenes: Sequence[Scene]) -> Ints:
    """Return some of the poses, from the most to the least tilted one."""
    order = np.argsort([_steepness(each) for each in scenes])[::-1]
    return order[:: max(1, len(order) // COMPARED)]


def _largest_step(coarse: Floats, fine: Floats) -> float:
    """Return the largest relative step of a force above 0 from a coarse to a fine grid [1]."""
    steps = np.divide(np.abs(fine - coarse), fine, out=np.zeros_like(fine), where=fine > 0.0)
    return float(steps.max(initial=0.0))


def _steepness(scene: Scene) -> float:
    return float(np.hypot(*scene.turn))


def _pressed(
    built: Scene, grid: SceneCells, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> tuple[Floats, Floats]:
    """Return the forces [N] and the areas that touch [mm^2] on the cells of `built`, both (poses, tips)."""
    contact, cells = UnilateralContact(grid.cells), grid.cells
    moved = {each: posed(grid, built, each) for each in dict.fromkeys(scenes)}
    F, area = (np.zeros((len(poses), len(cells.centres))) for _ in range(2))
    for number, (pose, each) in enumerate(zip(poses, scenes, strict=True)):
        entered = interference(each, moved[each], pose.travel)
        state = contact.solve(entered, pose.E * C + grid.compliance_correction)
        F[number] = pose.E * state.F
        area[number] = cells.tips.T @ (cells.areas * (state.pressure > 0.0))
    return F, area
