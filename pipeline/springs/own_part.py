"""The stiffness of a part that the user made, with its error bar: swept where it is an extrusion.

A part is held and pressed as the housing of a design is, or at faces that points name.
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
from mesh.own_tetrahedra import tetrahedra
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
    at_size_zero,
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

HELD = "mounting_holes"  # as the solver names what does not move
_MESHES = ((4.0, 1), (3.0, 2))  # scale of the section and layers over half the depth: of the judge, and of the answer
# Size of elements at sharp inner corners over the thickness, in the judge and in the answer; without these it is 1.
_CORNER_SIZES = (0.2, 0.1)
# Strain grows at most like r^-0.5, as at a slit, and its energy within a size at most like the size. So the answer
# still lacks this share of the change of K between size 1 and the size of the judge. M. L. Williams, J. Appl. Mech.
# 19, 526.
_CORNER_ERROR = _CORNER_SIZES[1] / (1.0 - _CORNER_SIZES[0])
_MOST_STIFF = 0.02  # largest K of a part that bends, over E times the distance from pressed to held faces
# Scales of tetrahedra, until the bar is fine enough; a mesh of 186,000 unknowns took 38 CPU s and 1.4 GiB.
_SCALES = (2.0, 1.4, 1.0, 0.7, 0.5, 0.35)
_FEWEST = 3
_SHARP = "it is not largest at a round inner corner, and at a sharp one it has no limit"
_FINE_ENOUGH = 0.01
_SWEPT_ENOUGH = 0.1  # the bar of a sweep beyond which too much of the part is left out for it
MOST_SECONDS = 120.0
MOST_BYTES = 6.0 * 2**30
_SECONDS_PER_UNKNOWN = 2e-4
_BYTES_PER_UNKNOWN = 7e3
_UP = (0.0, 0.0, 1.0)

Where = str | tuple[float, float, float] | Sequence[tuple[float, float, float]]
"""Faces by a tag, by a point on one, or by points on several [mm]."""


@dataclass(frozen=True, kw_only=True, repr=False)
class PressedFace(Record):
    """One pressed face of a part: its stiffness K [N/mm] with its relative error, and its largest strain.

    `K_held` is its stiffness where the walls of the design's screw holes are held, and not the design's covers.
    `strain_per_N` [1/N] is the largest strain at a round inner corner, with its relative error; `no_strain` says why
    there is none.
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

    An even load against its outer normal presses each face, one at a time. The face moves by the mean over its area.
    The error bars contain meshes and what they leave out, but not the error of the material.

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
    from cad.checks.own_part import as_one_shape, own_part, own_solid, pressed_direction

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
    one = own_solid(as_one_shape(solid), "solid")
    faces = {name: _faces_of(solid, one, f"pressed[{name!r}]", where) for name, where in pressed.items()}
    directions = {name: pressed_direction(one, f"pressed[{name!r}]", places) for name, places in faces.items()}
    faces[HELD] = _faces_of(solid, one, "held", held)
    _refuse_held_and_pressed(faces, "pressed")
    return _stiffness(own_part(one, faces), _Scene(presses=directions, material=(E_MPa, poisson), housing=None))


def _faces_of(solid: object, one: cq.Solid, flag: str, where: Where) -> tuple[int, ...]:
    """Return the faces of a part that a tag or points name; raises InputError."""
    from cad.checks.own_part import faces_at, tagged_faces

    if isinstance(where, str):
        return tagged_faces(solid, one, flag, where)
    try:
        points = np.array(where, dtype=float)
    except (TypeError, ValueError):
        points = np.empty(0)
    points = points[None] if points.ndim == 1 else points
    if not points.size or points.shape[1:] != (3,) or not np.isfinite(points).all():
        raise validation_error(flag, str(where), "mm", "a tag, or points of three numbers", "as in (4, 0, 0)")
    return faces_at(one, flag, [(x, y, z) for x, y, z in points.tolist()])


def _refuse_held_and_pressed(faces: Mapping[str, tuple[int, ...]], flag: str) -> None:
    """Raise InputError where a face is held and pressed at once; the flag names what is pressed."""
    for name, places in faces.items():
        if name != HELD and set(places) & set(faces[HELD]):
            what = f"{flag} {name}"
            hint = "press another face, or hold another"
            raise validation_error(what, "a face", "", "free: it is held too", hint)


def refuse_part(path: Path, points: Mapping[str, Sequence[Place]]) -> None:
    """Raise InputError if a STEP file is not one part, or a point of a flag [mm] lies on no face of it.

    It takes a second, and `file_stiffness` asks the same when the springs of a design are known.
    """
    from cad.checks.own_part import faces_at, read_own_solid

    solid = read_own_solid(path, any_size=True)  # inches are found by the size of the housing, which is not known yet
    for flag, places in points.items():
        for place in places:
            faces_at(solid, flag, [place])


def file_stiffness(
    path: Path,
    material: tuple[float, float],
    held: Sequence[Place] = (),
    pressed: Mapping[str, Place] | None = None,
    housing: Housing | None = None,
) -> PartStiffness:
    """Return the stiffness of the part of a STEP file, held and pressed at points [mm], else as a design's housing.

    Pins count with the feet that carry them. `material` is E [MPa] and Poisson's ratio. Raises InputError.
    """
    from cad.checks.own_part import (
        faces_at,
        hole_points,
        own_part,
        pressed_direction,
        read_own_solid,
        tip_points,
        with_flat_tips,
    )

    solid = read_own_solid(path, housing)
    if pressed:
        faces = {name: faces_at(solid, "--pressed", [point]) for name, point in pressed.items()}
        directions = {name: pressed_direction(solid, "--pressed", places) for name, places in faces.items()}
    else:
        tips = tip_points(housing) if housing is not None else {}
        solid = with_flat_tips(solid, tips.values())
        faces = {name: faces_at(solid, f"the {name} tip of the design", [point]) for name, point in tips.items()}
        directions = dict.fromkeys(tips, _UP)
    if held:
        faces[HELD] = faces_at(solid, "--held", held)
    elif housing is not None:
        faces[HELD] = faces_at(solid, "a screw hole of the design", hole_points(housing))
    _refuse_held_and_pressed(faces, "--pressed")
    scene = _Scene(presses=directions, material=material, housing=None if held else housing)
    found = _stiffness(own_part(solid, faces), scene)
    if housing is None or housing.pin is None:
        return found
    pin = pin_compliance(housing.pin, *material)
    return replace(found, faces={name: _with_pin(face, pin) for name, face in found.faces.items()})


def _with_pin(face: PressedFace, pin: Estimate) -> PressedFace:
    K = 1.0 / (1.0 / face.K + pin.value)
    return replace(face, K=K, K_error=K / face.K * face.K_error + pin.error * K)


@dataclass(frozen=True, kw_only=True)
class _Scene:
    """Unit directions in which named faces are pressed, the modulus [MPa] and Poisson's ratio, and what holds a part.

    That is the mount of a housing, or if there is none, that the faces named `HELD` do not move.
    """

    presses: Mapping[str, tuple[float, float, float]]
    material: tuple[float, float]
    housing: Housing | None

    @property
    def layers(self) -> tuple[ElasticLayer, ...]:
        """Return the layers of the mount of the housing; none without one."""
        return () if self.housing is None else mount_layers(self.housing)


def _stiffness(part: Part, scene: _Scene) -> PartStiffness:
    """Return the stiffness of a part whose faces are named; raises InputError."""
    from cad.checks.own_part import extrusion_of

    start = time.perf_counter()
    extrusion = extrusion_of(part)
    swept = None
    reason = "no section is swept over most of it"
    if extrusion is not None:
        try:
            swept = replace(_swept(extrusion, scene), seconds=time.perf_counter() - start)
        except MeshError as error:  # its part is solved whole
            reason = str(error)
    if swept is not None:
        bar = max(face.K_error for face in swept.faces.values())
        if bar <= _SWEPT_ENOUGH:
            return swept
        reason = f"what its sweep leaves out may move K by {100.0 * bar:.2g} %"
    try:
        found = _in_tetrahedra(part, scene)
    except InputError:
        if swept is None:
            raise
        return swept
    return replace(found, not_swept=reason, seconds=time.perf_counter() - start)


def _in_tetrahedra(part: Part, scene: _Scene) -> PartStiffness:
    """Return the stiffness of any solid, on finer and finer meshes until the bar or the cost is reached."""
    from cad.checks.own_part import walls_of, with_sides

    layers = scene.layers
    if layers and scene.housing is not None:
        part, has_sides = with_sides(part, SIDES, 0.5 * scene.housing.depth)
        layers = layers if has_sides else ()
    walls = walls_of(part)
    solved: list[PartCompliance] = []
    cost = 0.0
    for scale in _SCALES:
        mesh = tetrahedra(part, walls, scale)
        unknowns = 3 * int(mesh.doflocs.shape[1])
        cost += _SECONDS_PER_UNKNOWN * unknowns
        if cost > MOST_SECONDS or _BYTES_PER_UNKNOWN * unknowns > MOST_BYTES:
            break
        if not solved:
            layers = layers if _is_covered(mesh, layers) else ()
        solved.append(tetrahedral_compliance(mesh, scene.material, scene.presses, layers))
        if len(solved) == 1:
            _refuse_block(solved[0], part, scene)
        if len(solved) >= _FEWEST and max(step / abs(K) for K, step in _extrapolated(solved)) < _FINE_ENOUGH:
            break
    if len(solved) < _FEWEST:
        bound = (
            f"at most about {MOST_SECONDS / _SECONDS_PER_UNKNOWN:.3g} for all meshes, {MOST_SECONDS:g} s of a processor"
        )
        hint = "take fine details away from where nothing bends, or draw the part as one section that is swept"
        what = "unknowns of the part in tetrahedra"
        raise validation_error(what, unknowns, "", bound, hint)
    no_strain = "tetrahedra are too coarse at the roots of leaves for it"
    faces = {
        name: PressedFace(K=K, K_error=step / K + ERROR_FLOOR, no_strain=no_strain)
        for name, (K, step) in zip(scene.presses, _extrapolated(solved), strict=True)
    }
    return PartStiffness(
        faces=faces,
        material=scene.material,
        method=f"quadratic tetrahedra, {len(solved)} meshes",
        held_by="the design's covers" if layers else "the faces that are held",
        dofs=solved[-1].dofs,
        left_out_mm3=0.0,
        left_out_at=None,
        curve=tuple((each.dofs, each.seconds, *(1e3 * each.K).tolist()) for each in solved),
    )


def _extrapolated(solved: Sequence[PartCompliance]) -> list[tuple[float, float]]:
    """Return the stiffness of each pressed face at size 0 and its error [N/mm]."""
    sizes = _SCALES[: len(solved)]
    return [at_size_zero(sizes, K) for K in np.array([each.K for each in solved]).T.tolist()]


def _swept(extrusion: Extrusion, scene: _Scene) -> PartStiffness:
    """Return the stiffness of an extrusion from two meshes, held by the layers of the design's mount if any."""
    turned = {name: tuple((extrusion.turn @ direction).tolist()) for name, direction in scene.presses.items()}
    layers = scene.layers if np.allclose(extrusion.turn, np.eye(3)) else ()
    (coarse_scale, coarse_layers), (fine_scale, fine_layers) = _MESHES
    mesh = swept_part(extrusion, coarse_scale, coarse_layers, turned.values())
    layers = layers if _is_covered(mesh.mesh, layers) else ()
    coarse = swept_compliance(mesh, scene.material, turned, layers)
    _refuse_block(coarse, extrusion.part, scene)
    numbers = strained_corners(coarse)
    missed = np.zeros(len(turned))
    if numbers:
        mesh = _judge_at_corners(extrusion, turned, numbers)
        rough, coarse = coarse, swept_compliance(mesh, scene.material, turned, layers)
        missed = _CORNER_ERROR * np.abs(rough.K / coarse.K - 1.0)
    of_answer = FineCorners(numbers=numbers, size=_CORNER_SIZES[1])
    mesh = swept_part(extrusion, fine_scale, fine_layers, turned.values(), of_answer)
    fine = swept_compliance(mesh, scene.material, turned, layers)
    held = swept_compliance(mesh, scene.material, turned) if layers else fine
    missed += left_out(mesh, fine)
    volume = mesh.excess * mesh.area
    where = None
    if volume.sum() > 1e-6 * mesh.area.sum():
        x, y, z = extrusion.turn.T @ mesh.places[:, int(np.argmax(volume))]
        where = (float(x), float(y), float(z))
    return PartStiffness(
        faces=_faces(scene.presses, (coarse, fine), missed, held if layers else None),
        material=scene.material,
        method="section in quadratic hexahedra, swept",
        held_by="the design's covers" if layers else "the faces that are held",
        dofs=fine.dofs,
        left_out_mm3=float(volume.sum()),
        left_out_at=where,
    )


def _judge_at_corners(
    extrusion: Extrusion, presses: Mapping[str, tuple[float, ...]], numbers: tuple[int, ...]
) -> SweptPart:
    """Return the coarse mesh with finer elements at sharp corners; raises MeshError.

    Coarse quadrilaterals may be folded where they grow from small ones; those between both meshes then are not.
    """
    (coarse, layers), (fine, _) = _MESHES
    of_judge = FineCorners(numbers=numbers, size=_CORNER_SIZES[0])
    try:
        return swept_part(extrusion, coarse, layers, presses.values(), of_judge)
    except MeshError:
        return swept_part(extrusion, 0.5 * (coarse + fine), layers, presses.values(), of_judge)


def _faces(
    names: Iterable[str],
    meshes: tuple[PartCompliance, PartCompliance],
    missed: Floats,
    held: PartCompliance | None,
) -> dict[str, PressedFace]:
    """Return each pressed face with the bar of two meshes, of sharp corners and of what the meshes leave out."""
    coarse, fine = meshes
    faces = {}
    for i, name in enumerate(names):
        change = abs(coarse.K[i] / fine.K[i] - 1.0)
        strain, inside = fine.strain_per_N[i], fine.strain_inside_per_N[i]
        is_known = math.isfinite(strain) and strain > 0.0
        faces[name] = PressedFace(
            K=float(fine.K[i]),
            K_error=float(ERROR_SHARE * change + ERROR_FLOOR + missed[i]),
            K_held=None if held is None else float(held.K[i]),
            strain_per_N=strain if is_known else None,
            strain_error=STRAIN_ERROR_SHARE * abs(inside / strain - 1.0) if is_known else None,
            no_strain=""
            if is_known
            else "it is not largest at a round inner corner, and at a sharp one it has no limit",
        )
    return faces


def _is_covered(mesh: object, layers: Sequence[ElasticLayer]) -> bool:
    """Return whether the layers of a mount lie on the ends of the sweep."""
    if not layers:
        return False
    middles = mesh.p[:, mesh.facets[:, mesh.boundaries[SIDES]]].mean(axis=1)  # type: ignore[attr-defined]
    return any(layer.covers(middles[0], middles[2]).any() for layer in layers)


def _refuse_block(found: PartCompliance, part: Part, scene: _Scene) -> None:
    """Raise InputError for a part in which nothing bends between what is pressed and what is held."""
    for name, K in zip(scene.presses, found.K.tolist(), strict=True):
        away = part.face_distance(name, HELD)
        most = _MOST_STIFF * scene.material[0] * away
        if not most >= K:
            bound = f"at most {1e3 * most:.3g} N/m: nothing of the part bends over the {away:.3g} mm to what is held"
            what = f"stiffness at {name}"
            raise validation_error(what, 1e3 * K, "N/m", bound, "export the part with its leaves")
