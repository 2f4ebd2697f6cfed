"""What a hard case claims and how it ends: a right answer inside its error bar, a refusal with its cause, or wrong."""

import math
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from cad.quantity import InputError
from mesh.session import MeshError
from pipeline.bench.table import percent
from solve.fruit.split import SplitDomainError
from solve.linear import SolveError

Verdict = Literal["right", "refused", "WRONG"]

WIDEST_BAR = 0.1  # of the value: beyond, the answer tells nothing
REFUSALS = (InputError, MeshError, SolveError, SplitDomainError)
# Whatever else a stage may raise: the suite reports it as wrong and goes on.
_CRASHES = (
    ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, TypeError, ValueError, Warning,
)  # fmt: skip


class DeclinedError(InputError):
    """A scene that a stage declines by a failed verdict; the message is the verdict's reason."""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A value with its error bar and a reference with its uncertainty, all in one unit; `by` says whence the latter."""

    name: str
    value: float
    bar: float
    reference: float
    uncertainty: float
    by: str

    @property
    def excess(self) -> float:
        """Return the distance to the reference over what bar and uncertainty allow; more than 1 is wrong."""
        allowed = self.bar + self.uncertainty
        return abs(self.value - self.reference) / allowed if allowed > 0.0 else math.inf

    @property
    def fault(self) -> str:
        """Return what is wrong with the claim, or nothing."""
        if not all(math.isfinite(one) for one in (self.value, self.bar, self.reference, self.uncertainty)):
            return f"{self.name} or its bar is not a finite number"
        if self.bar <= 0.0:
            return f"the error bar of {self.name} is {self.bar:g}"
        if self.bar > WIDEST_BAR * abs(self.value):
            return f"the error bar of {self.name} is {percent(self.bar / abs(self.value))[1:]} wide"
        if self.excess > 1.0:
            return f"{self.name} is off by {self.excess:.2g} times what its bar allows"
        return ""


@dataclass(frozen=True, kw_only=True)
class HardCase:
    """A hard case: its group, what is hard about it, and how its claims are made.

    `answerable` says that it lies where the product promises an answer: a refusal is then wrong.
    """

    group: str
    what: str
    claims: Callable[[], Sequence[Claim]]
    answerable: bool = False


@dataclass(frozen=True, kw_only=True)
class Ending:
    """How a case ended: verdict, words, and the claim nearest to its limit where there is one."""

    group: str
    what: str
    verdict: Verdict
    words: str
    claim: Claim | None = None


def settle(case: HardCase) -> Ending:
    """Return how a case ends; a warning counts as a crash, and a refusal must be one line that names a bound."""

    def ended(verdict: Verdict, words: str, claim: Claim | None = None) -> Ending:
        return Ending(group=case.group, what=case.what, verdict=verdict, words=words, claim=claim)

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", DeprecationWarning)
            claims = case.claims()
    except REFUSALS as refusal:
        words = str(refusal)
        if case.answerable:
            return ended("WRONG", f"refused, where an answer is promised: {words}")
        clear = (
            words.strip() and "\n" not in words and ("must" in words or isinstance(refusal, MeshError | DeclinedError))
        )
        return ended("refused" if clear else "WRONG", words if clear else f"unclear refusal {words!r}")
    except _CRASHES as crash:
        place = traceback.extract_tb(crash.__traceback__)[-1]
        return ended("WRONG", f"{type(crash).__name__} in {Path(place.filename).name}:{place.lineno}: {crash}")
    if not claims:
        return ended("WRONG", "neither an answer nor a refusal")
    worst = max(claims, key=lambda claim: (bool(claim.fault), claim.excess))
    return ended("WRONG" if worst.fault else "right", worst.fault or worst.by, worst)
