"""Springs of a design: a leaf that the law rules out is not solved, a fit that fails leaves all undecided."""

import numpy as np
import pytest
from stand_ins import PETG, housing_stiffness, sizing_of

import pipeline.stages.springs
from cad.design.parameters import Design, Print
from cad.design.tips import Tips
from cad.quantity import InputError
from mesh.session import MeshError
from pipeline.fit.leaf_lengths import FittedHousing
from pipeline.options import RunOptions
from pipeline.stages.springs import fit_springs
from solve.linear import SolveError


@pytest.fixture
def fit(tmp_path, monkeypatch):
    """Return what a stand-in for the fit was asked for; `error` raises, else springs are the targets but softer."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    class Fit:
        def __init__(self):
            self.asked, self.error = [], None

        def __call__(self, guess, targets, *material):
            self.asked.append((targets, *material))
            if self.error is not None:
                raise self.error
            stiffness = housing_stiffness(tuple(0.999 * K for K in targets), strain_per_N=(2e-3, 1e-4))
            return FittedHousing(housing=guess, stiffness=stiffness, solves=(1, 1), seconds={})

    stand_in = Fit()
    monkeypatch.setattr(pipeline.stages.springs, "fit_with_pins", stand_in)
    return stand_in


def springs_of(design, options=None):
    return fit_springs(design, sizing_of(design), options or RunOptions())


def test_springs_are_fitted_to_the_targets_of_the_sizing_in_the_material_of_the_process(fit):
    springs = springs_of(Design(), RunOptions(tolerance=0.02))
    targets = sizing_of(Design()).springs.stiffnesses
    assert fit.asked == [(targets, PETG.E_MPa, PETG.poisson, 0.02)]
    assert [spring.name for spring in springs.springs] == ["low", "high"]
    assert [spring.target for spring in springs.springs] == list(targets)
    assert springs.stiffnesses.stiffnesses == pytest.approx([0.999 * K for K in targets])
    assert np.diag(springs.C) == pytest.approx([1.0 / (0.999 * K) for K in targets])
    assert springs.housing is not None


def test_root_strain_is_that_of_the_force_at_full_travel(fit):
    """K d times the strain per newton, over which the limit is the safety factor."""
    springs = springs_of(Design())
    for spring, d, per_N in zip(springs.springs, springs.deflections, (2e-3, 1e-4), strict=True):
        assert spring.root_strain.value == pytest.approx(spring.K.value * d * per_N)
        assert spring.root_strain.relative == pytest.approx(0.01)
        assert spring.safety_factor == pytest.approx(spring.printable.strain_limit / spring.root_strain.value)
    assert len(fit.asked) == 1


def test_same_springs_are_not_fitted_again(fit):
    first, second = springs_of(Design()), springs_of(Design(name="other"))
    assert len(fit.asked) == 1
    assert second.housing == first.housing


def test_leaf_that_the_law_rules_out_is_not_solved(fit):
    springs = springs_of(Design(print=Print(max_length_mm=20.0)))
    assert fit.asked == []
    assert [spring.printable.passed for spring in springs.springs] == [False, True]
    assert (springs.housing, springs.monolithic, springs.errors) == (None, True, (0.0, 0.0))
    targets = [spring.target for spring in springs.springs]
    assert np.diag(springs.C) == pytest.approx([1.0 / K for K in targets])
    assert [(spring.K, spring.safety_factor) for spring in springs.springs] == [(None, None)] * 2


@pytest.mark.parametrize(
    "error",
    [InputError("leaf too short"), MeshError("generate", "no room", "take smaller elements"), SolveError("residual 1")],
    ids=["input", "mesh", "solve"],
)
def test_fit_that_fails_leaves_all_undecided_with_its_reason(error, fit):
    fit.error = error
    springs = springs_of(Design())
    assert [(s.printable.passed, s.printable.reason) for s in springs.springs] == [(None, str(error))] * 2
    assert springs.housing is None


def test_bug_in_the_fit_is_not_hidden(fit):
    fit.error = TypeError("a bug")
    with pytest.raises(TypeError, match="a bug"):
        springs_of(Design())


@pytest.mark.usefixtures("fit")
@pytest.mark.parametrize("design", [Design(print=Print(gauges="foil")), Design(tips=Tips(socket="pin"))])
def test_springs_with_gauges_or_pins_are_not_of_one_piece(design):
    assert springs_of(Design()).monolithic is True
    assert springs_of(design).monolithic is False
