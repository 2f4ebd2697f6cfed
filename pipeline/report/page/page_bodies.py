"""The bodies on the page, in GLB format: the assembly, and the deformed flexures coloured by stress."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cad.files.glb import GlbBody, encode_glb, glb_position
from pipeline.making.field_files import fields_at_full_travel
from pipeline.options import RunOptions
from pipeline.report.page.page_template import pack_bytes
from pipeline.report.report import Report
from pipeline.result import SensorResult
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.mounts import coarse_half
from pipeline.storage.plain import Plain
from sensor.arrays import Floats
from sensor.words import round_below
from solve.housing.clamped_half import ClampedHalf
from solve.housing.stiffness import SPRINGS, leaf_faces, tip_face

ASSEMBLY = "assembly.glb"
_SYMMETRY = "symmetry"  # name of the mesh boundary on the plane of symmetry
# Bound of the relative error of the largest stress on the coarse mesh. The error is relative to the stress on the mesh
# on which the springs are solved. For four designs and four processes, the error was -0.02 to 0.19, also on the mesh of
# a rough answer.
STRESS_ERROR = 0.2
_DRAWN_DEFLECTION = 0.08  # largest drawn deflection, as a fraction of the length of the part
# Colours from the smallest to the largest value. The palette is viridis, by S. van der Walt and N. Smith (CC0), whose
# colours readers with colour blindness can distinguish.
_PALETTE = ("#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725")


@dataclass(frozen=True, kw_only=True)
class ColourScale:
    """The colours of a field: its name and unit, its smallest and largest value, and its limit."""

    label: str
    low: float
    high: float
    limit: float | None = None
    palette: tuple[str, ...] = _PALETTE

    def colours(self, values: Floats) -> Floats:
        """Return the colours of `values` (n,) as red, green and blue components from 0 to 1, (n, 3).

        Colours are interpolated between the shades of the palette. Values beyond the scale get the colour of its end.
        """
        shades = np.array([_rgb(shade) for shade in self.palette])  # (shades, 3)
        span = self.high - self.low if self.high > self.low else 1.0  # avoids a division by 0 for a constant field
        positions = np.clip((values - self.low) / span, 0.0, 1.0) * (len(shades) - 1)  # from 0 to the last shade
        components = [np.interp(positions, np.arange(len(shades)), component) for component in shades.T]
        return np.stack(components, axis=1)


def _rgb(shade: str) -> list[float]:
    """Return the red, green and blue components of a colour "#rrggbb", each from 0 to 1."""
    return [int(shade[start : start + 2], 16) / 255.0 for start in (1, 3, 5)]


def field_body(title: str, body: GlbBody, scale: ColourScale, caption: str, labels: Sequence[Plain] = ()) -> Plain:
    """Return a body coloured by a field as page data, with a slider that deforms it; `labels` name points on it."""
    return {
        "name": title,
        "glb": pack_bytes(encode_glb([body])),
        "slider": "press",
        "caption": caption,
        "legend": asdict(scale),
        "labels": list(labels),
    }


def assembly_body(folder: Path) -> Plain:
    """Return the assembly of an output folder as page data; raises ValueError if the folder has no assembly."""
    path = folder / ASSEMBLY
    if not path.is_file():
        msg = "no part is made"
        raise ValueError(msg)
    return {"name": "Sensor over its fruit", "glb": pack_bytes(path.read_bytes()), "slider": "apart"}


def loaded_half(springs: FittedSprings, options: RunOptions) -> ClampedHalf:
    """Return the finite-element model of half the housing, on the coarse mesh that the page shows; it is cached.

    Raises ValueError if no housing was made, and SolveError if the solution is unreliable.
    """
    if springs.housing is None:
        msg = "no part is made"
        raise ValueError(msg)
    process = springs.process
    return coarse_half(springs.housing, process.E_MPa, process.poisson, rough=options.rough)


def flexure_body(report: Report, result: SensorResult) -> Plain:
    """Return the housing deformed at full travel and coloured by stress as page data; for a square, one plate.

    The stress is the von Mises stress [MPa] at the surface. Raises ValueError if no housing was made, and SolveError if
    the solution is unreliable.
    """
    half = loaded_half(result.springs, result.options)
    fields = fields_at_full_travel(result.springs, half)
    nodes, corners = _drawn_surface(half)
    positions = half.basis.mesh.p.T[nodes]  # without load [mm]
    length = float(np.ptp(positions[:, 0]))  # length of the part along x [mm]
    displacement = fields.displacement[nodes]
    stress = fields.von_mises[nodes]
    exaggeration = deformation_factor(float(np.linalg.norm(displacement, axis=1).max()), length)
    process = result.springs.process
    scale = ColourScale(
        label="von Mises stress [MPa]", low=0.0, high=float(stress.max()), limit=process.E_MPa * process.strain_limit
    )
    caption = _stress_caption(report, result, scale, exaggeration)
    body = _whole_body(positions, corners, exaggeration * displacement, scale.colours(stress))
    labels = _spring_labels(half, exaggeration * fields.displacement)
    return field_body("Springs under load", body, scale, caption, labels)


def _drawn_surface(half: ClampedHalf) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the numbers of the nodes (n,) on the drawn surface of half the housing, and its quadrilaterals (m, 4).

    A quadrilateral is given by its four corners, as indices into the array of node numbers. The half has y >= 0. Its
    plane of symmetry is inside the housing and is not drawn.
    """
    mesh = half.basis.mesh
    facets = np.setdiff1d(mesh.boundary_facets(), mesh.boundaries[_SYMMETRY])
    quads = mesh.facets[:, facets].T  # node numbers of the corners
    nodes = np.unique(quads)  # sorted, as `searchsorted` requires
    return nodes, np.searchsorted(nodes, quads)


def _whole_body(positions: Floats, quads: NDArray[np.int64], displacement: Floats, colours: Floats) -> GlbBody:
    """Return the whole housing, which consists of the half with y >= 0 and its mirror image.

    The `positions`, the drawn `displacement` [mm] and the `colours` of the surface nodes of the half have the shape
    (n, 3). `quads` (m, 4) are the indices of the corners of its quadrilaterals.
    """
    mirror = np.array([1.0, -1.0, 1.0])  # changes the sign of y
    # The mirror image of a quadrilateral faces inwards. Reversing the order of its corners turns it outwards again.
    mirrored_quads = len(positions) + quads[:, ::-1]
    return GlbBody(
        name="housing",
        vertices=np.concatenate([positions, positions * mirror]),
        triangles=_triangles(np.concatenate([quads, mirrored_quads])),
        colour=np.concatenate([colours, colours]),
        displacement=np.concatenate([displacement, displacement * mirror]),
    )


def _stress_caption(report: Report, result: SensorResult, scale: ColourScale, exaggeration: float) -> str:
    """Return the caption of the housing coloured by stress: the largest stress, its limit, and the safety factors.

    `scale` holds the largest stress and its limit [MPa]. `exaggeration` [1] is the factor on the drawn deflection. A
    spring without a known safety factor is omitted.
    """
    process = result.springs.process
    safety_factors = [
        f"{name} spring {spring.safety_factor:.3g}" for name, spring in report.flexures.items() if spring.safety_factor
    ]
    housing = result.springs.housing
    part = "One of the two equal plates of the square. " if housing and housing.back_to_back else ""
    return (
        f"{part}At full travel on the firmest fruit, deflection drawn {exaggeration:g} times. "
        f"The largest von Mises stress is {scale.high:.3g} MPa, its limit {scale.limit:.3g} MPa (E of {process.name} "
        f"times its strain limit). Safety against the strain limit: {', '.join(safety_factors)}. "
        f"The mesh is coarse: the largest stress may be up to {100.0 * STRESS_ERROR:g} % off, mostly too high."
    )


def _spring_labels(half: ClampedHalf, displacement: Floats) -> list[Plain]:
    """Return the labels of the tips and springs of the housing's `half` as page data.

    A label has the position of its point in the mesh, and the displacement of this point while the body is deformed.
    `displacement` (n, 3) [mm] is the drawn displacement of the nodes. The tips are closer together than their labels
    are wide, so the label of a tip has a side: -1 left of the other tip, 1 right of it.
    """
    mesh = half.basis.mesh
    nodes = {name: np.unique(mesh.facets[:, indices]) for name, indices in mesh.boundaries.items()}

    def label(text: str, face: str, **properties: int) -> Plain:
        at, by = (glb_position(values[nodes[face]].mean(axis=0)).tolist() for values in (mesh.p.T, displacement))
        return {"text": text, "at": at, "by": by, **properties}

    middle = np.mean([mesh.p[0, nodes[tip_face(spring)]].mean() for spring in SPRINGS])  # x between the tips [mm]
    labels = []
    for spring in SPRINGS:
        is_left = mesh.p[0, nodes[tip_face(spring)]].mean() < middle
        labels.append(label(f"{spring} tip", tip_face(spring), side=-1 if is_left else 1))
        labels.append(label(f"{spring} spring", leaf_faces(spring)))
    return labels


def deformation_factor(largest_mm: float, length_mm: float) -> float:
    """Return the factor that exaggerates displacements in a picture [1]: 1, 2 or 5 times a power of ten.

    The largest displacement `largest_mm` is drawn as at most the fraction `_DRAWN_DEFLECTION` of the part's length
    `length_mm`. A larger displacement is drawn to scale, because the factor is at least 1.
    """
    if largest_mm <= 0.0:  # an undeformed part
        return 1.0
    return max(1.0, round_below(_DRAWN_DEFLECTION * length_mm / largest_mm))


def _triangles(quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Divide quadrilaterals (n, 4) into triangles (2 n, 3)."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
