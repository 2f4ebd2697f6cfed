"""The stiffness of a part that the user made, with its error bar: swept where it is an extrusion.

A part is held and pressed as the housing of a design is, or at faces that points name.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cad.parts.housing import Housing
from cad.parts.pin import pin_compliance
from mesh.own_part import SIDES, swept_part
from pipeline.springs.mounts import mount_layers
from sensor.quantity import Estimate, InputError, report_field, validation_error
from solve.housing.stiffness import STRAIN_ERROR_SHARE
from solve.own_part import ERROR_FLOOR, ERROR_SHARE, PartCompliance, swept_compliance

if TYPE_CHECKING:
    from cad.checks.own_part import Extrusion
    from cad.parts.part import Part
    from solve.housing.elastic_layer import ElasticLayer

HELD = "mounting_holes"  # as the solver names what does not move
_MESHES = ((4.0, 1), (3.0, 2))  # scale of the section and layers over half the depth: of the judge, and of the answer
_MOST_STIFF = 0.02  # of E times the distance from what is pressed to what is held: beyond it nothing bends
_UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class PressedFace:
    """One pressed face of a part; `K_held` is its stiffness where the walls of the design's screw holes are held."""

    K: float = report_field("N/m", "stiffness", key="K_N_per_m", times=1e3)
    K_error: float = report_field("%", "half width of its error bar", key="error_percent", times=100.0)
    K_held: float | None = None
    strain_per_N: float | None = None
    strain_error: float | None = None
    no_strain: str = ""

    @property
    def estimate(self) -> Estimate:
        """Return the stiffness with its error bar [N/m]."""
        return Estimate(self.K, self.K_error * self.K, "N/mm").times(1e3, "N/m")


@dataclass(frozen=True, kw_only=True)
class PartStiffness:
    """What a part gives under a force on each face that is pressed, by name, and how it was solved.

    `left_out_mm3` is the volume that the mesh has too much or too little, and `left_out_at` where most of it lies [mm].
    """

    faces: Mapping[str, PressedFace]
    method: str
    held_by: str
    dofs: int
    seconds: float
    left_out_mm3: float
    left_out_at: tuple[float, float, float] | None


def design_part_stiffness(path: Path, housing: Housing, material: tuple[float, float]) -> PartStiffness:
    """Return the stiffness of the part of a STEP file, held and pressed as the housing of a design.

    Pins count with the feet that carry them. `material` is E [MPa] and Poisson's ratio. Raises InputError.
    """
    from cad.checks.own_part import faces_at, hole_points, own_part, read_own_solid, tip_points

    solid = read_own_solid(path, housing)
    faces = {name: faces_at(solid, f"the {name} tip", [point]) for name, point in tip_points(housing).items()}
    faces[HELD] = faces_at(solid, "a screw hole", hole_points(housing))
    found = _stiffness(own_part(solid, faces), dict.fromkeys(tip_points(housing), _UP), material, housing)
    if not housing.pin_side:
        return found
    pin = pin_compliance(housing, *material)
    return replace(found, faces={name: _with_pin(face, pin) for name, face in found.faces.items()})


def _with_pin(face: PressedFace, pin: Estimate) -> PressedFace:
    K = 1.0 / (1.0 / face.K + pin.value)
    return replace(face, K=K, K_error=K / face.K * face.K_error + pin.error * K)


def _stiffness(
    part: Part,
    presses: Mapping[str, tuple[float, float, float]],
    material: tuple[float, float],
    housing: Housing | None,
) -> PartStiffness:
    """Return the stiffness of a part whose faces are named; raises InputError."""
    from cad.checks.own_part import extrusion_of

    start = time.perf_counter()
    extrusion = extrusion_of(part)
    if extrusion is None:
        msg = "The part must be one section that is swept, but for tips and pockets. Print it flat."
        raise InputError(msg)
    return _swept(extrusion, presses, material, housing, start)


def _swept(
    extrusion: Extrusion,
    presses: Mapping[str, tuple[float, float, float]],
    material: tuple[float, float],
    housing: Housing | None,
    start: float,
) -> PartStiffness:
    """Return the stiffness of an extrusion from two meshes, held by the layers of the design's mount if any."""
    turned = {name: tuple((extrusion.turn @ direction).tolist()) for name, direction in presses.items()}
    layers = () if housing is None or not np.allclose(extrusion.turn, np.eye(3)) else mount_layers(housing)
    meshes = [swept_part(extrusion, scale, count, turned.values()) for scale, count in _MESHES]
    layers = layers if _is_covered(meshes[-1].mesh, layers) else ()
    coarse, fine = (swept_compliance(mesh, material, turned, layers) for mesh in meshes)
    _refuse_block(fine, extrusion.part, tuple(presses), material)
    held = swept_compliance(meshes[-1], material, turned) if layers else fine
    mesh = meshes[-1]
    volume = np.abs(mesh.excess) * mesh.area
    where = None
    if volume.sum() > 1e-6 * mesh.area.sum():
        x, y, z = extrusion.turn.T @ mesh.places[:, int(np.argmax(volume))]
        where = (float(x), float(y), float(z))
    return PartStiffness(
        faces=_faces(presses, coarse, fine, held if layers else None),
        method="section in quadratic hexahedra, swept",
        held_by="the design's covers" if layers else "the faces that are held",
        dofs=fine.dofs,
        seconds=time.perf_counter() - start,
        left_out_mm3=float(volume.sum()),
        left_out_at=where,
    )


def _faces(
    names: Sequence[str] | Mapping[str, object],
    coarse: PartCompliance,
    fine: PartCompliance,
    held: PartCompliance | None,
) -> dict[str, PressedFace]:
    """Return each pressed face with the bar of two meshes and of what they leave out."""
    faces = {}
    for i, name in enumerate(names):
        change = abs(coarse.K[i] / fine.K[i] - 1.0)
        strain, inside = fine.strain_per_N[i], fine.strain_inside_per_N[i]
        is_known = math.isfinite(strain) and strain > 0.0
        faces[name] = PressedFace(
            K=float(fine.K[i]),
            K_error=float(ERROR_SHARE * change + ERROR_FLOOR + fine.left_out[i]),
            K_held=None if held is None else float(held.K[i]),
            strain_per_N=strain if is_known else None,
            strain_error=STRAIN_ERROR_SHARE * abs(inside / strain - 1.0) if is_known else None,
            no_strain="" if is_known else "the section has no round inner corner, at a sharp one strain has no limit",
        )
    return faces


def _is_covered(mesh: object, layers: Sequence[ElasticLayer]) -> bool:
    """Say whether the layers of a mount lie on the ends of the sweep."""
    middles = mesh.p[:, mesh.facets[:, mesh.boundaries[SIDES]]].mean(axis=1)  # type: ignore[attr-defined]
    return any(layer.covers(middles[0], middles[2]).any() for layer in layers)


def _refuse_block(found: PartCompliance, part: Part, names: Sequence[str], material: tuple[float, float]) -> None:
    """Raise InputError for a part in which nothing bends between what is pressed and what is held."""
    for name, K in zip(names, found.K.tolist(), strict=True):
        away = part.face_distance(name, HELD)
        most = _MOST_STIFF * material[0] * away
        if not most >= K:
            bound = f"at most {1e3 * most:.3g} N/m: nothing of the part bends over the {away:.3g} mm to what is held"
            what = f"stiffness at {name}"
            raise validation_error(what, 1e3 * K, "N/m", bound, "export the part with its leaves")
