"""The stiffness of short leaves in curved tetrahedra, on the solid read back from its STEP file."""

import cadquery as cq
import pytest

from benchmarks.bars.truths import TRUTHS
from cad.files.step import read_step, write_step
from cad.parts.housing_solid import housing_part, named_housing
from reference.flexure_reference import SMALL_HOUSING, reference_stiffness
from reference.tetrahedra import fine_boxes, tetrahedra

PETG = (2000.0, 0.38)
SIZES = (1.5, 1.15)


@pytest.fixture(scope="module")
def part(tmp_path_factory):
    path = tmp_path_factory.mktemp("step") / "housing.step"
    write_step(cq.Assembly(housing_part(SMALL_HOUSING).shape, name="housing"), path)
    return named_housing(read_step(path), SMALL_HOUSING)


@pytest.mark.study
def test_truth_of_short_leaves_is_of_the_solid_of_their_step_file(part):
    """Within the spread of two meshes, which is not more than the error of the truth."""
    meshes = [tetrahedra(part, fine_boxes(SMALL_HOUSING, size), size) for size in SIZES]
    truth = TRUTHS["short leaves in PETG"]
    reference = reference_stiffness(meshes, SIZES, *PETG)
    for i in (0, 1):
        assert 1e-2 * reference.spread_percent[i] * reference.K[i] == pytest.approx(truth.errors[i], rel=0.1)
        assert reference.K[i] == pytest.approx(truth.values[i], abs=0.1 * truth.errors[i])
        # Conforming elements that are integrated in full are too stiff, the less so the finer they are.
        assert reference.K_meshes[0][i] > reference.K_meshes[1][i] > reference.K[i]
