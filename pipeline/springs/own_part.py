"""The stiffness of a part that the user made, with its error bar.

A part is held and pressed as the housing of a design is, or at faces that points name. If most of it is an extrusion,
its section is meshed and swept into hexahedra; any other part is meshed with tetrahedra.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cad.parts.housing import Housing
from cad.parts.pin import pin_compliance
from mesh.own_part import SIDES, FineCorners, SweptPart, swept_part
from mesh.own_tetrahedra import tetrahedral_mesh
from mesh.session import MeshError
from pipeline.springs.mounts import mount_layers
from sensor.arrays import Floats
from sensor.quantity import Estimate, InputError, validation_error
from sensor.record import Record
from sensor.turns import in_turn
from solve.housing.stiffness import STRAIN_ERROR_SHARE
from solve.own_part import (
    ERROR_FLOOR,
    ERROR_SHARE,
    PartCompliance,
    extrapolate_to_size_zero,
    left_out,
    strained_corners,
    swept_compliance,
    tetrahedral_compliance,
)

if TYPE_CHECKING:
    import cadquery as cq

    from cad.checks.own_part import Extrusion, Place
    from cad.parts.part import Part
    from solve.housing.elastic_layer import ElasticLayer

HELD = "mounting_holes"  # the solver's name for the faces that do not move
# Scale of the section and number of layers through half the depth: of the coarse mesh, and of the fine one, whose
# result is returned.
_MESHES = ((4.0, 1), (3.0, 2))
# Size of elements at sharp inner corners over the thickness, in the coarse and in the fine mesh; elsewhere it is 1.
_CORNER_SIZES = (0.2, 0.1)
# Towards a corner, strain grows at most like r^-0.5, as at a slit, so its energy within a radius grows at most like the
# radius. The error that remains in the fine mesh is thus this share of the change of K between element size 1 and the
# size in the coarse mesh. M. L. Williams, J. Appl. Mech. 19, 526.
_CORNER_ERROR = _CORNER_SIZES[1] / (1.0 - _CORNER_SIZES[0])
_MOST_STIFF = 0.02  # largest K of a part that bends, over E times the distance from pressed to held faces
# Scales of tetrahedra, refined until the error bar is small enough; 186,000 unknowns took 38 s of CPU time and 1.4 GiB.
_SCALES = (2.0, 1.4, 1.0, 0.7, 0.5, 0.35)
_FEWEST = 3  # minimum number of meshes for an extrapolation
_FINE_ENOUGH = 0.01  # relative error at which the refinement ends
_SWEPT_ENOUGH = 0.1  # largest relative error of a sweep; above it, too much of the part is not swept
MOST_SECONDS = 120.0  # limit of CPU time for all meshes of tetrahedra
MOST_BYTES = 6.0 * 2**30  # limit of memory for one mesh of tetrahedra
_SECONDS_PER_UNKNOWN = 2e-4
_BYTES_PER_UNKNOWN = 7e3
_UP = (0.0, 0.0, 1.0)

Where = str | tuple[float, float, float] | Sequence[tuple[float, float, float]]
"""One or more faces: a tag, a point on a face, or points on several faces [mm]."""


@dataclass(frozen=True, kw_only=True, repr=False)
class PressedFace(Record):
    """One pressed face of a part: its stiffness K [N/mm] with its relative error, and its largest strain.

    `K_held` [N/mm] is its stiffness if the walls of the design's screw holes are held instead of the design's covers.
    `strain_per_N` [1/N] is the largest strain at a round inner corner, with its relative error `strain_error`. If it is
    unknown, `no_strain` gives the reason.
    """

    K: float
    K_error: float
    K_held: float | None = None
    strain_per_N: float | None = None
    strain_error: float | None = None
    no_strain: str = ""

    @property
    def estimate(self) -> Estimate:
        """Return the stiffness with its error bar [N/m]."""
        return Estimate(self.K, self.K_error * self.K, "N/mm").times(1e3, "N/m")


@dataclass(frozen=True, kw_only=True, repr=False)
class PartStiffness(Record):
    """The stiffness of each pressed face of a part, which `stiffness` returns.

    Attributes
    ----------
    faces : mapping of str to PressedFace
        For each pressed face by name: stiffness `K` [N/mm] and its relative error `K_error` [1]. `strain_per_N` [1/N]
        is the largest strain at a round inner corner, if it is known.
    material : tuple of float
        Young's modulus [MPa] and Poisson's ratio [1].
    method : str
        How the part was solved.
    held_by : str
        What holds the part.
    dofs : int
        Number of unknowns of the finest mesh.
    left_out_mm3 : float
        Volume that the mesh has too much or too little [mm^3].
    left_out_at : tuple of float or None
        The place where most of this volume lies [mm]; None if nothing is left out.
    seconds : float
        Duration of the solution [s].
    curve : tuple of tuple of float
        Unknowns, seconds and stiffnesses [N/m] of each mesh of tetrahedra; empty for a part that was swept.
    not_swept : str
        The reason for tetrahedra; empty for a part that was swept.

    Examples
    --------
    >>> import cadquery as cq
    >>> outline = [(0, 0), (20, 0), (20, -3), (21, -3), (21, 1), (0, 1)]
    >>> leaf = cq.Workplane("XZ").polyline(outline).close().extrude(6)
    >>> found = twintip.stiffness(leaf, held=(0, -3, 0.5), pressed={"tip": (20.5, -3, -3)}, E_MPa=2000)
    >>> found.faces["tip"].K_error < 0.01
    True
    """

    faces: Mapping[str, PressedFace]
    material: tuple[float, float]
    method: str
    held_by: str
    dofs: int
    left_out_mm3: float
    left_out_at: tuple[float, float, float] | None
    seconds: float = 0.0
    curve: tuple[tuple[float, ...], ...] = ()
    not_swept: str = ""


@in_turn()
def stiffness(
    solid: cq.Workplane | cq.Shape,
    *,
    held: Where,
    pressed: Mapping[str, Where],
    E_MPa: float,
    poisson: float = 0.38,
) -> PartStiffness:
    """Return the stiffness of a part of your own, pressed at faces that you name, by finite elements.

    Each face in turn carries a uniform pressure. Its stiffness is the force divided by the mean displacement of the
    face along the pressure. The error bars contain the error of the meshes and of features that they leave out, but not
    the error of the material.

    Parameters
    ----------
    solid : cadquery.Workplane or cadquery.Shape
        One closed body [mm].
    held : str or points
        The faces that do not move: a tag of the workplane, a point (x, y, z) [mm] on the face, or a list of points.
    pressed : mapping
        The faces that are pressed, each by a tag or a point, under names of your own.
    E_MPa : float
        Young's modulus of the material [MPa].
    poisson : float, optional
        Poisson's ratio of the material [1].

    Returns
    -------
    PartStiffness
        The stiffness of each pressed face with its error, and the method.

    Raises
    ------
    InputError
        If the solid is not one closed body, a face is not found, or the part would take too long.
    MeshError, SolveError
        If a mesh or a solution is unreliable. Both are a RuntimeError.

    Examples
    --------
    >>> import cadquery as cq
    >>> outline = [(0, 0), (20, 0), (20, -3), (21, -3), (21, 1), (0, 1)]
    >>> leaf = cq.Workplane("XZ").polyline(outline).close().extrude(6)
    >>> found = twintip.stiffness(leaf, held=(0, -3, 0.5), pressed={"tip": (20.5, -3, -3)}, E_MPa=2000)
    >>> round(found.faces["tip"].K, 2)  # [N/mm]
    0.36
    """
    from cad.checks.own_part import combine_shapes, own_part, press_direction, require_one_solid

    numbers: dict[str, object] = {"E_MPa": E_MPa, "poisson": poisson}
    for name, value in numbers.items():
        if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
            raise validation_error(name, str(value), "", "a finite number", "as in E_MPa=2000, poisson=0.38")
    if not E_MPa > 0.0:
        raise validation_error("E_MPa", E_MPa, "MPa", "greater than 0 MPa", "PETG has about 2000")
    if not 0.0 <= poisson < 0.5:  # noqa: PLR2004 - a material that keeps its volume
        raise validation_error("poisson", poisson, "1", "at least 0 and less than 0.5", "PETG has about 0.38")
    names: object = pressed
    if not isinstance(names, Mapping) or not pressed or HELD in pressed:
        hint = "as in {'tip': (20.5, -3, -3)}"
        raise validation_error("pressed", str(pressed), "", "a mapping of names to one face or more", hint)
    body = require_one_solid(combine_shapes(solid), "solid")
    faces = {name: _find_faces(solid, body, f"pressed[{name!r}]", where) for name, where in pressed.items()}
    directions = {name: press_direction(body, f"pressed[{name!r}]", indices) for name, indices in faces.items()}
    faces[HELD] = _find_faces(solid, body, "held", held)
    _refuse_held_and_pressed(faces, "pressed")
    return _solve_part(own_part(body, faces), _Scene(presses=directions, material=(E_MPa, poisson), housing=None))


def _find_faces(solid: object, body: cq.Solid, argument: str, where: Where) -> tuple[int, ...]:
    """Return the indices of the faces of a body that a tag or points name.

    `solid` is the object that the user passed, which may have tags. Raises InputError if the tag or a face is not
    found, or if `where` is neither. The message has the name of the `argument`.
    """
    from cad.checks.own_part import faces_at, tagged_faces

    if isinstance(where, str):
        return tagged_faces(solid, body, argument, where)
    try:
        points = np.array(where, dtype=float)
    except (TypeError, ValueError):
        points = np.empty(0)
    points = points[None] if points.ndim == 1 else points
    if not points.size or points.shape[1:] != (3,) or not np.isfinite(points).all():
        raise validation_error(argument, str(where), "mm", "a tag, or points of three numbers", "as in (4, 0, 0)")
    return faces_at(body, argument, [(x, y, z) for x, y, z in points.tolist()])


def _refuse_held_and_pressed(faces: Mapping[str, tuple[int, ...]], flag: str) -> None:
    """Raise InputError if a face is both held and pressed; `flag` is the flag or argument of the pressed faces."""
    for name, indices in faces.items():
        if name != HELD and set(indices) & set(faces[HELD]):
            what = f"{flag} {name}"
            hint = "press another face, or hold another"
            raise validation_error(what, "a face", "", "free: it is held too", hint)


def refuse_part(path: Path, points: Mapping[str, Sequence[Place]]) -> None:
    """Raise InputError if a STEP file is not one solid, or if a point of a flag [mm] lies on none of its faces.

    `points` has the points of each flag. The check takes a second. `file_stiffness` repeats it, but only when the
    springs of a design are known, which takes longer.
    """
    from cad.checks.own_part import faces_at, read_own_solid

    solid = read_own_solid(path, any_size=True)  # inches are found by the size of the housing, which is not known yet
    for flag, flag_points in points.items():
        for point in flag_points:
            faces_at(solid, flag, [point])


def file_stiffness(
    path: Path,
    material: tuple[float, float],
    held: Sequence[Place] = (),
    pressed: Mapping[str, Place] | None = None,
    housing: Housing | None = None,
) -> PartStiffness:
    """Return the stiffness of the part in a STEP file, which is held and pressed at given points [mm].

    Without points it is held and pressed at the faces at which the `housing` of a design is. The compliance of pins in
    the feet of that housing is added. `material` is Young's modulus [MPa] and Poisson's ratio. Raises InputError if a
    face is not found, or if the part cannot be solved.
    """
    from cad.checks.own_part import (
        faces_at,
        fill_round_tips,
        hole_points,
        own_part,
        press_direction,
        read_own_solid,
        tip_points,
    )

    solid = read_own_solid(path, housing)
    if pressed:
        faces = {name: faces_at(solid, "--pressed", [point]) for name, point in pressed.items()}
        directions = {name: press_direction(solid, "--pressed", indices) for name, indices in faces.items()}
    else:
        tips = tip_points(housing) if housing is not None else {}
        solid = fill_round_tips(solid, tips.values())
        faces = {name: faces_at(solid, f"the {name} tip of the design", [point]) for name, point in tips.items()}
        directions = dict.fromkeys(tips, _UP)
    if held:
        faces[HELD] = faces_at(solid, "--held", held)
    elif housing is not None:
        faces[HELD] = faces_at(solid, "a screw hole of the design", hole_points(housing))
    _refuse_held_and_pressed(faces, "--pressed")
    scene = _Scene(presses=directions, material=material, housing=None if held else housing)
    part_stiffness = _solve_part(own_part(solid, faces), scene)
    if housing is None or housing.pin is None:
        return part_stiffness
    pin = pin_compliance(housing.pin, *material)
    return replace(part_stiffness, faces={name: _add_pin(face, pin) for name, face in part_stiffness.faces.items()})


def _add_pin(face: PressedFace, pin: Estimate) -> PressedFace:
    """Return a pressed foot with the compliance of its pin [mm/N] in series."""
    K = 1.0 / (1.0 / face.K + pin.value)
    return replace(face, K=K, K_error=K / face.K * face.K_error + pin.error * K)


@dataclass(frozen=True, kw_only=True)
class _Scene:
    """Loads, material and support of a part.

    `presses` are the unit directions in which named faces are pressed, and `material` is Young's modulus [MPa] and
    Poisson's ratio. The part is held by the mount of a `housing`. Without one, the faces named `HELD` do not move.
    """

    presses: Mapping[str, tuple[float, float, float]]
    material: tuple[float, float]
    housing: Housing | None

    @property
    def layers(self) -> tuple[ElasticLayer, ...]:
        """Return the elastic layers of the housing's mount; empty without a housing."""
        return () if self.housing is None else mount_layers(self.housing)


def _solve_part(part: Part, scene: _Scene) -> PartStiffness:
    """Return the stiffness of a part at its named faces, by a swept mesh if that is accurate, else by tetrahedra.

    If the tetrahedra would cost too much, the result of the sweep is returned despite its large error bar. Raises
    InputError if neither method can solve the part.
    """
    from cad.checks.own_part import extrusion_of

    start = time.perf_counter()
    extrusion = extrusion_of(part)
    swept_solution = None
    reason = "no section is swept over most of it"
    if extrusion is not None:
        try:
            swept_solution = replace(_solve_swept(extrusion, scene), seconds=time.perf_counter() - start)
        except MeshError as error:  # the part is then meshed with tetrahedra
            reason = str(error)
    if swept_solution is not None:
        largest_error = max(face.K_error for face in swept_solution.faces.values())
        if largest_error <= _SWEPT_ENOUGH:
            return swept_solution
        reason = f"what its sweep leaves out may move K by {100.0 * largest_error:.2g} %"
    try:
        solution = _solve_in_tetrahedra(part, scene)
    except InputError:
        if swept_solution is None:
            raise
        return swept_solution
    return replace(solution, not_swept=reason, seconds=time.perf_counter() - start)


def _solve_in_tetrahedra(part: Part, scene: _Scene) -> PartStiffness:
    """Return the stiffness of a solid of any shape, extrapolated from successively finer meshes of tetrahedra.

    The refinement ends when the error is small enough, or when the next mesh would exceed the limit of time or memory.
    Raises InputError if this limit allows fewer than three meshes.
    """
    from cad.checks.own_part import name_side_faces, walls_of

    layers = scene.layers
    if layers and scene.housing is not None:
        part, has_sides = name_side_faces(part, SIDES, 0.5 * scene.housing.depth)
        layers = layers if has_sides else ()
    walls = walls_of(part)
    solutions: list[PartCompliance] = []
    cost = 0.0
    for scale in _SCALES:
        mesh = tetrahedral_mesh(part, walls, scale)
        unknowns = 3 * int(mesh.doflocs.shape[1])
        cost += _SECONDS_PER_UNKNOWN * unknowns
        if cost > MOST_SECONDS or _BYTES_PER_UNKNOWN * unknowns > MOST_BYTES:
            break
        if not solutions:  # the first mesh shows whether the mount touches the part
            layers = layers if _is_covered(mesh, layers) else ()
        solutions.append(tetrahedral_compliance(mesh, scene.material, scene.presses, layers))
        if len(solutions) == 1:
            _refuse_block(solutions[0], part, scene)
        if len(solutions) >= _FEWEST and max(error / abs(K) for K, error in _extrapolate(solutions)) < _FINE_ENOUGH:
            break
    if len(solutions) < _FEWEST:
        most_unknowns = MOST_SECONDS / _SECONDS_PER_UNKNOWN
        bound = f"at most about {most_unknowns:.3g} for all meshes, {MOST_SECONDS:g} s of CPU time"
        hint = "take fine details away from where nothing bends, or draw the part as one section that is swept"
        what = "unknowns of the part in tetrahedra"
        raise validation_error(what, unknowns, "", bound, hint)
    no_strain = "tetrahedra are too coarse at the roots of leaves for it"
    faces = {
        name: PressedFace(K=K, K_error=error / K + ERROR_FLOOR, no_strain=no_strain)
        for name, (K, error) in zip(scene.presses, _extrapolate(solutions), strict=True)
    }
    return PartStiffness(
        faces=faces,
        material=scene.material,
        method=f"quadratic tetrahedra, {len(solutions)} meshes",
        held_by="the design's covers" if layers else "the faces that are held",
        dofs=solutions[-1].dofs,
        left_out_mm3=0.0,
        left_out_at=None,
        curve=tuple((solution.dofs, solution.seconds, *(1e3 * solution.K).tolist()) for solution in solutions),
    )


def _extrapolate(solutions: Sequence[PartCompliance]) -> list[tuple[float, float]]:
    """Return the stiffness of each pressed face extrapolated to element size 0, and its error [N/mm]."""
    sizes = _SCALES[: len(solutions)]
    return [extrapolate_to_size_zero(sizes, K) for K in np.array([solution.K for solution in solutions]).T.tolist()]


def _solve_swept(extrusion: Extrusion, scene: _Scene) -> PartStiffness:
    """Return the stiffness of an extrusion from two swept meshes of its section, with an error bar.

    The error bar has three parts: the difference between both meshes, sharp inner corners, and features that are not
    swept. The mount of the design holds the part if its layers lie on the ends of the extrusion. Raises MeshError if
    the section cannot be meshed.
    """
    # The mesh is swept along y, so the loads are rotated into the axes of the extrusion.
    presses = {name: tuple((extrusion.turn @ direction).tolist()) for name, direction in scene.presses.items()}
    # The layers of the mount (covers and washers) apply only to a part that lies as the housing does.
    layers = scene.layers if np.allclose(extrusion.turn, np.eye(3)) else ()
    (coarse_scale, coarse_elements), (fine_scale, fine_elements) = _MESHES  # the elements are those through the depth
    mesh = swept_part(extrusion, coarse_scale, coarse_elements, presses.values())
    layers = layers if _is_covered(mesh.mesh, layers) else ()
    coarse = swept_compliance(mesh, scene.material, presses, layers)
    _refuse_block(coarse, extrusion.part, scene)
    corner_numbers = strained_corners(coarse)
    neglected = np.zeros(len(presses))  # relative error of K due to corners and features that are not swept
    if corner_numbers:
        # Solved again with fine corners, so that the difference of both coarse solves is the effect of the corners.
        mesh = _coarse_mesh_with_fine_corners(extrusion, presses, corner_numbers)
        unrefined, coarse = coarse, swept_compliance(mesh, scene.material, presses, layers)
        neglected = _CORNER_ERROR * np.abs(unrefined.K / coarse.K - 1.0)
    fine_corners = FineCorners(numbers=corner_numbers, size=_CORNER_SIZES[1])
    mesh = swept_part(extrusion, fine_scale, fine_elements, presses.values(), fine_corners)
    fine = swept_compliance(mesh, scene.material, presses, layers)
    # the same with the walls of the screw holes held instead of the mount, for comparison
    held = swept_compliance(mesh, scene.material, presses) if layers else fine
    neglected += left_out(mesh, fine)
    volume = mesh.excess * mesh.area  # [mm^3] that the sweep adds or leaves out, at each place of the section
    largest_place = None
    if volume.sum() > 1e-6 * mesh.area.sum():  # less is round-off
        x, y, z = extrusion.turn.T @ mesh.places[:, int(np.argmax(volume))]
        largest_place = (float(x), float(y), float(z))
    return PartStiffness(
        faces=_pressed_faces(scene.presses, (coarse, fine), neglected, held if layers else None),
        material=scene.material,
        method="section in quadratic hexahedra, swept",
        held_by="the design's covers" if layers else "the faces that are held",
        dofs=fine.dofs,
        left_out_mm3=float(volume.sum()),
        left_out_at=largest_place,
    )


def _coarse_mesh_with_fine_corners(
    extrusion: Extrusion, presses: Mapping[str, tuple[float, ...]], numbers: tuple[int, ...]
) -> SweptPart:
    """Return the coarse mesh with smaller elements at the sharp corners of these `numbers`; raises MeshError.

    Coarse quadrilaterals may be folded where their size grows quickly from that of small ones. A scale between the
    coarse and the fine mesh is then used instead.
    """
    (coarse, layers), (fine, _) = _MESHES
    fine_corners = FineCorners(numbers=numbers, size=_CORNER_SIZES[0])
    try:
        return swept_part(extrusion, coarse, layers, presses.values(), fine_corners)
    except MeshError:
        return swept_part(extrusion, 0.5 * (coarse + fine), layers, presses.values(), fine_corners)


def _pressed_faces(
    names: Iterable[str],
    meshes: tuple[PartCompliance, PartCompliance],
    neglected: Floats,
    held: PartCompliance | None,
) -> dict[str, PressedFace]:
    """Return stiffness and strain of each pressed face, with errors from the coarse and the fine mesh.

    `neglected` (faces,) [1] is the relative error of K due to sharp corners and to features that the meshes leave out.
    `held` is a second solution with the walls of the screw holes held, None if no mount holds the part in the first.
    """
    coarse, fine = meshes
    faces = {}
    for i, name in enumerate(names):
        change = abs(coarse.K[i] / fine.K[i] - 1.0)
        strain, inside = fine.strain_per_N[i], fine.strain_inside_per_N[i]
        is_known = math.isfinite(strain) and strain > 0.0
        faces[name] = PressedFace(
            K=float(fine.K[i]),
            K_error=float(ERROR_SHARE * change + ERROR_FLOOR + neglected[i]),
            K_held=None if held is None else float(held.K[i]),
            strain_per_N=strain if is_known else None,
            strain_error=STRAIN_ERROR_SHARE * abs(inside / strain - 1.0) if is_known else None,
            no_strain=""
            if is_known
            else "the largest strain is not at a rounded inner corner; at a sharp corner strain has no limit",
        )
    return faces


def _is_covered(mesh: object, layers: Sequence[ElasticLayer]) -> bool:
    """Return whether the layers of a mount lie on an end of the sweep, the facets named `SIDES`."""
    if not layers:
        return False
    middles = mesh.p[:, mesh.facets[:, mesh.boundaries[SIDES]]].mean(axis=1)  # type: ignore[attr-defined]
    return any(layer.covers(middles[0], middles[2]).any() for layer in layers)


def _refuse_block(solution: PartCompliance, part: Part, scene: _Scene) -> None:
    """Raise InputError for a part without leaves: one in which nothing bends between pressed and held faces.

    Such a part is as stiff as a block, so its stiffness exceeds a fraction of E times the distance of both faces.
    """
    for name, K in zip(scene.presses, solution.K.tolist(), strict=True):
        distance = part.face_distance(name, HELD)
        limit = _MOST_STIFF * scene.material[0] * distance
        if not limit >= K:
            bound = (
                f"at most {1e3 * limit:.3g} N/m: nothing of the part bends over the {distance:.3g} mm to what is held"
            )
            what = f"stiffness at {name}"
            raise validation_error(what, 1e3 * K, "N/m", bound, "export the part with its leaves")
