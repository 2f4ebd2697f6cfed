"""The report on a part that the user designed: verdicts, numbers, and limitations of the solution."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from pipeline.verdicts.rules import own_part_verdict
from sensor.words import value_with_bar

if TYPE_CHECKING:
    from pipeline.springs.own_part import PartStiffness, PressedFace
    from sensor.verdict import Verdict

_VERDICT_OF_FACE = {"low": "K_l", "high": "K_h"}
"""The name of the verdict on the stiffness at a face; faces with other names have no verdict."""


def part_verdicts(part: PartStiffness, targets: Mapping[str, float]) -> tuple[Verdict, ...]:
    """Return the verdicts on K_l and K_h of a part.

    `targets` [N/m] holds the targets of a design by spring, in the order of the part's faces. Without a design, there
    are no targets and no verdicts.
    """
    method_text = f"FE of this part, {part.method}, held by {part.held_by}; tolerance relative"
    pairs = zip(targets.items(), part.faces.values(), strict=False)  # without a design, there are faces but no targets
    return tuple(
        own_part_verdict(_VERDICT_OF_FACE[name], face.estimate, target, method_text) for (name, target), face in pairs
    )


def part_data(part: PartStiffness) -> dict[str, object]:
    """Return the numbers of a solved part as JSON data, whose keys name the units.

    A number that was not solved is None. A reason that does not apply is None too.
    """
    E, poisson = part.material
    faces = {}
    for name, face in part.faces.items():
        K_held = face.K_held
        strain_error = face.strain_error
        faces[name] = {
            "K_N_per_m": 1e3 * face.K,  # converted from N/mm
            "error_percent": 100.0 * face.K_error,
            "K_N_per_m_with_holes_held": None if K_held is None else 1e3 * K_held,
            "strain_per_N": face.strain_per_N,
            "strain_error_percent": None if strain_error is None else 100.0 * strain_error,
            "no_strain": face.no_strain or None,
        }
    return {
        "method": part.method,
        "held_by": part.held_by,
        "E_MPa": E,
        "poisson": poisson,
        "not_swept": part.not_swept or None,
        "dofs": part.dofs,
        "seconds": part.seconds,
        "left_out_mm3": part.left_out_mm3,
        "left_out_at_mm": part.left_out_at,
        "curve": part.curve,
        "faces": faces,
    }


def part_notes(part: PartStiffness) -> list[str]:
    """Return sentences on the method, the meshes, the stiffness of each face, and features that the mesh leaves out."""
    return list(_part_notes(part))


def _part_notes(part: PartStiffness) -> Iterator[str]:
    """Yield the sentences of `part_notes` in their order."""
    E, poisson = part.material
    material = f"E {E:g} MPa, Poisson's ratio {poisson:g}"
    yield f"solved as {part.method}: {part.dofs} unknowns, {part.seconds:.1f} s, held by {part.held_by}; {material}"
    if part.not_swept:
        yield f"not swept: {part.not_swept}"
    for unknowns, seconds, *stiffnesses in part.curve:  # one entry for each mesh
        stiffness_text = ", ".join(f"{K:.5g}" for K in stiffnesses)
        yield f"{unknowns:.0f} unknowns, {seconds:.1f} s without its mesh: {stiffness_text} N/m"
    for name, face in part.faces.items():
        yield from _face_notes(name, face)
    if part.left_out_at is not None:
        x, y, z = part.left_out_at
        place_text = f"most of it near ({x:.3g}, {y:.3g}, {z:.3g}) mm"
        volume_text = f"the mesh leaves out {part.left_out_mm3:.3g} mm^3, {place_text}"
        yield f"{volume_text}; the error bars include a bound of its effect"


def _face_notes(name: str, face: PressedFace) -> Iterator[str]:
    """Yield sentences on the stiffness and the largest strain at the pressed face called `name`.

    The stiffness of a face with a verdict is left out, because the verdict states it.
    """
    if name not in _VERDICT_OF_FACE:
        yield f"{name}: {value_with_bar(face.estimate.value, face.estimate.error)} N/m"
    if face.K_held is not None:
        with_holes = value_with_bar(1e3 * face.K_held, 1e3 * face.K_error * face.K_held)  # N/mm to N/m
        yield f"{name}: {with_holes} N/m if the walls of the screw holes are held instead"
    if face.strain_per_N is not None and face.strain_error is not None:
        strain = value_with_bar(face.strain_per_N, face.strain_error * face.strain_per_N)
        yield f"{name}: largest strain at a rounded inner corner {strain} for 1 N"
    else:
        yield f"{name}: the strain is unknown: {face.no_strain}"
