"""Interpolated contact: the truth lies inside its bar, and where no interpolation is good there is none."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cad.quantity import InputError
from pipeline.study import interpolated_contact, read_study, run_study, tasks
from pipeline.study.interpolated_contact import drawn_points, fitted_contact, half_space_compliance, may_interpolate
from pipeline.study.points import Point, design_of
from pipeline.study.scenes import UnitScene, scene_compliance, unit_scene
from pipeline.study.store import stored_study
from pipeline.study.workers import Engine
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

Write = Callable[..., Path]

TEXT = """
base = "paper"
samples = 5000
seed = 1
wanted = ["contact.K_m_over_E_mm"]
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
    side = scene.tips.side_mm
    fruit = scene.fruit
    bend = 0.2 * np.exp(-side / fruit.height_mm) * side / fruit.height_mm * (1.0 + fruit.poisson**3)
    rough = roughness * np.sin(1e4 * fruit.height_mm)
    S = (half_space_compliance(scene) - bend * np.array([[1.0, 0.3], [0.3, 1.0]])) * (1.0 + rough) / side
    return FruitCompliance(S=S / scene.scale, error_pair=1e-4, error_own=2e-4, info=INFO)


def test_truth_lies_inside_the_bar(written: Write) -> None:
    study = read_study(written(TEXT))

    def solve(points: Sequence[Point]) -> list[FruitCompliance]:
        return [by_formula(unit_scene(design_of(study, point.settings))) for point in points]

    model = fitted_contact(study, solve)
    assert model is not None
    assert 0.0 < model.error <= 0.5 * study.tol
    for point in drawn_points(study, 256, 9):
        scene = unit_scene(design_of(study, point.settings))
        contact = model.compliance(scene, point.settings)
        assert contact.K_m_over_E() == pytest.approx(by_formula(scene).K_m_over_E(), rel=model.error)
        assert (contact.error_pair, contact.error_own) == pytest.approx((1e-4 + model.error, 2e-4 + model.error))


@pytest.mark.parametrize("roughness", [0.0, 0.01])
def test_study_interpolates_smooth_contact_once_and_audits_it(
    written: Write, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, roughness: float
) -> None:
    solved = []

    def solve(scene: UnitScene, _tolerance: float) -> FruitCompliance:
        solved.append(scene)
        return by_formula(scene, roughness)

    monkeypatch.setattr(tasks, "scene_compliance", solve)
    monkeypatch.setattr(interpolated_contact, "SCENES", (128,))
    study = replace(read_study(written(TEXT)), samples=64, contact="surrogate", audit=0.2)
    if roughness:
        with pytest.raises(InputError) as refused:
            run_study(study, tmp_path / "out", engine)
        assert refused.value.field == "contact"
        return
    summary = run_study(study, tmp_path / "out", engine)
    assert summary.done == 64
    with stored_study(tmp_path / "out") as store:
        audits = [row for row in store.rows() if row.audit is not None]
    assert 5 < len(audits) < 25
    assert len(solved) == summary.interpolation.solves + len(audits)
    for row in audits:
        (value,) = row.values.values()
        (audit,) = row.audit.values()
        assert value != audit
        assert value == pytest.approx(audit, rel=summary.interpolation.error)
    longer = run_study(replace(study, samples=70), tmp_path / "out", engine)  # goes on with the stored solves
    assert (longer.solved, longer.interpolation.error) == (6, summary.interpolation.error)


@pytest.mark.parametrize(
    ("old", "new", "may"),
    [
        ("seed", "seed", True),
        ("samples = 5000", "samples = 1999", False),
        ("samples = 5000", "samples = 2000", True),
        ("samples = 5000", 'samples = 5000\ncontact = "solve"', False),
        ("samples = 5000", 'samples = 100\ncontact = "surrogate"', True),
        ("contact.K_m_over_E_mm", "flexures.low.stiffness_N_per_m", None),
        ('"paper"', '"mango"', None),
        ("{ from = 0.2, to = 0.45 }", '{ mean = 0.3, sd = 0.02, source = "a table" }', None),
    ],
)
def test_when_contact_is_interpolated(written: Write, old: str, new: str, may: bool | None) -> None:
    """None: it cannot be, even where it is asked for."""
    text = TEXT.replace('"targets.P_max" = { from = 3, to = 8 }\n', "") if "mango" in new else TEXT
    study = read_study(written(text, **{old: new}))
    assert may_interpolate(study, study.samples) is bool(may)
    if may is None:
        with pytest.raises(InputError) as refused:
            may_interpolate(replace(study, contact="surrogate"), study.samples)
        assert refused.value.field == "contact"


@pytest.mark.slow
def test_solved_contact_is_interpolated_within_its_bar(written: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over height alone: the remainder of true solves is smooth, and scenes between the fitted ones agree."""
    monkeypatch.setattr(interpolated_contact, "SCENES", (16,))
    lines = [line for line in TEXT.splitlines() if not line.startswith(('"tips', '"fruit.poisson', '"targets'))]
    study = read_study(written("\n".join(lines)))

    def solve(points: Sequence[Point]) -> list[FruitCompliance]:
        return [scene_compliance(unit_scene(design_of(study, point.settings)), study.tol) for point in points]

    model = fitted_contact(study, solve)
    assert model is not None
    points = drawn_points(study, 8, 9)
    for point, contact in zip(points, solve(points), strict=True):
        K_m_over_E = model.compliance(unit_scene(design_of(study, point.settings)), point.settings).K_m_over_E()
        assert K_m_over_E == pytest.approx(contact.K_m_over_E(), rel=model.error)
