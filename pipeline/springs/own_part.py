"""The stiffness of a part that the user designed, with its error bar.

A part is held and pressed like the housing of a design, or at faces that the user marks with points. If most of the
part is an extrusion, a mesh of its section is swept into hexahedra. Any other part is meshed with tetrahedra.
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
    neglected_feature_errors,
    strained_corners,
    swept_compliance,
    tetrahedral_compliance,
)

if TYPE_CHECKING:
    import cadquery as cq

    from cad.checks.own_part import Extrusion, Place
    from cad.parts.part import Part
    from solve.housing.elastic_layer import ElasticLayer

HELD = "mounting_holes"  # name that the solver gives to the faces that do not move
# Element scale in the section, and number of layers through half the depth, of the coarse mesh and of the fine mesh.
# The result on the fine mesh is returned.
_MESHES = ((4.0, 1), (3.0, 2))
# Element size at sharp inner corners, divided by the local thickness, in the coarse and in the fine mesh. Corners that
# are not refined have a relative element size of 1.
_CORNER_SIZES = (0.2, 0.1)
# Towards a corner, strain grows at most like r^-0.5, as at a slit (M. L. Williams, J. Appl. Mech. 19, 526). The strain
# energy within a radius r is then at most proportional to r, and so is the error of K with elements of size r. Let dK
# be the change in K from element size 1 to the element size of the coarse mesh. The error that remains in the fine mesh
# is `_CORNER_ERROR` times dK.
_CORNER_ERROR = _CORNER_SIZES[1] / (1.0 - _CORNER_SIZES[0])
# Largest K / (E * distance from pressed to held faces) of a part that bends [1]. A block without leaves is stiffer.
_MAX_BLOCK_RATIO = 0.02
# Scales of the tetrahedral meshes, which are refined until the error bar is small enough. A mesh with 186,000 unknowns
# took 38 s of CPU time and 1.4 GiB.
_SCALES = (2.0, 1.4, 1.0, 0.7, 0.5, 0.35)
_MIN_MESHES = 3  # minimum number of meshes for an extrapolation to element size 0
_MAX_TETRAHEDRA_ERROR = 0.01  # relative error of K below which the refinement ends
# largest accepted relative error of K from a swept mesh; above it, too much of the part is not swept
_MAX_SWEPT_ERROR = 0.1
_ROUND_OFF_MM = 1e-6  # mean difference in thickness between a swept mesh and the part that is only round-off [mm]
MAX_SECONDS = 120.0  # limit of the estimated CPU time for all tetrahedral meshes together [s]
MAX_BYTES = 6.0 * 2**30  # limit of the estimated memory for one tetrahedral mesh [bytes]
_SECONDS_PER_UNKNOWN = 2e-4  # estimated CPU time [s]
_BYTES_PER_UNKNOWN = 7e3  # estimated memory [bytes]
_UP = (0.0, 0.0, 1.0)  # direction in which the fruit presses the tips of a housing
_NO_ROUNDED_CORNER = "the largest strain is not at a rounded inner corner, and at a sharp corner it is unbounded"

Where = str | tuple[float, float, float] | Sequence[tuple[float, float, float]]
"""One or more faces: a tag, a point on a face, or points on several faces [mm]."""


@dataclass(frozen=True, kw_only=True, repr=False)
class PressedFace(Record):
    """One pressed face of a part: its stiffness K [N/mm], the relative error of K [1], and the largest strain.

    `K_held` [N/mm] is the stiffness with the walls of the screw holes held instead of the covers of the design.
    `strain_per_N` [1/N] is the largest strain at a rounded inner corner, and `strain_error` [1] its relative error. If
    the strain is unknown, `no_strain` gives the reason.
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
    """The stiffness of each pressed face of a part, as returned by `stiffness`.

    Attributes
    ----------
    faces : mapping of str to PressedFace
        The pressed faces by name. Each has its stiffness `K` [N/mm] and the relative error `K_error` [1]. If it is
        known, `strain_per_N` [1/N] is the largest strain at a rounded inner corner.
    material : tuple of float
        Young's modulus [MPa] and Poisson's ratio [1].
    method : str
        The kind of elements and of meshes that was used.
    held_by : str
        What holds the part.
    dofs : int
        Number of unknowns of the finest mesh.
    left_out_mm3 : float
        Volume by which the mesh and the part differ [mm^3].
    left_out_at : tuple of float or None
        The position at which this volume is largest [mm]; None if nothing is left out.
    seconds : float
        Duration of the solution [s].
    curve : tuple of tuple of float
        Number of unknowns, duration [s] and stiffnesses [N/m] for each tetrahedral mesh; empty for a swept part.
    not_swept : str
        The reason why the part was meshed with tetrahedra; empty for a swept part.

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
    """Compute the stiffness of your own part at the faces that are pressed, by finite elements.

    A uniform pressure is applied to one face after another. The stiffness of a face is the total force divided by its
    mean displacement along the pressure. The error bars include the errors of the meshes and of features that the
    meshes leave out, but not the errors of the material data.

    Parameters
    ----------
    solid : cadquery.Workplane or cadquery.Shape
        One closed body [mm].
    held : str or points
        The faces that do not move: a tag of the workplane, a point (x, y, z) [mm] on the face, or a list of points.
    pressed : mapping
        The faces that are pressed. The keys are names of your choice, and each value is a tag or points as in `held`.
    E_MPa : float
        Young's modulus of the material [MPa].
    poisson : float, optional
        Poisson's ratio of the material [1].

    Returns
    -------
    PartStiffness
        The stiffness of each pressed face with its error bar, and the method by which it was computed.

    Raises
    ------
    InputError
        If an argument is invalid, the solid is not one closed body, a face is not found or is both held and pressed,
        the part has no leaves that bend, or the solution would take too long.
    MeshError, SolveError
        If a mesh or a solution is unreliable. Both are subclasses of RuntimeError.

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

    _refuse_wrong_material(E_MPa, poisson)
    _refuse_wrong_mapping(pressed)
    body = require_one_solid(combine_shapes(solid), "solid")
    faces = {name: _find_faces(solid, body, f"pressed[{name!r}]", where) for name, where in pressed.items()}
    directions = {name: press_direction(body, f"pressed[{name!r}]", indices) for name, indices in faces.items()}
    faces[HELD] = _find_faces(solid, body, "held", held)
    _refuse_held_and_pressed(faces, "pressed")
    return _solve_part(own_part(body, faces), _Scene(presses=directions, material=(E_MPa, poisson), housing=None))


def _refuse_wrong_material(E_MPa: float, poisson: float) -> None:
    """Raise InputError for invalid material data.

    Python does not enforce the annotations of `stiffness`, so the types of the numbers are checked too.
    """
    material: dict[str, object] = {"E_MPa": E_MPa, "poisson": poisson}
    for name, value in material.items():
        # bool is a subclass of int, so True would be accepted as 1
        if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
            raise validation_error(name, str(value), "", "a finite number", "as in E_MPa=2000, poisson=0.38")
    if not E_MPa > 0.0:
        raise validation_error("E_MPa", E_MPa, "MPa", "greater than 0 MPa", "PETG has about 2000")
    if not 0.0 <= poisson < 0.5:  # noqa: PLR2004 - Poisson's ratio of an incompressible material
        raise validation_error("poisson", poisson, "1", "at least 0 and less than 0.5", "PETG has about 0.38")


def _refuse_wrong_mapping(pressed: object) -> None:
    """Raise InputError if the argument `pressed` of `stiffness` does not map names to faces, or is empty.

    The name `HELD` is refused too, because it is reserved for the held faces.
    """
    if not isinstance(pressed, Mapping) or not pressed or HELD in pressed:
        hint = "as in {'tip': (20.5, -3, -3)}"
        raise validation_error("pressed", str(pressed), "", "a mapping of names to one face or more", hint)


def _find_faces(solid: object, body: cq.Solid, argument: str, where: Where) -> tuple[int, ...]:
    """Return the indices of the faces of a body that the user selects by a tag or by points.

    `solid` is the object that the user passed, which may have tags if it is a workplane. `body` is the solid extracted
    from it. Error messages name the `argument`. Raises InputError if the tag or a face is not found, or if `where` is
    neither a tag nor points [mm].
    """
    from cad.checks.own_part import faces_at, tagged_faces

    if isinstance(where, str):
        return tagged_faces(solid, body, argument, where)
    try:
        points = np.array(where, dtype=float)
    except (TypeError, ValueError):
        points = np.empty(0)  # an empty array is rejected below
    points = np.atleast_2d(points)  # a single point becomes an array (1, 3)
    if not points.size or points.shape[1:] != (3,) or not np.isfinite(points).all():
        raise validation_error(argument, str(where), "mm", "a tag, or points of three numbers", "as in (4, 0, 0)")
    return faces_at(body, argument, [(x, y, z) for x, y, z in points.tolist()])


def _refuse_held_and_pressed(faces: Mapping[str, tuple[int, ...]], flag: str) -> None:
    """Raise InputError if a face is both held and pressed.

    `faces` holds the indices of the faces by name; the held faces have the name `HELD`. `flag` is the flag or argument
    that selects the pressed faces, which the message names.
    """
    for name, indices in faces.items():
        if name != HELD and set(indices) & set(faces[HELD]):
            quantity = f"{flag} {name}"
            hint = "press or hold a different face"
            raise validation_error(quantity, "a held face", "", "a face that is not held", hint)


def refuse_part(path: Path, points: Mapping[str, Sequence[Place]]) -> None:
    """Raise InputError if a STEP file is not one solid, or if a point of a flag does not lie on a face.

    `points` maps each flag to its points [mm]. This check takes only a second, so it is made before the springs of the
    design are solved. `file_stiffness` repeats it after them.
    """
    from cad.checks.own_part import faces_at, read_own_solid

    solid = read_own_solid(path, any_size=True)  # a file in inches is recognised later, by comparison with the housing
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
    """Compute the stiffness of the part in a STEP file, which is held and pressed at given points [mm].

    `held` are points on the faces that do not move. `pressed` has a point on each pressed face, keyed by a name. If
    `held` is empty, the part is held like the `housing` of a design. If `pressed` is empty or None, the part is pressed
    like this housing. Either case requires a `housing`. If the housing has pins in its feet, their compliance is added.
    `material` is Young's modulus [MPa] and Poisson's ratio [1].

    Raises InputError if a face is not found or is both held and pressed, or if the part cannot be solved. Raises the
    same other errors as `stiffness`.
    """
    from cad.checks.own_part import faces_at, hole_points, own_part, press_direction, read_own_solid

    # `faces` holds the indices of the faces by name. `directions` holds the unit vectors of the presses.
    solid = read_own_solid(path, housing)
    if pressed:
        faces = {name: faces_at(solid, "--pressed", [point]) for name, point in pressed.items()}
        directions = {name: press_direction(solid, "--pressed", indices) for name, indices in faces.items()}
    else:
        solid, faces = _find_tips(solid, housing)
        directions = dict.fromkeys(faces, _UP)
    if held:
        faces[HELD] = faces_at(solid, "--held", held)
    elif housing is not None:
        faces[HELD] = faces_at(solid, "a screw hole of the design", hole_points(housing))
    _refuse_held_and_pressed(faces, "--pressed")
    # Held faces that the user marks do not move. Otherwise the part is held by the elastic mount of the housing.
    scene = _Scene(presses=directions, material=material, housing=None if held else housing)
    part_stiffness = _solve_part(own_part(solid, faces), scene)
    if housing is None or housing.pin is None:
        return part_stiffness
    pin = pin_compliance(housing.pin, *material)
    return replace(part_stiffness, faces={name: _add_pin(face, pin) for name, face in part_stiffness.faces.items()})


def _find_tips(solid: cq.Solid, housing: Housing | None) -> tuple[cq.Solid, dict[str, tuple[int, ...]]]:
    """Return a solid with square tips, and the indices of its faces at the tips of a `housing`, by their names.

    Round tips are filled to squares, because the mesh of a housing has square tips too. Without a housing, there are no
    tips. Raises InputError if a tip is not on a face.
    """
    from cad.checks.own_part import faces_at, fill_round_tips, tip_points

    tips = tip_points(housing) if housing is not None else {}
    solid = fill_round_tips(solid, tips.values())
    return solid, {name: faces_at(solid, f"the {name} tip of the design", [point]) for name, point in tips.items()}


def _add_pin(face: PressedFace, pin: Estimate) -> PressedFace:
    """Return the stiffness of a pressed foot in series with its pin; `pin` is the compliance of the pin [mm/N].

    K / K_foot is the fraction of the compliance that is due to the foot, so this fraction of its relative error
    remains.
    """
    K = 1.0 / (1.0 / face.K + pin.value)
    return replace(face, K=K, K_error=K / face.K * face.K_error + pin.error * K)


@dataclass(frozen=True, kw_only=True)
class _Scene:
    """Loads, material and support of a part.

    `presses` maps the names of the pressed faces to the unit vectors along which they are pressed. `material` is
    Young's modulus [MPa] and Poisson's ratio [1]. The part is held like the `housing` in its mount. If `housing` is
    None, the faces named `HELD` do not move.
    """

    presses: Mapping[str, tuple[float, float, float]]
    material: tuple[float, float]
    housing: Housing | None

    @property
    def layers(self) -> tuple[ElasticLayer, ...]:
        """Return the elastic layers that represent the housing's mount; empty without a housing."""
        return () if self.housing is None else mount_layers(self.housing)


def _solve_part(part: Part, scene: _Scene) -> PartStiffness:
    """Compute the stiffness of a part at its pressed faces, on a swept mesh if that is accurate, else on tetrahedra.

    The result on tetrahedra states in `not_swept` why no swept mesh was used. If tetrahedra would need too much time or
    memory, the result on the swept mesh is returned despite its large error bar. Raises InputError if neither method
    can solve the part, and MeshError if tetrahedra cannot be meshed.
    """
    from cad.checks.own_part import find_extrusion

    start = time.perf_counter()
    extrusion = find_extrusion(part)
    swept_solution = None
    reason = "most of the part is not an extrusion of one section"
    if extrusion is not None:
        try:
            swept_solution = replace(_solve_swept(extrusion, scene), seconds=time.perf_counter() - start)
        except MeshError as error:  # the part is meshed with tetrahedra below
            reason = str(error)
    if swept_solution is not None:
        largest_error = max(face.K_error for face in swept_solution.faces.values())
        if largest_error <= _MAX_SWEPT_ERROR:
            return swept_solution
        reason = f"features that a swept mesh leaves out may change K by {100.0 * largest_error:.2g} %"
    try:
        solution = _solve_in_tetrahedra(part, scene)
    except InputError:  # the limits of time and memory are exceeded, or nothing bends
        if swept_solution is None:
            raise
        return swept_solution
    return replace(solution, not_swept=reason, seconds=time.perf_counter() - start)


def _solve_in_tetrahedra(part: Part, scene: _Scene) -> PartStiffness:
    """Compute the stiffness of a solid of any shape, extrapolated from successively finer tetrahedral meshes.

    Raises InputError if the limits of time and memory allow fewer than three meshes, or if nothing bends. Raises
    MeshError if a mesh is unreliable.
    """
    solutions, layers = _refine_tetrahedra(part, scene)
    no_strain = "tetrahedra are too coarse at the roots of the leaves to resolve the strain"
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


def _refine_tetrahedra(part: Part, scene: _Scene) -> tuple[list[PartCompliance], tuple[ElasticLayer, ...]]:
    """Solve a part on successively finer tetrahedral meshes, and return the solutions and the layers of its mount.

    K at element size 0 is extrapolated from K on all meshes. The refinement ends when the error of this value is small
    enough, or when the next mesh would exceed the limit of time or memory. The layers are empty if no mount holds the
    part; the faces named `HELD` are then held. Raises InputError if the limits allow fewer than three meshes, or if
    nothing bends. Raises MeshError if a mesh is unreliable.
    """
    from cad.checks.own_part import sample_wall_thickness

    part, layers = _name_mounted_faces(part, scene)
    walls = sample_wall_thickness(part)
    solutions: list[PartCompliance] = []
    total_seconds = 0.0  # estimated CPU time of all meshes up to this one
    for scale in _SCALES:
        mesh = tetrahedral_mesh(part, walls, scale)
        unknowns = 3 * int(mesh.doflocs.shape[1])  # three displacements at each node
        total_seconds += _SECONDS_PER_UNKNOWN * unknowns
        if total_seconds > MAX_SECONDS or _BYTES_PER_UNKNOWN * unknowns > MAX_BYTES:
            break
        if not solutions:  # only a mesh shows whether the mount touches the part
            layers = layers if _is_covered(mesh, layers) else ()
        solutions.append(tetrahedral_compliance(mesh, scene.material, scene.presses, layers))
        if len(solutions) == 1:  # a block is recognised on the coarsest mesh already
            _refuse_block(solutions[0], part, scene)
        if len(solutions) >= _MIN_MESHES and _largest_relative_error(solutions) < _MAX_TETRAHEDRA_ERROR:
            break
    if len(solutions) < _MIN_MESHES:
        raise _too_many_unknowns(unknowns)
    return solutions, layers


def _name_mounted_faces(part: Part, scene: _Scene) -> tuple[Part, tuple[ElasticLayer, ...]]:
    """Return a part whose faces under the mount are named `SIDES`, and the elastic layers of the mount.

    The mount touches a housing at its front and back faces, y = -depth / 2 and y = depth / 2. The mount cannot hold a
    part without such faces, so the layers are then empty.
    """
    from cad.checks.own_part import name_side_faces

    layers = scene.layers
    if layers and scene.housing is not None:
        part, has_sides = name_side_faces(part, SIDES, 0.5 * scene.housing.depth)
        layers = layers if has_sides else ()
    return part, layers


def _too_many_unknowns(unknowns: int) -> InputError:
    """Return the error for a part whose next tetrahedral mesh, with this number of unknowns, exceeds the limits."""
    most_unknowns = MAX_SECONDS / _SECONDS_PER_UNKNOWN
    bound = f"at most about {most_unknowns:.3g} for all meshes, {MAX_SECONDS:g} s of CPU time"
    hint = "remove fine details where nothing bends, or draw the part as an extrusion of one section"
    return validation_error("unknowns of the tetrahedral mesh of the part", unknowns, "", bound, hint)


def _largest_relative_error(solutions: Sequence[PartCompliance]) -> float:
    """Return the largest relative error [1] of the extrapolated stiffnesses of all pressed faces."""
    return max(error / abs(K) for K, error in _extrapolate(solutions))


def _extrapolate(solutions: Sequence[PartCompliance]) -> list[tuple[float, float]]:
    """Return the stiffness extrapolated to element size 0, and its error [N/mm], for each pressed face.

    `solutions` are the solutions on the meshes of the first scales in `_SCALES`, in this order.
    """
    sizes = _SCALES[: len(solutions)]
    K_by_face = np.array([solution.K for solution in solutions]).T.tolist()  # (faces, meshes)
    return [extrapolate_to_size_zero(sizes, K) for K in K_by_face]


def _solve_swept(extrusion: Extrusion, scene: _Scene) -> PartStiffness:
    """Compute the stiffness of an extrusion on two meshes, each swept from a mesh of its section.

    The error bar is the sum of three contributions: the difference between the two meshes, sharp inner corners, and
    features that are not swept. The mount of the design holds the part if its layers lie on the ends of the extrusion.
    Otherwise the faces named `HELD` do not move. Raises MeshError if the section cannot be meshed, and InputError if
    nothing bends.
    """
    # The mesh is swept along y, so the directions of the loads are rotated into the coordinates of the extrusion.
    presses = {name: tuple((extrusion.rotation @ direction).tolist()) for name, direction in scene.presses.items()}
    # The layers of the mount (covers or washers) apply only to a part in the same orientation as the housing.
    layers = scene.layers if np.allclose(extrusion.rotation, np.eye(3)) else ()
    (coarse_scale, coarse_depth_elements), (fine_scale, fine_depth_elements) = _MESHES
    coarse_mesh = swept_part(extrusion, coarse_scale, coarse_depth_elements, presses.values())
    layers = layers if _is_covered(coarse_mesh.mesh, layers) else ()
    coarse = swept_compliance(coarse_mesh, scene.material, presses, layers)
    _refuse_block(coarse, extrusion.part, scene)
    corner_numbers = strained_corners(coarse)  # numbers of the sharp inner corners that need smaller elements
    corner_errors = np.zeros(len(presses))  # relative error of K due to these corners
    if corner_numbers:
        # The coarse mesh is solved again with finer elements at the corners only. The change in K between the two
        # coarse solutions is therefore the effect of the corners.
        corner_mesh = _coarse_mesh_with_fine_corners(extrusion, presses, corner_numbers)
        refined = swept_compliance(corner_mesh, scene.material, presses, layers)
        corner_errors = _CORNER_ERROR * np.abs(coarse.K / refined.K - 1.0)
        coarse = refined
    fine_corners = FineCorners(numbers=corner_numbers, size=_CORNER_SIZES[1])
    mesh = swept_part(extrusion, fine_scale, fine_depth_elements, presses.values(), fine_corners)
    fine = swept_compliance(mesh, scene.material, presses, layers)
    # for comparison, the same mesh without a mount, held at the walls of its screw holes
    holes_held = swept_compliance(mesh, scene.material, presses) if layers else None
    neglected_errors = corner_errors + neglected_feature_errors(mesh, fine)
    left_out_mm3, left_out_at = _volume_left_out(mesh, extrusion)
    return PartStiffness(
        faces=_pressed_faces(scene.presses, (coarse, fine), neglected_errors, holes_held),
        material=scene.material,
        method="section in quadratic hexahedra, swept",
        held_by="the design's covers" if layers else "the faces that are held",
        dofs=fine.dofs,
        left_out_mm3=left_out_mm3,
        left_out_at=left_out_at,
    )


def _volume_left_out(mesh: SweptPart, extrusion: Extrusion) -> tuple[float, tuple[float, float, float] | None]:
    """Return the volume [mm^3] by which a swept mesh differs from the part, and where this volume is largest [mm].

    The position is in the coordinates of the part. The position is None if the volume is only round-off.
    """
    # the volume that the sweep adds or leaves out over each quadrilateral of the section
    volumes = mesh.length_error * mesh.area
    largest_place = None
    if volumes.sum() > _ROUND_OFF_MM * mesh.area.sum():
        # the transpose rotates from the coordinates of the extrusion back to the coordinates of the part
        x, y, z = extrusion.rotation.T @ mesh.centres[:, int(np.argmax(volumes))]
        largest_place = (float(x), float(y), float(z))
    return float(volumes.sum()), largest_place


def _coarse_mesh_with_fine_corners(
    extrusion: Extrusion, presses: Mapping[str, tuple[float, ...]], numbers: tuple[int, ...]
) -> SweptPart:
    """Return the coarse mesh with smaller elements at the sharp corners that have these `numbers`.

    `presses` holds the unit vectors of the presses in the coordinates of the extrusion. Coarse quadrilaterals may fold
    where the element size grows quickly away from a corner. If they do, the mesh is made at a scale midway between the
    coarse and the fine scale. Raises MeshError if that fails too.
    """
    (coarse_scale, depth_elements), (fine_scale, _) = _MESHES
    fine_corners = FineCorners(numbers=numbers, size=_CORNER_SIZES[0])
    try:
        return swept_part(extrusion, coarse_scale, depth_elements, presses.values(), fine_corners)
    except MeshError:
        middle_scale = 0.5 * (coarse_scale + fine_scale)
        return swept_part(extrusion, middle_scale, depth_elements, presses.values(), fine_corners)


def _pressed_faces(
    names: Iterable[str],
    solutions: tuple[PartCompliance, PartCompliance],
    neglected: Floats,
    holes_held: PartCompliance | None,
) -> dict[str, PressedFace]:
    """Return the stiffness and the largest strain of each pressed face, with their error bars.

    `names` are the names of the pressed faces. `solutions` are the solutions on the coarse and the fine mesh. Their
    difference determines the error of K due to the mesh. `neglected` (faces,) [1] is the relative error of K due to
    sharp corners and to features that the two meshes leave out. `holes_held` is a second solution on the fine mesh,
    with the walls of the screw holes held. This solution is None if no mount holds the part.
    """
    coarse, fine = solutions
    faces = {}
    for i, name in enumerate(names):
        mesh_change = abs(coarse.K[i] / fine.K[i] - 1.0)
        # The strain is extrapolated to element edges. Its error is estimated from the strain inside the elements.
        strain = fine.strain_per_N[i]
        inner_strain = fine.strain_inside_per_N[i]
        is_known = math.isfinite(strain) and strain > 0.0
        faces[name] = PressedFace(
            K=float(fine.K[i]),
            K_error=float(ERROR_SHARE * mesh_change + ERROR_FLOOR + neglected[i]),
            K_held=None if holes_held is None else float(holes_held.K[i]),
            strain_per_N=strain if is_known else None,
            strain_error=STRAIN_ERROR_SHARE * abs(inner_strain / strain - 1.0) if is_known else None,
            no_strain="" if is_known else _NO_ROUNDED_CORNER,
        )
    return faces


def _is_covered(mesh: object, layers: Sequence[ElasticLayer]) -> bool:
    """Return whether a layer of the mount touches the mesh at its front or back face, whose facets are named `SIDES`.

    If no layer touches the mesh, the mount cannot hold the part.
    """
    if not layers:
        return False
    # the middle of each of these facets, (3, facets) [mm]; the layers extend in x and z
    middles = mesh.p[:, mesh.facets[:, mesh.boundaries[SIDES]]].mean(axis=1)  # type: ignore[attr-defined]
    return any(layer.covers(middles[0], middles[2]).any() for layer in layers)


def _refuse_block(solution: PartCompliance, part: Part, scene: _Scene) -> None:
    """Raise InputError for a part without leaves, in which nothing bends between the pressed and the held faces.

    Such a part is nearly as stiff as a solid block, so K / (E * distance between the pressed and the held faces)
    exceeds `_MAX_BLOCK_RATIO`. `solution` holds the stiffness K [N/mm] of each pressed face on the first mesh.
    """
    for name, K in zip(scene.presses, solution.K.tolist(), strict=True):
        distance = part.face_distance(name, HELD)
        limit = _MAX_BLOCK_RATIO * scene.material[0] * distance
        if not limit >= K:  # written so that a K of nan is refused too
            bound = (
                f"at most {1e3 * limit:.3g} N/m: no leaf bends over the {distance:.3g} mm between this face and the "
                "held faces"
            )
            quantity = f"stiffness at {name}"
            raise validation_error(quantity, 1e3 * K, "N/m", bound, "export the part with its leaves")
