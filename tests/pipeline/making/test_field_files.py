"""VTU files of a run: what ParaView shows at the marked place is the strain that the report judges."""

import numpy as np
import pytest
import pyvista as pv

from pipeline.storage.vtu import HALF_AT_Y

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def flexure_and_fruit(fields_folder):
    """Return the grids of the housing and of the fruit."""
    return pv.read(fields_folder / "flexure.vtu"), pv.read(fields_folder / "fruit.vtu")


def marked(flexure, name):
    """Return the node that is marked for a spring, of which there is one."""
    (node,) = np.flatnonzero(flexure[f"{name}_largest_strain_place"])
    return node


def test_half_a_model_is_marked_with_the_plane_of_its_mirror(flexure_and_fruit):
    """The nodes end at the plane that is told: there the boundary `symmetry` is. The fruit is whole."""
    flexure, fruit = flexure_and_fruit
    (plane,) = flexure.field_data[HALF_AT_Y]
    assert flexure.bounds[2] == plane == 0.0
    assert np.abs(flexure.points[flexure["symmetry"] == 1, 1] - plane).max() < 1e-9
    assert HALF_AT_Y not in fruit.field_data


def test_marked_strain_is_the_largest_of_the_leaves_and_that_of_the_report(flexure_and_fruit, default_run):
    flexure, _ = flexure_and_fruit
    for name, spring in default_run.result.springs.springs.items():
        strain = flexure["largest_principal_strain"]
        node = marked(flexure, name)
        assert strain[node] == strain[flexure[f"{name}_leaves"] == 1].max()
        assert abs(strain[node] / spring.root_strain - 1.0) < spring.root_strain_error


def test_six_components_are_the_tensor_of_von_mises(flexure_and_fruit):
    for grid in flexure_and_fruit:
        xx, yy, zz, xy, yz, xz = grid["stress_MPa"].T
        square = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + xz**2)
        # every component is written to a millionth of the largest, and von Mises grows by at most 3 of these
        known = 4e-6 * np.abs(grid["stress_MPa"]).max()
        np.testing.assert_allclose(np.sqrt(square), grid["von_mises_MPa"], rtol=0.0, atol=known)
