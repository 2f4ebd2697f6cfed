"""A constant of the product beside what a script of this folder measures for it."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A constant, what was measured for it, and the least and the largest constant that this allows [same unit]."""

    name: str
    constant: float
    measured: tuple[float, ...]
    least: float
    largest: float

    @property
    def holds(self) -> bool:
        return self.least <= self.constant <= self.largest

    def __str__(self) -> str:
        values = " ".join(f"{value:.3g}" for value in self.measured)
        verdict = "holds" if self.holds else "DOES NOT HOLD"
        return f"{self.name}: {self.constant:.4g} {verdict}: {self.least:.3g} to {self.largest:.3g}; measured {values}"


def covering(name: str, constant: float, seen: Sequence[float], spare: float = 3.0) -> Comparison:
    """Compare a safety share with what it must cover: the largest seen, and at most `spare` times it."""
    largest = float(max(seen))
    return Comparison(
        name=name, constant=constant, measured=tuple(map(float, seen)), least=largest, largest=spare * largest
    )


def fitted(name: str, constant: float, value: float, scatter: float) -> Comparison:
    """Compare a fitted number with the value that a fit gives now, within its scatter [unit of the value]."""
    return Comparison(
        name=name, constant=constant, measured=(float(value),), least=value - scatter, largest=value + scatter
    )
