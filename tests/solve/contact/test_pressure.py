import numpy as np
import pytest
from scenes import SPHERE, SPRINGS, scene_of

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import InputError
from solve.contact.pressure import footprint_pressure
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

E, X = 2.0, 0.6


def pressed(block_compliance, **scene):
    return footprint_pressure(scene_of(**scene), block_compliance, SPRINGS, E, X)


@pytest.mark.parametrize(
    "scene", [{}, {"tilt": 5.0}, {"roll": 2.0}, {"fruit": SPHERE}, {"shape": "cylinder"}, {"shape": "sphere"}]
)
def test_cells_carry_the_forces_of_the_tips(block_compliance, scene):
    found = pressed(block_compliance, **scene)
    response = scene_response(scene_of(**scene), block_compliance, SPRINGS, (E,), (X,))
    np.testing.assert_allclose(found.forces, response.F[0, 0], rtol=1e-12)
    assert found.cell_forces.min() >= 0.0
    assert found.cell_forces.shape == (2, len(found.edges) - 1, len(found.edges) - 1)


def test_sphere_presses_as_hertz_says():
    """p_m = 2/3 p_0 and p_0 = (6 F E*^2 / pi^3 R^2)^(1/3): Johnson (1985), section 4.2."""
    block = Fruit(length_mm=400.0, width_mm=400.0, height_mm=400.0)
    fine = FruitCompliance(
        S=np.eye(2), difference_error=0.0, s11_error=0.0, info=SolveInfo(method="", dofs=0, seconds=0.0, status="")
    )
    scene = Scene(fruit=block, tips=Tips(shape="sphere", spacing_mm=100.0), press=PressMotion())
    found = footprint_pressure(scene, fine, np.zeros((2, 2)), E, 0.01)
    largest = (6.0 * found.forces * (E / 0.91) ** 2 / np.pi**3 / 0.5**2) ** (1.0 / 3.0)
    areas = np.outer(np.diff(found.edges), np.diff(found.edges))
    np.testing.assert_allclose((found.cell_forces / areas).max(axis=(1, 2)), largest, rtol=0.02)
    touching = ((found.cell_forces > 0.0) * areas).sum(axis=(1, 2))
    np.testing.assert_allclose(found.forces / touching, largest / 1.5, rtol=0.05)


def test_bad_modulus_is_refused(block_compliance):
    with pytest.raises(InputError) as refused:
        footprint_pressure(scene_of(), block_compliance, SPRINGS, 0.0, X)
    assert refused.value.field == "E"
