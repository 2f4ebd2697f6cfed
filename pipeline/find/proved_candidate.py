"""The proof of a candidate: its design passes all verdicts of a whole run."""

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


@dataclass(frozen=True, kw_only=True)
class Proof:
    """A candidate that was run, its result (None if the run refused or failed to solve it), and the number of runs."""

    candidate: Candidate
    result: SensorResult | None
    runs: int

    @property
    def passed(self) -> bool | None:
        """Return whether all verdicts passed; None if one is undecided and none failed."""
        return False if self.result is None else self.result.passed


def first_proved(
    candidates: Iterable[Candidate],
    design_of: Callable[[Candidate], Design],
    options: RunOptions,
    most_runs: int,
    mended: Callable[[Proof], list[Candidate]] = lambda _: [],
) -> Proof | None:
    """Return the first candidate whose run passes, or else the last one that was run; None without candidates.

    If a run fails, the candidates that `mended` derives from it are run next. Raises OutputError for an unusable
    folder.
    """
    waiting = list(candidates)
    proof = None
    for runs in range(1, most_runs + 1):
        if not waiting:
            break
        candidate = waiting.pop(0)
        result = None
        try:
            result = run(design_of(candidate), options)
        except OutputError:
            # OutputError is an InputError, but a folder is not a candidate's fault.
            raise
        except UNSOLVED:
            pass
        proof = Proof(candidate=candidate, result=result, runs=runs)
        if proof.passed:
            break
        waiting = [*mended(proof), *waiting]
    return proof
