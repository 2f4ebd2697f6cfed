"""The polynomial that stands for contact: the truth lies inside its bar, and where none is good there is none."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from cad.quantity import InputError
from pipeline.study import Study, read_study
from pipeline.study.levels.contact_surrogate import half_space
from pipeline.study.levels.surrogate_fit import coordinates, drawn_scenes, fitted_surrogate, may_interpolate
from pipeline.study.levels.unit_scene import UnitScene, scene_compliance
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

TEXT = """
base = "paper"
samples = 5000
seed = 1
wanted = ["springs.K_l_N_per_m"]
[vary]
"tips.side_mm" = { from = 0.8, to = 1.6 }
"tips.spacing_mm" = { from = 4, to = 10 }
"fruit.height_mm" = { from = 8, to = 20 }
"fruit.poisson" = { from = 0.2, to = 0.45 }
"targets.P_max" = { from = 3, to = 8 }
"""
INFO = SolveInfo(method="formula", dofs=0, seconds=0.0, status="a formula of this test")


def by_formula(scene: UnitScene, roughness: float = 0.0) -> FruitCompliance:
    """Return the half-space and a smooth remainder that falls with height and grows with Poisson's ratio."""
    side, fruit = scene.tips.side_mm, scene.fruit
    bend = 0.2 * np.exp(-side / fruit.height_mm) * side / fruit.height_mm * (1.0 + fruit.poisson**3)
    rough = roughness * np.sin(1e4 * fruit.height_mm)
    S = (half_space(scene) - bend * np.array([[1.0, 0.3], [0.3, 1.0]])) * (1.0 + rough) / side
    return FruitCompliance(S=S / scene.scale, error_pair=1e-4, error_own=1e-4, info=INFO)


def fitted(study: Study, roughness: float = 0.0):
    def solve(scenes: Sequence[UnitScene]) -> list[FruitCompliance]:
        return [by_formula(scene, roughness) for scene in scenes]

    return fitted_surrogate(study, solve)


def test_truth_lies_inside_the_bar(written: Callable[..., Path]) -> None:
    study = read_study(written(TEXT))
    model = fitted(study)
    assert model is not None
    assert model.error <= study.tol
    for scene in drawn_scenes(study, 256, 9):
        found, truth = model.compliance(scene), by_formula(scene)
        assert found.K_m_over_E() == pytest.approx(truth.K_m_over_E(), rel=model.error)
        assert found.error_pair == pytest.approx(1e-4 + model.error)


def test_rough_contact_has_no_polynomial(written: Callable[..., Path]) -> None:
    assert fitted(read_study(written(TEXT)), roughness=0.01) is None


def test_scale_costs_no_coordinate(written: Callable[..., Path]) -> None:
    """Three lengths that vary beside fixed ones have three ratios; five lengths that all vary have four."""
    assert coordinates(read_study(written(TEXT))) == ("height / length", "spacing / length", "side / height", "poisson")
    free = '"fruit.length_mm" = { from = 18, to = 22 }\n"fruit.width_mm" = { from = 18, to = 22 }\n"targets.P_max"'
    names = coordinates(read_study(written(TEXT, **{'"targets.P_max"': free})))
    assert names == ("height / length", "spacing / length", "width / length", "side / height", "poisson")


@pytest.mark.parametrize(
    ("old", "new", "may"),
    [
        ("seed", "seed", True),
        ("samples = 5000", "samples = 100", False),
        ("samples = 5000", 'samples = 5000\ncontact = "solve"', False),
        ("samples = 5000", 'samples = 100\ncontact = "surrogate"', True),
        ("springs.K_l_N_per_m", "flexures.low.stiffness_N_per_m", False),
        ('"paper"', '"mango"', False),
        ("{ from = 0.2, to = 0.45 }", '{ mean = 0.3, sd = 0.02, source = "a table" }', False),
    ],
)
def test_when_a_polynomial_may_stand(written: Callable[..., Path], old: str, new: str, may: bool) -> None:
    text = TEXT.replace('"targets.P_max" = { from = 3, to = 8 }\n', "") if "mango" in new else TEXT
    study = read_study(written(text, **{old: new}))
    assert may_interpolate(study, study.samples) is may


def test_polynomial_that_cannot_be_is_refused(written: Callable[..., Path]) -> None:
    text = TEXT.replace("samples = 5000", 'samples = 100\ncontact = "surrogate"').replace('"paper"', '"mango"')
    study = read_study(written(text.replace('"targets.P_max" = { from = 3, to = 8 }\n', "")))
    with pytest.raises(InputError, match="no block or the tips are not flat"):
        may_interpolate(study, 100)


@pytest.mark.slow
def test_solved_contact_has_a_polynomial(written: Callable[..., Path]) -> None:
    """Over height alone: the remainder of true solves is smooth, and scenes between the fitted ones agree."""
    lines = [line for line in TEXT.splitlines() if not line.startswith(('"tips', '"fruit.poisson'))]
    study = read_study(written("\n".join(lines)))
    model = fitted_surrogate(study, lambda scenes: [scene_compliance(scene, study.tol) for scene in scenes])
    assert model is not None
    for scene in drawn_scenes(study, 8, 9):
        solved = scene_compliance(scene, study.tol)
        assert model.compliance(scene).K_m_over_E() == pytest.approx(solved.K_m_over_E(), rel=model.error)
