"""The best candidate of a search, run in full: the contact alone does not decide."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cad.design.design_file import design_as_toml
from pipeline import run
from pipeline.options import RunOptions
from pipeline.storage.files import is_ours, place_files, refuse_taken
from pipeline.storage.folder import refuse_unusable
from pipeline.study.search.optimum import Candidate, design_of_candidate
from pipeline.study.search.pareto import PLOT
from pipeline.study.study_file import Study

MOST_RUNS = 5
DESIGN, RUN = "design.toml", "best"


@dataclass(frozen=True, kw_only=True)
class Proof:
    """A candidate that was run, whether all verdicts passed, None where one is undecided, and its file if they did."""

    candidate: Candidate
    design: Path | None
    passed: bool | None


def refuse_occupied(folder: Path, *, force: bool = False) -> None:
    """Raise InputError where a search could not write its answer into its folder, before anything is solved."""
    refuse_unusable(folder / RUN, force=force)
    if not force:
        refuse_taken(folder, (DESIGN, PLOT), "--out")


def prove(study: Study, candidates: Sequence[Candidate], folder: Path, *, force: bool = False) -> Proof | None:
    """Return the first of the best five candidates whose run passes all verdicts, else the last that was run.

    The outputs of its run are in `best`, and where it passes, its design file is `design.toml` in the folder. None
    where no candidate passes the verdicts of the search. Raises as a run, and InputError where a foreign file is there
    and `force` does not keep it as NAME.bak.
    """
    proof = None
    for one in [one for one in candidates if one.violation == 0.0][:MOST_RUNS]:
        design = design_of_candidate(study, one, study.name)
        passed = run(design, RunOptions(out=folder / RUN, tolerance=study.tol, force=force)).passed
        proof = Proof(candidate=one, design=None, passed=passed)
        if passed:
            (path,) = place_files(folder, {DESIGN: design_as_toml(design).encode()}, "--out", force=force)
            return replace(proof, design=path)
    if is_ours(folder / DESIGN):  # that of a shorter search, and `best` no longer holds its run
        (folder / DESIGN).unlink()
    return proof
