"""The nearest design that passes: searched with ideal springs, proved by whole runs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from cad.design.parameters import Design
from cad.files.export_error import ExportError
from cad.quantity import InputError
from cad.verdict import Verdict
from mesh.session import MeshError
from pipeline import run
from pipeline.options import RunOptions
from pipeline.result import SensorResult
from pipeline.storage.announcement import announce
from pipeline.verdicts.remedies.changes import Changes, changed, in_digits
from pipeline.verdicts.remedies.own import own_remedy, own_travel
from pipeline.verdicts.remedies.search import Search, nearest_passing
from pipeline.verdicts.remedies.sentences import sentence
from pipeline.verdicts.remedies.trial import Trials
from solve.linear import SolveError

BUDGET = 6000  # hundredths of a processor second for trials
MOST_RUNS = 4  # that prove a candidate; each costs some ten seconds
_TRAVEL = "press.travel_mm"


@dataclass(frozen=True, kw_only=True)
class Suggestion:
    """What makes a design pass: no changes where it passes as it is, None where nothing was found.

    `verdicts` are those of the run that proves it, or of the design's own run. `reason` says in words what was found.
    `tried` counts the trials, `runs` the whole runs.
    """

    design: Design
    changes: Changes | None
    verdicts: tuple[Verdict, ...]
    reason: str
    tried: int = 0
    runs: int = 1

    @property
    def changed(self) -> Design:
        """Return the design with its changes."""
        return changed(self.design, self.changes or {})


def suggestion(design: Design, options: RunOptions, fixed: frozenset[str] = frozenset()) -> Suggestion:
    """Return the nearest design that a run shows to pass, without changing the keys that are `fixed`.

    Raises as `run` where the design itself cannot be run.
    """
    announce("runs the design as it is")
    options = replace(options, out=None)
    result = run(design, options)
    if result.passed:
        return Suggestion(design=design, changes={}, verdicts=result.verdicts, reason="passes as it is")
    wrong = [verdict for verdict in result.verdicts if verdict.passed is not True]
    told = [own_remedy(verdict, design, result.springs, options) for verdict in wrong]
    if all(remedy is not None and remedy.endswith("would decide") for remedy in told):
        return Suggestion(design=design, changes=None, verdicts=result.verdicts, reason=str(told[0]))
    announce("tries changes with ideal springs")
    trials = Trials(BUDGET, result.press.ahead)
    trials.remember(design, result.contact)
    search = nearest_passing(design, [verdict.name for verdict in wrong], trials, fixed)
    return _proved(result, search, tuple(_travels(result, fixed)), options)


def _travels(result: SensorResult, fixed: frozenset[str]) -> Iterator[Changes]:
    """Yield the shorter travel that solved strains and clearances ask for, where it is not fixed."""
    asked = [own_travel(v, result.design, result.springs) for v in result.verdicts if v.passed is not True]
    travels = [travel for travel in asked if travel is not None]
    if travels and _TRAVEL not in fixed:
        yield {_TRAVEL: min(travels)}


def _proved(result: SensorResult, search: Search, first: Sequence[Changes], options: RunOptions) -> Suggestion:
    """Return the first candidate that a run shows to pass; one that its own solve refutes is tried with less travel."""
    design, runs = result.design, 1
    open_ = [*first, *(candidate.changes for candidate in search.passing)]
    while open_ and runs <= MOST_RUNS:
        changes = open_.pop(0)
        announce(f"runs the candidate with {in_digits(changes)}")
        proof, runs = _run(changed(design, changes), options), runs + 1
        if proof is not None and proof.passed:
            return Suggestion(
                design=design,
                changes=changes,
                verdicts=proof.verdicts,
                reason=f"passes, as a whole run shows: {len(proof.verdicts)} verdicts",
                tried=search.count,
                runs=runs,
            )
        if proof is not None:
            open_[:0] = [{**changes, **less} for less in _travels(proof, frozenset(changes))]
    reason = sentence(design, search)
    if search.passing:
        reason = f"none found: what passes with ideal springs, {in_digits(search.passing[0].changes)}, fails its run"
    return Suggestion(
        design=design, changes=None, verdicts=result.verdicts, reason=reason, tried=search.count, runs=runs
    )


def _run(design: Design, options: RunOptions) -> SensorResult | None:
    """Return the result of a candidate; None where it cannot be run."""
    try:
        return run(design, options)
    except (ExportError, InputError, MeshError, SolveError):
        return None
