"""Swept hexahedra against curved tetrahedra on the solid read back from its STEP file."""

import cadquery as cq
import pytest
from scenes import SMALL_HOUSING

from cad.files.step import read_step, write_step
from cad.parts.housing_solid import housing_part, named_housing
from mesh.housing.sweep import flexure_mesh
from reference.flexure_reference import reference_stiffness
from reference.tetrahedra import fine_boxes, tetrahedra
from solve.housing.stiffness import housing_stiffness, tip_compliance

PETG = (2000.0, 0.38)
SIZES = (1.5, 1.15)


@pytest.fixture(scope="module")
def part(tmp_path_factory):
    path = tmp_path_factory.mktemp("step") / "housing.step"
    write_step(cq.Assembly(housing_part(SMALL_HOUSING).shape, name="housing"), path)
    return named_housing(read_step(path), SMALL_HOUSING)


@pytest.mark.study
def test_stiffness_of_the_step_file_lies_inside_bar_and_spread(part):
    meshes = [tetrahedra(part, fine_boxes(SMALL_HOUSING, size), size) for size in SIZES]
    fine, coarse = (tip_compliance(flexure_mesh(SMALL_HOUSING, scale), *PETG) for scale in (1.0, 2.0))
    found = housing_stiffness(fine, coarse)
    reference = reference_stiffness(meshes, SIZES, *PETG)
    assert max(reference.spread_percent) < 1.0
    for i in (0, 1):
        apart = 100.0 * abs(found.K[i] / reference.K[i] - 1.0)
        assert apart < 100.0 * found.error[i] + reference.spread_percent[i]
        # Conforming elements that are integrated in full are too stiff, the less so the finer they are.
        assert reference.K_meshes[0][i] > reference.K_meshes[1][i] > reference.K[i]
