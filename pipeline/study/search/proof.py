"""The best candidate of a search, run in full: the contact alone does not decide."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.design.design_file import design_as_toml
from pipeline import run
from pipeline.options import RunOptions
from pipeline.study.search.optimum import Candidate, design_of_candidate
from pipeline.study.study_file import Study

MOST_RUNS = 5


@dataclass(frozen=True, kw_only=True)
class Proof:
    """A candidate, its design file, and whether all verdicts of its run passed; None where one is undecided."""

    candidate: Candidate
    design: Path
    passed: bool | None


def prove(study: Study, candidates: Sequence[Candidate], folder: Path) -> Proof | None:
    """Return the first of the best five candidates whose run passes all verdicts, else the best; None without any.

    Its design file is `design.toml` in the folder, the outputs of its run are in `best`. Raises as a run.
    """
    possible = [one for one in candidates if one.violation == 0.0][:MOST_RUNS]
    proofs = []
    for one in possible:
        proofs.append(_proved(study, one, folder))
        if proofs[-1].passed:
            return proofs[-1]
    return _proved(study, possible[0], folder) if possible else None


def _proved(study: Study, found: Candidate, folder: Path) -> Proof:
    design, path = design_of_candidate(study, found, study.name), folder / "design.toml"
    path.write_text(design_as_toml(design), encoding="utf-8")
    result = run(design, RunOptions(out=folder / "best", tolerance=study.tol))
    return Proof(candidate=found, design=path, passed=result.passed)
