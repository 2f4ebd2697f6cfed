"""Hard cases: values of the product, each with its error bar, held against a reference; and how a case ends."""

import math
import traceback
import warnings
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from benchmarks.harness import Reference, percent
from cad.quantity import InputError
from mesh.session import MeshError
from solve.fruit.split import SplitDomainError
from solve.linear import SolveError

Verdict = Literal["right", "refused", "no reference", "WRONG"]

WIDEST_ERROR = 0.1  # of the value: beyond, the answer tells nothing
REFUSALS = (InputError, MeshError, SolveError, SplitDomainError)


@dataclass(frozen=True, kw_only=True)
class ReferenceCheck:
    """A value with its error bar and a reference with its own, all in one unit; `source` says who judges.

    `reference` is None where the computation that should judge refused; `source` is then the reason.
    """

    name: str
    value: float
    error: float
    reference: float | None
    reference_error: float
    source: str

    @property
    def relative_error(self) -> float:
        """Return the error bar over the value [1]; infinite for a value of 0."""
        return self.error / abs(self.value) if self.value else math.inf

    @property
    def excess(self) -> float:
        """Return the distance to the reference over what both error bars allow [1]: more than 1 is wrong."""
        if self.reference is None:
            return 0.0
        allowed = self.error + self.reference_error
        return abs(self.value - self.reference) / allowed if allowed > 0.0 else math.inf

    @property
    def fault(self) -> str:
        """Return what is wrong with the value, or nothing."""
        if not all(map(math.isfinite, (self.value, self.error, self.reference or 0.0, self.reference_error))):
            return f"{self.name} or its bar is not a finite number"
        if self.error <= 0.0:
            return f"the error bar of {self.name} is {self.error:g}"
        if self.relative_error > WIDEST_ERROR:
            return f"the error bar of {self.name} is {percent(self.relative_error)} wide"
        if self.excess > 1.0:
            return f"{self.name} is off by {self.excess:.2g} times what its bar allows"
        return ""


@dataclass(frozen=True, kw_only=True)
class HardCase:
    """A hard case: its name, and the work that ends in its checks.

    `answerable` says that it lies where the product promises an answer: a refusal is then wrong.
    """

    name: str
    work: Callable[[], Sequence[ReferenceCheck]]
    answerable: bool = False


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a case ended: verdict, who judged or why not, and the check nearest to its limit where there is one."""

    case: str
    verdict: Verdict
    reason: str
    check: ReferenceCheck | None = None


def checks(
    names: Sequence[str], values: Iterable[float], relative_errors: Sequence[float], reference: Reference
) -> tuple[ReferenceCheck, ...]:
    """Return a check of each value of the product, in the unit of the reference; error bars are relative [1]."""
    trues = reference.values or (None,) * len(names)
    uncertainties = reference.errors or (0.0,) * len(names)
    columns = zip(names, values, relative_errors, trues, uncertainties, strict=True)
    return tuple(
        ReferenceCheck(
            name=name,
            value=float(value),
            error=error * abs(float(value)),
            reference=true,
            reference_error=uncertainty,
            source=reference.source,
        )
        for name, value, error, true, uncertainty in columns
    )


def attempted(compute: Callable[[], Reference]) -> Reference:
    """Return what a computation says should come out; one without values where it refuses, with its reason."""
    try:
        return compute()
    except REFUSALS as refusal:
        return Reference(values=(), errors=(), source=f"the reference refused: {refusal}")


def evaluate(case: HardCase) -> Outcome:
    """Return how a case ends; a warning counts as a crash, and a refusal must be one line that names a bound.

    The case runs in a thread, whose future hands over whatever was raised: no list of exceptions would be complete.
    """
    with ThreadPoolExecutor(max_workers=1) as thread:
        future = thread.submit(_work_without_warnings, case)
    error = future.exception()
    if error is None:
        return _judged(case.name, future.result())
    reason = " ".join(str(error).split())
    if not isinstance(error, REFUSALS):
        place = traceback.extract_tb(error.__traceback__)[-1]
        reason = f"{type(error).__name__} in {Path(place.filename).name}:{place.lineno}: {reason}"
    elif case.answerable:
        reason = f"refused, where an answer is promised: {reason}"
    elif "\n" in str(error) or not ("must" in reason or isinstance(error, MeshError)):
        reason = f"unclear refusal {str(error)!r}"
    else:
        return Outcome(case=case.name, verdict="refused", reason=reason)
    return Outcome(case=case.name, verdict="WRONG", reason=reason)


def _work_without_warnings(case: HardCase) -> Sequence[ReferenceCheck]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", DeprecationWarning)
        return case.work()


def _judged(case: str, every: Sequence[ReferenceCheck]) -> Outcome:
    if not every:
        return Outcome(case=case, verdict="WRONG", reason="neither an answer nor a refusal")
    worst = max(every, key=lambda check: (bool(check.fault), check.reference is None, check.excess))
    if worst.fault:
        return Outcome(case=case, verdict="WRONG", reason=worst.fault, check=worst)
    verdict: Verdict = "no reference" if worst.reference is None else "right"
    return Outcome(case=case, verdict=verdict, reason=worst.source, check=worst)
