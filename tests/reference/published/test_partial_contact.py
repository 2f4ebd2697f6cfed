"""Contact of part of a face by nodes on a direct finite-element mesh, which are the truth of cells on the split.

The independent computation shares no kernel with the split: quadratic tetrahedra, their stiffness condensed to the
nodes under the tips, gap >= 0 and force >= 0 at each node, solved as non-negative least squares on the Cholesky
factor. Its error is of first order in the size at the edges of the tips. Two meshes extrapolate it, and a quarter of
that step is its error bar.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scenes import BLOCK, SPRINGS
from skfem import ElementTetP2

from benchmarks.bars.press import complementary
from benchmarks.bars.truths import BARS, TRUTHS
from reference.fruit_meshes import HALF, fruit_block, fruit_mesh
from sensor.design.tips import Tips
from solve.elasticity import stiffness_matrix, vector_basis
from solve.linear import factorise

TIPS = Tips()
E = 2.0
SCALES = (2.0, 1.0)
BAR = 0.25  # of the extrapolation step: at most 0.2 of it is seen between two and three meshes
ROUND_OFF = 1e-2  # the truths have six digits, their errors some less
SCENES = BARS["press beside direct elements"]


@dataclass(frozen=True)
class Nodes:
    """Nodes under both tips on the half y >= 0: points [mm], tip of each, compliance at E = 1."""

    places: np.ndarray
    tip: np.ndarray
    compliance: np.ndarray


def condensed(scale):
    """Return the nodes under the tips on one mesh, by a unit force on each."""
    mesh = fruit_mesh(fruit_block(BLOCK, TIPS, HALF), BLOCK, TIPS, scale)
    basis = vector_basis(mesh, ElementTetP2(), order=2)
    fixed = np.concatenate([basis.get_dofs("base").all(), basis.get_dofs("symmetry_y").all("u^2")])
    factor = factorise(stiffness_matrix(basis, 1.0, BLOCK.poisson), fixed)
    names = ("low_tip", "high_tip")
    under = [basis.get_dofs(name).all("u^3") for name in names]
    dofs = np.concatenate(under)
    unit = np.zeros((basis.N, len(dofs)))
    unit[dofs, np.arange(len(dofs))] = 1.0
    tip = np.repeat([0, 1], [len(one) for one in under])
    return Nodes(basis.doflocs[:2, dofs].T, tip, factor.solve(unit)[dofs])


def approach(nodes, radius, tilt, x):
    """Return how far the undeformed tips would enter the fruit at each node; a ball is met at its inner edges."""
    along, across = nodes.places.T
    entered = x + along * np.tan(np.radians(tilt))
    if radius is not None:
        inner = 0.5 * (TIPS.spacing_mm - TIPS.side_mm)
        entered += np.sqrt(radius**2 - along**2 - across**2) - np.sqrt(radius**2 - inner**2)
    return entered


def nodal_contact(nodes, entered):
    """Return the forces of the tips: min f A f / 2 - f b over f >= 0, springs in series; both halves count."""
    tips = np.eye(2)[nodes.tip]
    matrix = nodes.compliance / E + 2.0 * tips @ SPRINGS @ tips.T
    f = complementary(0.5 * (matrix + matrix.T), entered)
    gap = matrix @ f - entered
    assert gap.min() > -1e-9
    assert np.abs(f * gap).max() < 1e-9
    return 2.0 * tips.T @ f


@pytest.fixture(scope="module")
def meshes():
    return [condensed(scale) for scale in SCALES]


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_truth_is_the_limit_of_forces_at_first_order(meshes, name):
    """With a quarter of the last step as its error."""
    case = SCENES[name]
    tilt, travel = case["press"].get("tilt_deg", 0.0), case["press"]["travel_mm"]
    radius = case.get("fruit", {}).get("radius_mm")
    coarse, fine = (nodal_contact(one, approach(one, radius, tilt, travel)) for one in meshes)
    truth = TRUTHS[case["truth"]]
    np.testing.assert_allclose(2.0 * fine - coarse, truth.values, rtol=ROUND_OFF)
    np.testing.assert_allclose(BAR * np.abs(fine - coarse), truth.errors, rtol=ROUND_OFF)
