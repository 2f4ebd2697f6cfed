"""How far a glued pin moves against the foot of a housing, from solids of foot, glue and pin less a solid foot.

The half x >= 0 of a foot with its neck and a piece of the shuttle, held at its top, in 20-node bricks: once solid with
1 N on its face, as the housing is solved, and once with pocket, gable, glue and pin, with 1 N on the pin's end.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from fits.covering import covers
from skfem import CellBasis, ElementHexS2, ElementVector, LinearForm, MeshHex

from cad.design.parameters import Design
from cad.design.processes import PROCESSES
from cad.design.tips import Tips
from cad.parts.layout import housing_for
from cad.parts.pin import STEEL_MPA, pin_compliance
from solve.elasticity import stiffness_matrix
from solve.linear import factorised

GLUE = (3000.0, 0.35)  # a hard epoxy
STEEL = (STEEL_MPA, 0.29)
NOTHING, PLASTIC = -1, 0
ABOVE = 3.0  # [mm] of shuttle above the neck, where the cut does not matter
NEAR = 1e-6


@LinearForm
def downward(v, _):
    return v[2]


def foot_mesh(h):
    """Return bricks [mm] over foot, pocket, gable and the pin that stands out, and the material of each."""
    pin, pocket, half = 0.5 * h.pin_side, 0.5 * h.pocket_side, 0.5 * h.tip_side
    x_lines = np.array([0.0, pin, pocket, 0.5 * (pocket + half), half])
    y_lines = np.array([-half, -1.5 * pocket, -pocket, -pin, 0.0, pin, pocket, 0.5 * (pocket + half), half])
    levels = np.array([-h.pin_out, 0.0, h.pocket_depth, h.tip_height, h.neck_level, h.neck_level + ABOVE])
    levels.sort()
    z_lines = [levels[:1]]
    for a, b in pairwise(levels):
        z_lines.append(np.linspace(a, b, max(1, round(b - a)) + 1)[1:])
    mesh = MeshHex.init_tensor(x_lines, y_lines, np.concatenate(z_lines))

    x, y, z = mesh.p[:, mesh.t].mean(axis=1)
    in_pocket = (z > 0.0) & (z < h.pocket_depth) & (x < pocket)
    parts = np.where(z > 0.0, PLASTIC, NOTHING)
    parts[in_pocket & (np.abs(y) < pocket)] = 1
    parts[(z < h.pocket_depth) & (x < pin) & (np.abs(y) < pin)] = 2
    # The gable is empty: a box of its area, half as high, as wide as the pocket.
    parts[in_pocket & (y < -pocket) & (y > -1.5 * pocket)] = NOTHING

    # What lies outside the pocket is spread out as the neck widens.
    places = mesh.p.copy()
    up = np.clip((places[2] - h.tip_height) / (h.neck_level - h.tip_height), 0.0, 1.0)
    inner = 0.75 * h.pocket_side
    for axis, top in ((0, h.shuttle_width), (1, h.depth)):
        outside = np.clip((np.abs(mesh.p[axis]) - inner) / (half - inner), 0.0, None)
        places[axis] += np.sign(mesh.p[axis]) * outside * up * 0.5 * (top - h.tip_side)
    return replace(mesh, doflocs=places), parts


def compliance(mesh, parts, materials, level):
    """Return how far the face at a level moves under 1 N on the whole foot [mm/N]."""
    kept = np.flatnonzero(parts >= 0)
    mesh = mesh.restrict(kept)
    element = ElementVector(ElementHexS2())
    matrices = []
    for part in np.unique(parts[kept]):
        basis = CellBasis(mesh, element, intorder=5, elements=np.flatnonzero(parts[kept] == part))
        matrices.append(stiffness_matrix(basis, *materials[part]))
    basis = CellBasis(mesh, element, intorder=5)
    face = basis.boundary(mesh.facets_satisfying(lambda p: np.abs(p[2] - level) < NEAR))
    mean = downward.assemble(face) / float(face.dx.sum())
    top = mesh.p[2].max()
    held = basis.get_dofs(lambda p: np.abs(p[2] - top) < NEAR).all()
    plane = basis.get_dofs(lambda p: np.abs(p[0]) < NEAR).all("u^1")
    return 0.5 * float(mean @ factorised(sum(matrices).tocsc(), np.union1d(held, plane)).solve(mean))


@pytest.mark.study
def test_bar_of_a_glued_pin_covers_solids():
    filled = []
    for name, side in (("fdm-petg", 0.7), ("dmls-17-4ph", 1.0)):
        process = PROCESSES[name]
        housing = housing_for(Design(tips=Tips(socket="pin", side_mm=side)), process, (28.0, 14.0), (0.5, 0.1))
        plastic = (process.E_MPa, process.poisson)
        mesh, parts = foot_mesh(housing)
        solid = np.where(mesh.p[2, mesh.t].mean(axis=0) > 0.0, PLASTIC, NOTHING)
        glued = compliance(mesh, parts, (plastic, GLUE, STEEL), -housing.pin_out)
        form = pin_compliance(housing, *plastic)
        filled.append(abs(glued - compliance(mesh, solid, (plastic,), 0.0) - form.value) / form.error)
    assert covers(1.0, filled)
