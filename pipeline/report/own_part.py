"""The report on a part that the user made: verdicts, numbers, and what the solution does not cover."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from pipeline.verdicts.rules import own_part_verdict
from sensor.words import with_bar

if TYPE_CHECKING:
    from pipeline.springs.own_part import PartStiffness
    from sensor.verdict import Verdict

_VERDICTS = {"low": "K_l", "high": "K_h"}


def part_verdicts(found: PartStiffness, targets: Mapping[str, float]) -> tuple[Verdict, ...]:
    """Return the verdicts on K_l and K_h of a part, against the `targets` of a design [N/m] by spring."""
    words = f"FE of this part, {found.method}, held by {found.held_by}; tolerance relative"
    return tuple(
        own_part_verdict(_VERDICTS[name], face.estimate, target, words)
        for (name, target), face in zip(targets.items(), found.faces.values(), strict=False)
    )


def part_data(found: PartStiffness) -> dict[str, object]:
    """Return the numbers of a solved part as JSON data, in the units that their keys name."""
    return {
        "method": found.method,
        "held_by": found.held_by,
        "E_MPa": found.material[0],
        "poisson": found.material[1],
        "not_swept": found.not_swept or None,
        "dofs": found.dofs,
        "seconds": found.seconds,
        "left_out_mm3": found.left_out_mm3,
        "left_out_at_mm": found.left_out_at,
        "curve": found.curve,
        "faces": {
            name: {
                "K_N_per_m": 1e3 * face.K,
                "error_percent": 100.0 * face.K_error,
                "K_N_per_m_with_holes_held": None if face.K_held is None else 1e3 * face.K_held,
                "strain_per_N": face.strain_per_N,
                "strain_error_percent": None if face.strain_error is None else 100.0 * face.strain_error,
                "no_strain": face.no_strain or None,
            }
            for name, face in found.faces.items()
        },
    }


def part_notes(found: PartStiffness) -> list[str]:
    """Return sentences on how a part was solved, on its meshes and faces, and on what the solution leaves out."""
    return list(_part_notes(found))


def _part_notes(found: PartStiffness) -> Iterator[str]:
    """Yield the sentences of `part_notes` in the order of the output."""
    E, poisson = found.material
    material = f"E {E:g} MPa, Poisson's ratio {poisson:g}"
    yield f"solved as {found.method}: {found.dofs} unknowns, {found.seconds:.1f} s, held by {found.held_by}; {material}"
    if found.not_swept:
        yield f"not swept: {found.not_swept}"
    for unknowns, seconds, *K in found.curve:
        stiffnesses = ", ".join(f"{value:.5g}" for value in K)
        yield f"{unknowns:.0f} unknowns, {seconds:.1f} s without its mesh: {stiffnesses} N/m"
    for name, face in found.faces.items():
        if name not in _VERDICTS:  # low and high have verdicts, which state their stiffness
            yield f"{name}: {with_bar(face.estimate.value, face.estimate.error)} N/m"
        if face.K_held is not None:
            with_holes = with_bar(1e3 * face.K_held, 1e3 * face.K_error * face.K_held)
            yield f"{name}: {with_holes} N/m where the walls of the screw holes are held instead"
        if face.strain_per_N is not None and face.strain_error is not None:
            strain = with_bar(face.strain_per_N, face.strain_error * face.strain_per_N)
            yield f"{name}: largest strain at a round inner corner {strain} for 1 N"
        else:
            yield f"{name}: no strain is told: {face.no_strain}"
    if found.left_out_at is not None:
        x, y, z = found.left_out_at
        place = f"most of it near ({x:.3g}, {y:.3g}, {z:.3g}) mm"
        yield f"the mesh leaves out {found.left_out_mm3:.3g} mm^3, {place}: its bound is in the bars"
