"""Contact of part of a face: cells on the split's footprints against nodes on a direct finite-element mesh.

The independent computation shares no kernel with the split: quadratic tetrahedra of the half y >= 0 with elements of
0.2 and 0.1 sides at the edges of the tips, condensed to the nodes under them, gap >= 0 and force >= 0 at each node as
non-negative least squares (Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23). Its error is of first
order in the size at the edges; both meshes extrapolate it, and a quarter of that step is its error bar.
"""

import numpy as np
import pytest

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.split import split_compliance

BLOCK = Fruit()
SPHERE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
SPRINGS = np.diag([1.0 / 0.9057, 1.0 / 20.831])  # mm/N


@pytest.fixture(scope="module")
def compliance():
    return split_compliance(BLOCK, Tips())


@pytest.mark.parametrize(
    ("fruit", "tilt", "travel", "expected", "bar"),
    [
        pytest.param(BLOCK, 5.0, 0.6, [0.160896, 2.182032], [0.000498, 0.026125], id="tilt 5"),
        pytest.param(BLOCK, 5.0, 0.2, [0.0, 1.264871], [0.0, 0.015066], id="one tip off"),
        pytest.param(SPHERE, 0.0, 0.1, [0.046726, 0.121369], [0.000398, 0.002018], id="sphere, start"),
        pytest.param(SPHERE, 0.0, 0.3, [0.164616, 0.554513], [0.000662, 0.006812], id="sphere, half way"),
    ],
)
def test_forces_agree_within_the_error_bars(compliance, fruit, tilt, travel, expected, bar):
    """At E = 2 MPa; a sphere is met at the inner edges of the tips."""
    scene = Scene(fruit=fruit, tips=Tips(), press=Press(tilt_deg=tilt))
    found = scene_response(scene, compliance, SPRINGS, (2.0,), [travel])
    forces = found.F[0, 0]
    assert np.all(np.abs(forces - expected) <= bar + found.F_error[0, 0] * forces)
    assert (expected[0] == 0.0) == (forces[0] == 0.0) == np.isnan(found.P[0, 0])
