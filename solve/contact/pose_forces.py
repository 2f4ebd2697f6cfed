"""Forces of one sensor in many poses: tilted in any direction, off centre, on fruits of other radii and moduli.

Domes follow their law in closed form. Flat tips are solved on cells. All poses use one coarse grid, which is fixed to
the fruit. Some poses, from the most to the least tilted, are also solved on a finer grid, which gives the error.
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
from solve.contact.domes.fruit_under_domes import dome_body
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.scene import Point, Scene, check_scene
from solve.contact.scene_cells import WHOLE_CELLS, SceneCells, initial_gap, naming_the_skin, scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_shape import fruit_slope

# Error of the coarse grid over the step to the fine one: the error falls with the number of cells at order 1.5.
LEFT = 1.0 / (1.0 - (WHOLE_CELLS[0] / WHOLE_CELLS[1]) ** 1.5)
COMPARED = 8  # approximate number of poses that are solved on both grids
NO_FORCE = 1e-300  # [N], replaces a force of 0 as a divisor


@dataclass(frozen=True, kw_only=True)
class Stand:
    """The position of a sensor on a fruit: tilt [deg] and distance from the apex [mm], along and across the tips.

    `radii_mm` are the principal radii of the fruit, the first at an azimuth [deg] from the line along the tips.
    `thickness_mm` is the thickness of its flesh. If they are None, they are those of the scene's fruit.

    With `from_touch`, the sensor is pressed by hand. The tilt is measured against the normal of the skin under the
    sensor, and travel from the first touch. After the touch the tilt has changed by `turned_deg`.
    """

    tilt_deg: Point = (0.0, 0.0)
    off_centre_mm: Point = (0.0, 0.0)
    radii_mm: Point | None = None
    azimuth_deg: float | None = None
    thickness_mm: float | None = None
    from_touch: bool = False
    turned_deg: Point = (0.0, 0.0)

    def after(self, fraction: float) -> Self:
        """Return the stand after a fraction of a press [1], in which the tilt changes linearly by `turned_deg`."""
        along, across = self.turned_deg
        return dataclasses.replace(self, turned_deg=(fraction * along, fraction * across))


@dataclass(frozen=True, kw_only=True)
class Pose:
    """One press: the modulus E [MPa] of the fruit, the travel [mm], and the position of the sensor on the fruit."""

    E: float
    travel: float
    stand: Stand = Stand()


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PoseForces(Record):
    """Forces F of the tips [N], shape (poses, tips); nan in a pose whose contact reaches the edge of a dome's face.

    `F_error` [N] bounds the error of each force. `error_alike` [N] is the joint error of all forces if the errors have
    one sign under all tips. Neither contains `F_flesh` [N], the increase of F under domes by Hencky's law of flesh over
    the neo-Hookean one, and the decrease by Storakers' law. `error` (poses,) is the largest relative error of a force
    above 0 [1]. `touching` (poses, tips) is True for tips in contact. `contact_radius` [mm], `mean_pressure` [MPa] and
    its error `pressure_error` [MPa], all (poses, tips), are for a round contact of the same area. `face_mm` (poses,)
    [mm] is the face diameter that a dome needs to hold its contact, 0 for other tips.
    """

    F: Floats
    F_error: Floats
    error_alike: Floats
    F_flesh: Floats
    error: Floats
    touching: Flags
    contact_radius: Floats
    mean_pressure: Floats
    pressure_error: Floats
    face_mm: Floats


def pose_forces(scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose]) -> PoseForces:
    """Return the forces in many poses, given the compliance of the fruit in `scene` and of the springs C [mm/N].

    C has shape (tips, tips). A fruit of another radius keeps the block of the scene's fruit. Raises InputError if a
    pose is too steep or outside the domain of contact, and SolveError if a solve does not converge.
    """
    # Many poses share a scene; each scene is made once, and its first touch found once.
    made: dict[Stand, Scene] = {}
    for pose in poses:
        if pose.stand not in made:
            made[pose.stand] = posed_scene(scene, pose.stand)
            check_scene(made[pose.stand])
    scenes = [made[pose.stand] for pose in poses]
    C = np.asarray(C, dtype=np.float64)
    if compliance.skin is not None:
        return _at_each_modulus(scene, compliance, C, poses)
    if scene.on_domes:
        return _dome_forces(scene, compliance, C, poses, scenes)
    with naming_the_skin(scene, compliance):
        return _cell_forces(scene, compliance, C, poses, scenes)


def posed_scene(scene: Scene, stand: Stand) -> Scene:
    """Return the scene of a stand: its press tilted, the sensor moved, on the fruit of the stand."""
    fruit = _fruit_met(scene.fruit, stand.radii_mm, stand.azimuth_deg, stand.thickness_mm)
    off_centre = (scene.off_centre_mm[0] + stand.off_centre_mm[0], scene.off_centre_mm[1] + stand.off_centre_mm[1])
    tilt, roll = stand.tilt_deg
    if stand.from_touch and any(off_centre) and scene.curved:
        # A hand tilts against the normal under the sensor; the tilt of a scene is measured at the apex.
        normal = np.degrees(np.arctan(fruit_slope(fruit, *off_centre)))
        tilt, roll = tilt + float(normal[0]), roll + float(normal[1])
    return dataclasses.replace(
        scene,
        fruit=fruit,
        press=_turned(scene.press, tilt, roll),
        off_centre_mm=off_centre,
        from_touch=stand.from_touch,
        turned_deg=stand.turned_deg,
    )


@functools.lru_cache(maxsize=256)
def _turned(press: PressMotion, tilt: float, roll: float) -> PressMotion:
    """Return the press with another tilt and roll [deg]; cached, because many poses share one stand."""
    return dataclasses.replace(press, tilt_deg=tilt, roll_deg=roll)


@functools.lru_cache(maxsize=256)
def _fruit_met(fruit: Fruit, radii: Point | None, azimuth: float | None, thickness: float | None) -> Fruit:
    """Return the fruit with other radii [mm], azimuth [deg] and thickness [mm]; None keeps its own value.

    It is cached for the many poses on it. A sphere takes only the first radius, a block neither.
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
    if changes and fruit.whole:  # length and width follow from the radii and the thickness
        changes |= {"length_mm": None, "width_mm": None}
    return dataclasses.replace(fruit, **changes) if changes else fruit


def _dome_forces(
    scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> PoseForces:
    """Return the forces of domes by their law, for one scene per pose.

    They are nan in a pose whose contact reaches the edge of a face, where the law does not hold.
    """
    E = np.array([pose.E for pose in poses])
    travel = np.array([pose.travel for pose in poses])
    body = dome_body(scene, compliance, [each.fruit for each in scenes])
    domes = dome_forces(dome_poses(scenes, travel), E, C, body)
    face = domes.face.max(axis=1)
    off_face = face > scene.tips.side_mm
    return PoseForces(
        F=np.where(off_face[:, None], np.nan, domes.F),
        F_error=domes.error,
        error_alike=domes.error_alike,
        F_flesh=domes.flesh,
        error=domes.relative_error.max(axis=1),
        touching=domes.F > 0.0,
        contact_radius=domes.contact_radius,
        mean_pressure=domes.mean_pressure,
        pressure_error=domes.mean_pressure * (domes.relative_error + domes.pressure_error),
        face_mm=face,
    )


def _cell_forces(
    scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> PoseForces:
    """Return the forces on a coarse grid of cells, for one scene per pose, with errors from a finer grid.

    The grid is made for the steepest pose and shared by all. Only some of the poses are solved on the finer grid.
    """
    farthest = max(pose.travel for pose in poses)
    steepness = [float(np.hypot(*each.turn)) for each in scenes]
    steepest = scenes[steepness.index(max(steepness))]
    built = dataclasses.replace(scene, press=steepest.press)
    coarse, fine = scene_cells(built, compliance, farthest, all(each.mirrored for each in scenes))
    F, area = _grid_forces(built, coarse, C, poses, scenes)

    # About COMPARED poses, evenly from the most to the least tilted one, are solved on the finer grid too.
    order = np.argsort(steepness)[::-1]
    compared = order[:: max(1, len(order) // COMPARED)]
    finer, _ = _grid_forces(built, fine, C, [poses[i] for i in compared], [scenes[i] for i in compared])

    moduli = np.array([pose.E for pose in poses])
    step, total_step = _grid_steps(F, finer, compared, moduli)
    error = LEFT * step + compliance.error_pair
    common_error = LEFT * total_step + compliance.error_pair
    mean_pressure = F / np.where(area > 0.0, area, 1.0)
    return PoseForces(
        F=F,
        F_error=error * F,
        error_alike=common_error * _softer_flesh_fall(compliance, C, moduli, F),
        F_flesh=np.zeros_like(F),
        error=np.full(len(F), error),
        touching=F > 0.0,
        contact_radius=np.sqrt(area / np.pi),
        mean_pressure=mean_pressure,
        pressure_error=error * mean_pressure,
        face_mm=np.zeros(len(F)),
    )


def _grid_steps(F: Floats, finer: Floats, compared: Ints, moduli: Floats) -> tuple[float, float]:
    """Return the largest relative changes from the coarse to the fine grid [1]: of a force, and of their sum.

    F (poses, tips) are the forces on the coarse grid, `finer` those on the fine grid in the `compared` poses. `moduli`
    (poses,) are the moduli of all poses.
    """
    steps = np.divide(np.abs(finer - F[compared]), finer, out=np.zeros_like(finer), where=finer > 0.0)

    # The joint error of all tips is estimated from the sum of their forces. A tip that has just touched has a large
    # relative error of its own, which is not due to the flesh.
    total = F.sum(axis=1)
    largest_total = np.array([total[moduli == E].max(initial=NO_FORCE) for E in moduli[compared]])
    total_step = float((np.abs(finer.sum(axis=1) - total[compared]) / largest_total).max())
    return float(steps.max(initial=0.0)), total_step


def _softer_flesh_fall(compliance: FruitCompliance, C: Floats, moduli: Floats, F: Floats) -> Floats:
    """Return the decrease of the forces F (poses, tips) [N] for a common error of 1, at the modulus of each pose [MPa].

    The caller multiplies it by the joint relative error of all forces, which acts like flesh that is softer than
    assumed. The softening is the one that removes the whole force of a level press, to first order; poses of one
    modulus share it.
    """
    softening = {}
    for E in np.unique(moduli).tolist():
        by_flesh = compliance.S / E
        level = np.linalg.solve(C + by_flesh, np.ones(len(C)))  # forces for a unit travel
        softening[E] = level.sum() / np.linalg.solve(C + by_flesh, by_flesh @ level).sum()

    # Only tips in contact take part.
    fall = np.zeros_like(F)
    for row, E, forces in zip(fall, moduli.tolist(), F, strict=True):
        on = np.flatnonzero(forces > 0.0)
        by_flesh = compliance.S[np.ix_(on, on)] / E
        row[on] = softening[E] * np.linalg.solve(C[np.ix_(on, on)] + by_flesh, by_flesh @ forces[on])
    return fall


def _grid_forces(
    built: Scene, grid: SceneCells, C: Floats, poses: Sequence[Pose], scenes: Sequence[Scene]
) -> tuple[Floats, Floats]:
    """Return the forces [N] and the contact areas [mm^2], both (poses, tips), on one grid of cells.

    The cells stay where the scene `built` places them on the block, so that one matrix serves all poses.
    """
    cells = grid.cells
    contact = UnilateralContact(cells)
    grids = {}
    for scene in dict.fromkeys(scenes):
        grids[scene] = dataclasses.replace(grid, gap=initial_gap(scene, built, cells))
    F = np.zeros((len(poses), len(cells.centres)))
    area = np.zeros_like(F)
    for i, (pose, scene) in enumerate(zip(poses, scenes, strict=True)):
        interference = grids[scene].interference(scene, pose.travel)
        state = contact.solve(interference, pose.E * C + grid.compliance_correction)
        F[i] = pose.E * state.F
        area[i] = cells.tips.T @ (cells.areas * (state.pressure > 0.0))
    return F, area


def _at_each_modulus(scene: Scene, compliance: FruitCompliance, C: Floats, poses: Sequence[Pose]) -> PoseForces:
    """Return the forces in poses on flesh under a skin, whose compliance (times E) depends on the modulus."""
    moduli = np.array([pose.E for pose in poses])
    columns: dict[str, Any] = {}
    for E in np.unique(moduli):
        at_E = np.flatnonzero(moduli == E)
        forces = pose_forces(scene, compliance.at(float(E)), C, [poses[i] for i in at_E.tolist()])
        for field in dataclasses.fields(PoseForces):
            values = getattr(forces, field.name)
            columns.setdefault(field.name, np.zeros((len(poses), *values.shape[1:]), dtype=values.dtype))[at_E] = values
    return PoseForces(**columns)
