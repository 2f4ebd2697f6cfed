"""The proof of a search: no candidate is run twice, and design.toml is written once, for a run that passes."""

from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cad.quantity import InputError
from pipeline.options import load_design
from pipeline.study import read_study
from pipeline.study.search import proof
from pipeline.study.search.optimum import Candidate
from pipeline.study.tasks import PointResult

TEXT = """
base = "paper"
[vary]
"targets.P_max" = { from = 3, to = 8 }
[optimise]
minimise = "springs.K_h_N_per_m"
under = ["P_max"]
"""
P_MAX = (4.0, 5.0, 6.0)


def candidates() -> list[Candidate]:
    return [
        Candidate(
            result=PointResult(
                number=number, settings={"targets.P_max": P_max}, status="done", values={}, error=None, seconds=0.0
            ),
            value=P_max,
            violation=0.0,
        )
        for number, P_max in enumerate(P_MAX)
    ]


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Callable[[Sequence[bool]], list[float]]:
    """Put verdicts in the place of runs; return P_max of the designs that were run."""

    def stand_in(passed: Sequence[bool]) -> list[float]:
        seen: list[float] = []

        def run(design: Any, _options: Any) -> SimpleNamespace:
            seen.append(design.nominal_targets.P_max)
            return SimpleNamespace(passed=passed[len(seen) - 1])

        monkeypatch.setattr(proof, "run", run)
        return seen

    return stand_in


def test_design_of_the_first_run_that_passes_is_written(
    written: Callable[..., Path], tmp_path: Path, runs: Callable[[Sequence[bool]], list[float]]
) -> None:
    study, seen = read_study(written(TEXT)), runs((False, True))
    found = proof.prove(study, candidates(), tmp_path)
    assert found is not None
    assert seen == [4.0, 5.0]
    assert found.design == tmp_path / "design.toml"
    assert load_design(found.design).nominal_targets.P_max == 5.0


def test_nothing_is_run_again_and_no_design_is_left_where_no_run_passes(
    written: Callable[..., Path], tmp_path: Path, runs: Callable[[Sequence[bool]], list[float]]
) -> None:
    study = read_study(written(TEXT))
    runs((True,))
    proof.prove(study, candidates(), tmp_path)  # of a shorter search
    seen = runs((False, False, False))
    found = proof.prove(study, candidates(), tmp_path)
    assert found is not None
    assert (seen, found.passed, found.design) == ([*P_MAX], False, None)
    assert not (tmp_path / "design.toml").exists()


def test_design_of_a_person_is_kept(
    written: Callable[..., Path], tmp_path: Path, runs: Callable[[Sequence[bool]], list[float]]
) -> None:
    (tmp_path / "design.toml").write_text("mine", encoding="utf-8")
    study = read_study(written(TEXT))
    with pytest.raises(InputError, match="--force"):
        proof.refuse_occupied(tmp_path)
    runs((True,))
    with pytest.raises(InputError, match="--force"):
        proof.prove(study, candidates(), tmp_path)
    assert (tmp_path / "design.toml").read_text(encoding="utf-8") == "mine"
    runs((True,))
    proof.prove(study, candidates(), tmp_path, force=True)
    assert (tmp_path / "design.toml.bak").read_text(encoding="utf-8") == "mine"
