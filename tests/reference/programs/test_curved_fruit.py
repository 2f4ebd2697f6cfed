"""The changes by the shape of a fruit that tetrahedra find: under the rigid tips themselves, and on CAD solids."""

import pytest

from benchmarks.bars.truths import BARS, TRUTHS
from reference.curved_fruit import bent_by_height, block_mesh, change_along_normals, sizes, solid_change
from reference.direct_fruit import mesh_compliance
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

TIPS = Tips()
DIGITS = 2e-5  # [1/mm] to which a truth is found again: a tenth of its error
RIGID = ("", ", nu 0", ", less curved")


def body(name):
    """Return the fruit of a case of the curved body, and the change that is its truth [1/mm]."""
    case = BARS["curved body"][name]
    return Fruit(**case["fruit"]), TRUTHS[case["truth"]].values[0]


def rigid_change(fruit, scale):
    """Return the change of s11 - s12 [1/mm] under rigid tips, on one mesh of the block and the same mesh bent."""
    block = block_mesh(fruit, TIPS, sizes(TIPS, scale, 0.5 * scale**0.25, 2.0 * scale**0.25))
    bent = bent_by_height(block, fruit)
    bent_S, block_S = (mesh_compliance(mesh, fruit.poisson).S for mesh in (bent, block))
    change = bent_S - block_S
    return float(0.5 * (change[0, 0] + change[1, 1]) - change[0, 1])


@pytest.mark.parametrize(
    ("name", "coarse", "error"),
    [
        pytest.param("rigid tips", 2.0, 7.5e-4, marks=pytest.mark.slow),
        *(pytest.param(f"rigid tips{more}", 0.5, 7.5e-6, marks=pytest.mark.study) for more in RIGID),
    ],
)
def test_truth_under_rigid_tips_is_the_limit_at_size_zero(name, coarse, error):
    """The error of a change is of first order in the size at the edge of the tips [1/mm]."""
    fruit, truth = body(name)
    assert 2.0 * rigid_change(fruit, 0.5 * coarse) - rigid_change(fruit, coarse) == pytest.approx(truth, abs=error)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["along the normals", pytest.param("along the normals, less curved", marks=pytest.mark.study)]
)
def test_truth_along_normals_is_of_loads_that_are_round_along_the_skin(name):
    fruit, truth = body(name)
    assert change_along_normals(fruit, TIPS, sizes(TIPS, 2.0, 0.4, 2.0)) == pytest.approx(truth, abs=DIGITS)


@pytest.mark.study
@pytest.mark.parametrize("name", ["solid piece", "solid ball", "solid egg"])
def test_truth_of_solids_is_of_the_cad_kernel(name):
    fruit, truth = body(name)
    size = sizes(TIPS, 1.0, 0.22, 6.0 if fruit.whole else 2.0)
    assert solid_change(fruit, TIPS, size) == pytest.approx(truth, abs=DIGITS)
