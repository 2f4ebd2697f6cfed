"""Tip forces of one sensor in many poses: tilted in any direction, off centre, and on fruits of different shapes.

Domes obey the dome law. All other tips are solved on contact cells, and all poses share one coarse grid of cells, which
is fixed to the fruit. To estimate the error, some poses from the most to the least tilted are also solved on a finer
grid.
"""

import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from sensor.arrays import Flags, Floats, Ints
from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion
from sensor.record import Record
from solve.contact.domes.fruit_under_domes import fruit_under_domes
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.scene import Point, Scene, check_scene
from solve.contact.scene_cells import WHOLE_CELLS, SceneCells, explain_skin_error, initial_gap, scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_shape import fruit_slope

# Ratio of the error on the coarse grid to the difference between the two grids. The error is assumed proportional to
# the number of cells per side to the power of -1.5.
ERROR_RATIO = 1.0 / (1.0 - (WHOLE_CELLS[0] / WHOLE_CELLS[1]) ** 1.5)
COMPARED_POSES = 8  # approximate number of poses that are solved on both grids
TINY_FORCE = 1e-300  # force that replaces 0 in a divisor [N]


@dataclass(frozen=True, kw_only=True)
class Stand:
    """The position of a sensor on a fruit: its tilt [deg] and its offset from the apex [mm], along the tips and across.

    `radii_mm` are the principal radii of the fruit. `azimuth_deg` is the angle from the line along the tips to the
    direction of the first radius. `thickness_mm` is the thickness of the flesh. If one of them is None, the scene's
    fruit keeps its own value.

    With `from_touch`, the sensor is pressed by hand. The tilt is then relative to the normal of the skin under the
    sensor, and the travel starts at the first touch. `tilt_change_deg` is the change in tilt since the first touch.
    """

    tilt_deg: Point = (0.0, 0.0)
    off_centre_mm: Point = (0.0, 0.0)
    radii_mm: Point | None = None
    azimuth_deg: float | None = None
    thickness_mm: float | None = None
    from_touch: bool = False
    tilt_change_deg: Point = (0.0, 0.0)

    def after(self, fraction: float) -> Self:
        """Return the stand after a fraction of a press [1]; the tilt changes linearly by `tilt_change_deg`."""
        along, across = self.tilt_change_deg
        return dataclasses.replace(self, tilt_change_deg=(fraction * along, fraction * across))


@dataclass(frozen=True, kw_only=True)
class Pose:
    """One press: the modulus E [MPa] of the fruit, the travel [mm], and the position of the sensor on the fruit."""

    E: float
    travel: float
    stand: Stand = Stand()


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PoseForces(Record):
    """The tip forces in many poses, with their errors and contacts; arrays are (poses, tips) or (poses,).

    `F` [N] holds the forces. The forces are nan in a pose whose contact reaches the edge of a dome's face. `F_error`
    [N] bounds the error of each force. `common_error` [N] is the error of each force if the errors of all tips have the
    same sign. Neither includes `F_flesh` [N], the effect of the material law on forces under domes. By this amount, the
    forces are larger with Hencky's law than with the neo-Hookean law, and smaller with Storakers's law. `error` [1] is
    the largest relative error of a nonzero force in a pose. `touching` marks the tips in contact. `contact_radius`
    [mm], `mean_pressure` [MPa] and its error `pressure_error` [MPa] describe a circular contact of the same area.
    `face_mm` [mm] is the face diameter that a dome needs for its contact in a pose; for other tips, it is 0.
    """

    F: Floats
    F_error: Floats
    common_error: Floats
    F_flesh: Floats
    error: Floats
    touching: Flags
    contact_radius: Floats
    mean_pressure: Floats
    pressure_error: Floats
    face_mm: Floats


def pose_forces(scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose]) -> PoseForces:
    """Return the tip forces of a sensor in many poses.

    `compliance` is the compliance of the fruit in `scene`, and C (tips, tips) [mm/N] is the compliance of the springs.
    A fruit with another radius is represented by the block of the scene's fruit. Raises InputError if a tip meets the
    fruit at more than 20 deg, or a pose is outside the domain of the contact solver. Also raises InputError if the skin
    is too stiff or too soft for the model, and SolveError if a solve does not converge.
    """
    # Many poses share a stand, so the scene of each stand is made and checked only once.
    scenes_of_stands: dict[Stand, Scene] = {}
    for pose in poses:
        if pose.stand not in scenes_of_stands:
            scenes_of_stands[pose.stand] = posed_scene(scene, pose.stand)
            check_scene(scenes_of_stands[pose.stand])
    scenes = [scenes_of_stands[pose.stand] for pose in poses]
    C = np.asarray(C, dtype=np.float64)
    if compliance.skin is not None:  # the compliance under a skin is first evaluated at each modulus
        return _forces_under_skin(scene, compliance, C, poses)
    if scene.obeys_dome_law:
        return _dome_forces(scene, compliance, C, poses, scenes)
    with explain_skin_error(scene, compliance):
        return _cell_forces(scene, compliance, C, poses, scenes)


def posed_scene(scene: Scene, stand: Stand) -> Scene:
    """Return the scene with the sensor at the position on the fruit that `stand` describes.

    If the stand states radii, an azimuth or a thickness, the fruit of the scene is changed too.
    """
    fruit = _changed_fruit(scene.fruit, stand.radii_mm, stand.azimuth_deg, stand.thickness_mm)
    off_centre = (scene.off_centre_mm[0] + stand.off_centre_mm[0], scene.off_centre_mm[1] + stand.off_centre_mm[1])
    tilt, roll = stand.tilt_deg
    if stand.from_touch and any(off_centre) and scene.is_fruit_curved:
        # The tilt of the hand is relative to the normal under the sensor, but the tilt of a scene is relative to the
        # normal at the apex. The angles between the two normals are added: along the tips, and across them.
        normal_deg = np.degrees(np.arctan(fruit_slope(fruit, *off_centre)))
        tilt = tilt + float(normal_deg[0])
        roll = roll + float(normal_deg[1])
    return dataclasses.replace(
        scene,
        fruit=fruit,
        press=_tilted_press(scene.press, tilt, roll),
        off_centre_mm=off_centre,
        from_touch=stand.from_touch,
        tilt_change_deg=stand.tilt_change_deg,
    )


@functools.lru_cache(maxsize=256)
def _tilted_press(press: PressMotion, tilt: float, roll: float) -> PressMotion:
    """Return a copy of the press with the given tilt and roll [deg].

    The result is cached, so that scenes share one object.
    """
    return dataclasses.replace(press, tilt_deg=tilt, roll_deg=roll)


@functools.lru_cache(maxsize=256)
def _changed_fruit(fruit: Fruit, radii: Point | None, azimuth: float | None, thickness: float | None) -> Fruit:
    """Return a copy of the fruit with the given radii [mm], azimuth [deg] and thickness [mm].

    If an argument is None, the fruit keeps its own value. A sphere uses only the first radius, and a block uses
    neither. The result is cached, so that all poses on the same fruit share one object.
    """
    changes: dict[str, Any] = {}
    if radii is not None and fruit.radius_mm is not None:
        changes["radius_mm"] = radii[0]
        if fruit.shape == "ellipsoid":
            changes["radius_across_mm"] = radii[1]
    if azimuth is not None:
        changes["azimuth_deg"] = azimuth
    if thickness is not None:
        changes["thickness_mm"] = thickness
    if changes and fruit.is_whole:  # the length and the width follow from the radii and the thickness
        changes |= {"length_mm": None, "width_mm": None}
    return dataclasses.replace(fruit, **changes) if changes else fruit


def _dome_forces(
    scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> PoseForces:
    """Return the forces of domes from the dome law, given the poses and the scene of each pose.

    `compliance` is the compliance of the fruit in `scene`, and C (tips, tips) [mm/N] is the compliance of the springs.
    The forces are nan in a pose whose contact reaches the edge of a face, because the law is not valid there.
    """
    E = np.array([pose.E for pose in poses])
    travel = np.array([pose.travel for pose in poses])
    fruit = fruit_under_domes(scene, compliance, [scene_of_pose.fruit for scene_of_pose in scenes])
    domes = dome_forces(dome_poses(scenes, travel), E, C, fruit)
    face_diameter = domes.face.max(axis=1)
    is_off_face = face_diameter > scene.tips.side_mm
    return PoseForces(
        F=np.where(is_off_face[:, None], np.nan, domes.F),
        F_error=domes.error,
        common_error=domes.common_error,
        F_flesh=domes.flesh,
        error=domes.relative_error.max(axis=1),
        touching=domes.F > 0.0,
        contact_radius=domes.contact_radius,
        mean_pressure=domes.mean_pressure,
        pressure_error=domes.mean_pressure * (domes.relative_error + domes.pressure_error),
        face_mm=face_diameter,
    )


def _cell_forces(
    scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> PoseForces:
    """Return the forces on a coarse grid of cells, given the poses and the scene of each pose.

    `compliance` is the compliance of the fruit in `scene`, and C (tips, tips) [mm/N] is the compliance of the springs.
    The grid is made for the steepest pose, and all poses share it. To estimate the errors, about COMPARED_POSES poses
    are also solved on a finer grid.
    """
    tilts = [float(np.hypot(*scene_of_pose.tilt_tangents)) for scene_of_pose in scenes]
    grid_scene, coarse_grid, fine_grid = _shared_grids(scene, compliance, poses, scenes, tilts)
    F, area = _grid_forces(grid_scene, coarse_grid, C, poses, scenes)

    order = np.argsort(tilts)[::-1]  # from the most to the least tilted pose
    compared_poses = order[:: max(1, len(order) // COMPARED_POSES)]  # evenly spread
    fine_F, _ = _grid_forces(
        grid_scene, fine_grid, C, [poses[i] for i in compared_poses], [scenes[i] for i in compared_poses]
    )
    moduli = np.array([pose.E for pose in poses])
    largest_difference, total_difference = _grid_differences(F, fine_F, compared_poses, moduli)

    relative_error = ERROR_RATIO * largest_difference + compliance.difference_error
    common_relative_error = ERROR_RATIO * total_difference + compliance.difference_error
    mean_pressure = F / np.where(area > 0.0, area, 1.0)  # 0 without contact, where F is 0
    return PoseForces(
        F=F,
        F_error=relative_error * F,
        common_error=common_relative_error * _decrease_by_softer_flesh(compliance, C, moduli, F),
        F_flesh=np.zeros_like(F),
        error=np.full(len(F), relative_error),
        touching=F > 0.0,
        contact_radius=np.sqrt(area / np.pi),
        mean_pressure=mean_pressure,
        pressure_error=relative_error * mean_pressure,
        face_mm=np.zeros(len(F)),  # used only for domes
    )


def _shared_grids(
    scene: Scene, compliance: FruitCompliance, poses: Sequence[Pose], scenes: Sequence[Scene], tilts: Sequence[float]
) -> tuple[Scene, SceneCells, SceneCells]:
    """Return the scene for which the shared grids of all poses are made, the coarse grid and the fine grid.

    `compliance` is the compliance of the fruit in `scene`. `scenes` holds the scene of each pose, and `tilts` [1] the
    tangent of its inclination. The overlaps with the fruit are farthest from the centres of the tips in the steepest
    pose, so this pose determines the footprints.
    """
    largest_travel = max(pose.travel for pose in poses)
    steepest_scene = scenes[tilts.index(max(tilts))]
    grid_scene = dataclasses.replace(scene, press=steepest_scene.press)
    is_half = all(scene_of_pose.is_symmetric for scene_of_pose in scenes)
    coarse_grid, fine_grid = scene_cells(grid_scene, compliance, largest_travel, is_half)
    return grid_scene, coarse_grid, fine_grid


def _grid_differences(F: Floats, fine_F: Floats, compared_poses: Ints, moduli: Floats) -> tuple[float, float]:
    """Return the largest relative difference between the grids [1], first in a single force, then in the total force.

    F (poses, tips) [N] holds the forces on the coarse grid. `fine_F` [N] holds the forces on the fine grid, in the
    poses with the indices `compared_poses`. `moduli` (poses,) [MPa] holds the modulus of the fruit in each pose.
    """
    differences = np.divide(np.abs(fine_F - F[compared_poses]), fine_F, out=np.zeros_like(fine_F), where=fine_F > 0.0)

    # The common error of all tips is estimated from their total force. A tip that has just touched has a large relative
    # error of its own, which does not act like an error in the modulus of the flesh. For the same reason, differences
    # are relative to the largest total force at the same modulus.
    total_force = F.sum(axis=1)
    largest_total = np.array([total_force[moduli == E].max(initial=TINY_FORCE) for E in moduli[compared_poses]])
    total_differences = np.abs(fine_F.sum(axis=1) - total_force[compared_poses]) / largest_total
    return float(differences.max(initial=0.0)), float(total_differences.max())


def _decrease_by_softer_flesh(compliance: FruitCompliance, C: Floats, moduli: Floats, F: Floats) -> Floats:
    """Return the decrease of the forces F (poses, tips) [N] that a common relative error of 1 causes.

    A relative error common to all forces has the same effect as softer flesh. Let s be the compliance S / E of the
    flesh, C the compliance of the springs, and x the travel of the tips. The forces obey (C + s) F = x. A relative
    increase e of s therefore decreases them by e (C + s)^-1 s F. An error of 1 corresponds to the increase e at which,
    to first order, the total force of a level press vanishes. The caller multiplies the result by the actual error.
    `moduli` (poses,) [MPa] holds the modulus of the fruit in each pose.
    """
    softening_at = {E: _softening_without_force(compliance.S / E, C) for E in np.unique(moduli).tolist()}
    decrease = np.zeros_like(F)  # remains 0 for tips out of contact
    for pose, E in enumerate(moduli.tolist()):
        touching_tips = np.flatnonzero(F[pose] > 0.0)
        entries = np.ix_(touching_tips, touching_tips)
        flesh_compliance = compliance.S[entries] / E
        decrease_per_softening = np.linalg.solve(
            C[entries] + flesh_compliance, flesh_compliance @ F[pose, touching_tips]
        )
        decrease[pose, touching_tips] = softening_at[E] * decrease_per_softening
    return decrease


def _softening_without_force(flesh_compliance: Floats, C: Floats) -> float:
    """Return the relative increase in compliance of the flesh [1] at which the total force of a level press vanishes.

    The force is assumed to decrease linearly at its initial rate. `flesh_compliance` and the compliance C of the
    springs are (tips, tips) [mm/N]. All tips touch.
    """
    level_forces = np.linalg.solve(C + flesh_compliance, np.ones(len(C)))  # forces per unit travel
    # With s = `flesh_compliance` and F = `level_forces`, the forces decrease by (C + s)^-1 s F per unit increase.
    decrease_per_softening = np.linalg.solve(C + flesh_compliance, flesh_compliance @ level_forces)
    return float(level_forces.sum() / decrease_per_softening.sum())


def _grid_forces(
    grid_scene: Scene, grid: SceneCells, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> tuple[Floats, Floats]:
    """Return the forces [N] and the contact areas [mm^2] on one grid of cells, both (poses, tips).

    The cells keep their positions on the block, under the tips of `grid_scene`, so that one compliance matrix serves
    all poses. C (tips, tips) [mm/N] is the compliance of the springs, and `scenes` holds the scene of each pose.
    """
    cells = grid.cells
    contact = UnilateralContact(cells)
    # The gap depends only on the scene, and many poses share a scene. Equal scenes are the same dictionary key.
    grid_of_scene = {}
    for scene in dict.fromkeys(scenes):
        grid_of_scene[scene] = dataclasses.replace(grid, gap=initial_gap(scene, grid_scene, cells))
    F = np.zeros((len(poses), len(cells.centres)))
    area = np.zeros_like(F)
    for i, (pose, scene) in enumerate(zip(poses, scenes, strict=True)):
        interference = grid_of_scene[scene].interference(scene, pose.travel)
        # Contact is solved for forces divided by E [mm^2], so compliances are multiplied by E [1/mm].
        solution = contact.solve(interference, pose.E * C + grid.compliance_correction)
        F[i] = pose.E * solution.F
        area[i] = cells.tips.T @ (cells.areas * (solution.pressure > 0.0))
    return F, area


def _forces_under_skin(scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose]) -> PoseForces:
    """Return the forces on flesh under a skin, whose compliance times E depends on the modulus of the flesh.

    The compliance is tabulated against the modulus, so poses with the same modulus are solved together. C (tips, tips)
    [mm/N] is the compliance of the springs. The results are in the order of `poses`.
    """
    moduli = np.array([pose.E for pose in poses])
    solved_poses = []  # indices of the poses, in the order in which they are solved
    solved_forces = []  # one record per modulus
    for E in np.unique(moduli):
        poses_at_E = np.flatnonzero(moduli == E)
        solved_poses.append(poses_at_E)
        # `at` returns a compliance without a table, so `pose_forces` does not call this function again.
        solved_forces.append(pose_forces(scene, compliance.at(float(E)), C, [poses[i] for i in poses_at_E.tolist()]))
    row_of_pose = np.argsort(np.concatenate(solved_poses))
    arrays: dict[str, Any] = {}  # the fields of `PoseForces`, each with one row per pose
    for field in dataclasses.fields(PoseForces):
        rows = np.concatenate([getattr(forces, field.name) for forces in solved_forces])
        arrays[field.name] = rows[row_of_pose]
    return PoseForces(**arrays)
