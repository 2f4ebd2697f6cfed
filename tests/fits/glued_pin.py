"""PIN_GIVE: how far a glued pin moves against the foot of a housing, from solids of foot, glue and pin.

`python tests/fits glued_pin` (1 minute). The half x >= 0 of one foot with its neck and a piece of the shuttle,
held at its top, in 20-node bricks: once solid with 1 N spread over its face, as the housing is solved, and once with
pocket, gable, glue and pin, with 1 N spread over the pin's end. The difference is what a pin gives.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from fits.comparison import Comparison, covering
from skfem import CellBasis, ElementHexS2, ElementVector, FacetBasis, MeshHex

from cad.design.parameters import Design
from cad.design.processes import PROCESSES, Process
from cad.design.tips import Tips
from cad.parts.housing import Housing
from cad.parts.layout import housing_for
from cad.parts.pin import STEEL_MPA, pin_compliance
from solve.elasticity import stiffness_matrix
from solve.linear import factorised

STEEL, GLUE_POISSON = (STEEL_MPA, 0.29), 0.35
GLUES_MPA = (1500.0, 3000.0, 4500.0)  # hard epoxies
ABOVE = 3.0  # [mm] of shuttle above the neck, where the cut does not matter
NEAR = 1e-6


@dataclass(frozen=True)
class Foot:
    """One foot with its pin: the housing's dimensions, the materials [MPa, 1], and whether the gable is empty."""

    housing: Housing
    plastic: tuple[float, float]
    glue: float = GLUES_MPA[1]
    gable: bool = True
    refined: int = 1

    def mesh(self) -> MeshHex:
        """Return bricks [mm] over foot, pocket, gable and the pin that stands out, plain boxes in the pocket."""
        h, n = self.housing, self.refined
        pin, pocket, half = 0.5 * h.pin_side, 0.5 * h.pocket_side, 0.5 * h.tip_side
        x = _lines((0.0, pin, pocket, half), (n, n, 2 * n))
        y = _lines((-half, -1.5 * pocket, -pocket, -pin, pin, pocket, half), (n, n, n, 2 * n, n, 2 * n))
        depth, ends = h.pocket_depth, (h.tip_height, h.neck_level, h.neck_level + ABOVE)
        levels = sorted({-h.pin_out, 0.0, depth, *ends})
        z = _lines(levels, tuple(max(1, round(n * (b - a))) for a, b in pairwise(levels)))
        return MeshHex.init_tensor(x, y, z)

    def widened(self, places: np.ndarray) -> np.ndarray:
        """Return the places [mm] with what lies outside the pocket spread out as the neck widens."""
        h = self.housing
        share = np.clip((places[2] - h.tip_height) / (h.neck_level - h.tip_height), 0.0, 1.0)
        moved = places.copy()
        for axis, top in ((0, h.shuttle_width), (1, h.depth)):
            inner, outer = 0.75 * h.pocket_side, 0.5 * h.tip_side
            reach = np.abs(places[axis])
            along = np.clip((reach - inner) / (outer - inner), 0.0, None)
            moved[axis] += np.sign(places[axis]) * along * share * 0.5 * (top - h.tip_side)
        return moved

    def compliance(self, *, pinned: bool) -> float:
        """Return how far the loaded face moves under 1 N on the whole foot [mm/N]."""
        h, mesh = self.housing, self.mesh()
        parts = self._parts(mesh.p[:, mesh.t].mean(axis=1), pinned)
        kept = np.flatnonzero(parts >= 0)
        mesh = replace(mesh, doflocs=self.widened(mesh.p)).restrict(kept)
        parts = parts[kept]
        element = ElementVector(ElementHexS2())
        matrix = None
        for number, material in enumerate((self.plastic, (self.glue, GLUE_POISSON), STEEL)):
            own = np.flatnonzero(parts == number)
            if len(own):
                basis = CellBasis(mesh, element, intorder=5, elements=own)
                block = stiffness_matrix(basis, *material)
                matrix = block if matrix is None else matrix + block
        basis = CellBasis(mesh, element, intorder=5)
        level = -h.pin_out if pinned else 0.0
        face = FacetBasis(
            mesh, element, facets=mesh.facets_satisfying(lambda p: np.abs(p[2] - level) < NEAR), intorder=4
        )
        mean = np.zeros(basis.N)
        for dofs, field in zip(face.element_dofs, face.basis, strict=True):
            np.add.at(mean, dofs, (np.asarray(field[0])[2] * face.dx).sum(axis=-1))
        mean /= float(face.dx.sum())
        top = mesh.p[2].max()
        held = basis.get_dofs(lambda p: np.abs(p[2] - top) < NEAR).all()
        plane = basis.get_dofs(lambda p: np.abs(p[0]) < NEAR).all("u^1")
        factor = factorised(matrix.tocsc(), np.union1d(held, plane))
        return 0.5 * float(mean @ factor.solve(mean))

    def _parts(self, centres: np.ndarray, pinned: bool) -> np.ndarray:
        """Return 0 for plastic, 1 for glue, 2 for steel, -1 for nothing, by the centres of the bricks [mm]."""
        h = self.housing
        x, y, z = centres
        parts = np.where(z > 0.0, 0, -1)
        if not pinned:
            return parts
        pin, pocket, reach = 0.5 * h.pin_side, 0.5 * h.pocket_side, h.pocket_depth
        in_pocket = (z > 0.0) & (z < reach) & (x < pocket)
        parts[in_pocket & (np.abs(y) < pocket)] = 1
        parts[(z < reach) & (x < pin) & (np.abs(y) < pin)] = 2
        if self.gable:
            # A box of the gable's area: half as high as the gable, as wide as the pocket.
            parts[in_pocket & (y < -pocket) & (y > -1.5 * pocket)] = -1
        return parts

    def give(self) -> float:
        """Return by how much more a pin moves than the face of a solid foot under 1 N [mm/N], the bar included."""
        return self.compliance(pinned=True) - self.compliance(pinned=False)


def _lines(corners: Sequence[float], counts: Sequence[int]) -> np.ndarray:
    pieces = [
        np.linspace(a, b, count, endpoint=False) for a, b, count in zip(corners, corners[1:], counts, strict=False)
    ]
    return np.concatenate([*pieces, corners[-1:]])


def foot_of(process: Process, side: float = 1.0, **changes: object) -> Foot:
    """Return the foot of the default design in a process with pins of a side [mm]."""
    housing = housing_for(Design(tips=Tips(socket="pin", side_mm=side)), process, (28.0, 14.0), (0.5, 0.1))
    return Foot(housing, (process.E_MPa, process.poisson), **changes)


CASES = (("fdm-petg", 1.0), ("fdm-petg", 0.7), ("fdm-petg", 1.4), ("fdm-pla", 1.0), ("sls-pa12", 1.0),
         ("sla-resin", 1.0), ("dmls-17-4ph", 1.0))  # fmt: skip


def compared(cases: Sequence[tuple[str, float]] = CASES) -> list[Comparison]:
    """Return the error of the closed form over its bar [1] for feet of some processes with pins of a side [mm]."""
    filled = []
    for name, side in cases:
        foot = foot_of(PROCESSES[name], side)
        form = pin_compliance(foot.housing, *foot.plastic)
        filled.append(abs(foot.give() - form.value) / form.error)
    return [covering("bar of a glued pin", 1.0, filled)]
