"""The proof that a candidate of a search passes: a whole run of its design, with springs fitted by finite elements."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from cad.files.export_error import ExportError
from mesh.session import MeshError
from pipeline import run
from pipeline.find.candidate import Candidate
from pipeline.options import RunOptions
from pipeline.result import SensorResult
from pipeline.storage.folder import OutputError
from sensor.design.parameters import Design
from sensor.quantity import InputError
from solve.linear import SolveError

UNSOLVED = (ExportError, InputError, MeshError, SolveError)
"""Exceptions raised for a design that is invalid or cannot be solved."""


@dataclass(frozen=True, kw_only=True)
class Proof:
    """The last candidate that was run, its result, and the number of runs up to and including this one.

    The result is None if the design of the candidate was invalid or could not be solved.
    """

    candidate: Candidate
    result: SensorResult | None
    runs: int

    @property
    def passed(self) -> bool | None:
        """Return whether all verdicts passed; None if one is undecided and none failed."""
        return False if self.result is None else self.result.passed


def prove_first(
    candidates: Iterable[Candidate],
    make_design: Callable[[Candidate], Design],
    options: RunOptions,
    max_runs: int,
    next_candidates: Callable[[Proof], list[Candidate]] = lambda _: [],
) -> Proof | None:
    """Run up to `max_runs` candidates one after another until one passes, and return the last run.

    `make_design` returns the design of a candidate, and each run has the same `options`. If a run does not pass,
    `next_candidates` may derive further candidates from it, which are run next. A candidate whose design is invalid or
    cannot be solved has not passed. Returns None if there are no candidates. Raises OutputError if the output folder
    cannot be used.
    """
    waiting = list(candidates)
    proof = None
    for runs in range(1, max_runs + 1):  # the number of runs, including this one
        if not waiting:
            break
        candidate = waiting.pop(0)
        result = None
        try:
            result = run(make_design(candidate), options)
        except OutputError:
            # OutputError is a subclass of InputError, but a different candidate would not make the folder usable.
            raise
        except UNSOLVED:
            pass  # the result remains None
        proof = Proof(candidate=candidate, result=result, runs=runs)
        if proof.passed:
            break
        waiting = [*next_candidates(proof), *waiting]
    return proof
