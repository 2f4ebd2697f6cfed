"""Whether a report agrees with itself: a number or a verdict that somebody changed no longer follows from the rest."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from cad.design.parameters import Design
from cad.parts.housing import Housing
from cad.verdict import Verdict, equal, failed
from pipeline.report.check.agreement_of_readings import other_readings
from pipeline.report.check.recomputed import Recomputed, expected_verdicts, recomputed
from pipeline.report.mapping import FORCE_KEYS, SIZED_KEYS, STIFFNESS_VERDICTS
from pipeline.report.verdict_rule import outcome_of
from pipeline.springs.fitted_spring import FittedSpring
from pipeline.springs.fitted_springs import NAMES
from pipeline.storage.plain import ROUND_OFF, Plain, from_plain, number_at, same_number, value_at
from pipeline.storage.seal import KEY, content_digest
from pipeline.verdicts.rules import READING_VERDICTS
from pipeline.verdicts.sensor import paper_verdicts
from solve.arrays import Floats
from solve.contact.linear_response import linear_response

_PAIR = 2
_NEEDED = (
    "P_max",
    "NL",
    *STIFFNESS_VERDICTS,
    "P_displacement_independent",
    "P_monotonic",
    *(f"printable.{name}" for name in NAMES),
)
_NUMBERS = "numbers that do not follow from others of the report"
_OUTCOMES = "verdicts that do not follow from the numbers of the report, or are missing"


@dataclass(frozen=True, kw_only=True)
class StoredForces:
    """The response at one modulus E [MPa] over the travel [mm]: forces [N], their ratio [1], its error [%]."""

    E_MPa: float
    x_mm: tuple[float, ...]
    F_l_N: tuple[float | None, ...]
    F_h_N: tuple[float | None, ...]
    P: tuple[float | None, ...]
    P_error_percent: tuple[float | None, ...]

    def __post_init__(self) -> None:
        """Refuse columns of other lengths than the travel."""
        if any(len(getattr(self, item.name)) != len(self.x_mm) for item in fields(self)[1:]):
            msg = "columns of the response: must have one number for each travel"
            raise ValueError(msg)

    @property
    def forces(self) -> Floats:
        """Return the forces of both kinds of tips, shape (2 kinds, travels) [N]; nan where there is none."""
        return np.array([self.F_l_N, self.F_h_N], dtype=np.float64)

    def ends_at(self, P: float, error: float) -> bool:
        """Say whether the ratio at full travel is P within its own error and that of P [1]."""
        last, percent = self.P[-1], self.P_error_percent[-1]
        return last is not None and percent is not None and abs(P - last) <= 0.01 * percent * last + error


def report_verdicts(report: Plain, design: Design, housing: Housing | None) -> tuple[Verdict, ...]:
    """Return report.digest, report.numbers and report.verdicts: how many places disagree with the rest [1].

    Raises ValueError that names a key which is missing or of another kind.
    """
    stored = from_plain(tuple[Verdict, ...], value_at(report, "verdicts"), "verdicts")
    lost = float(report.get(KEY) != content_digest(report))
    digest = equal(
        "report.digest", lost, 0.0, 0.0, unit="1", reference="report.json is as the run wrote it, but for its digest"
    )
    by_themselves = [*_missing(stored, design), *other_readings(report, design, stored), *_wrong_outcomes(stored)]
    if len(value_at(report, "contact.compliance_per_mm")) != _PAIR:
        return digest, _count("report.verdicts", _OUTCOMES, by_themselves)
    try:
        found = recomputed(report, design, housing)
        rows = _rows(report)
        numbers = [*_other_numbers(report, found), *_other_response(rows, found)]
        outcomes = [*_other_verdicts(stored, rows, found), *_other_of_paper(report, found)]
    except (ArithmeticError, ValueError) as error:
        reason = f"no springs and no fruit have these numbers ({error})"
        return digest, failed("report.numbers", 0.0, unit="1", reference=reason)
    found_wrong = _count("report.verdicts", _OUTCOMES, [*by_themselves, *outcomes])
    return digest, _count("report.numbers", _NUMBERS, numbers), found_wrong


def _count(name: str, what: str, places: Sequence[str]) -> Verdict:
    different = list(dict.fromkeys(places))
    more = f" and {len(different) - 3} more" if len(different) > 3 else ""  # noqa: PLR2004 - what fits a line
    reference = f"{what}: {', '.join(different[:3]) or 'none'}{more}"
    return equal(name, float(len(different)), 0.0, 0.0, unit="1", reference=reference)


def _other_numbers(report: Plain, found: Recomputed) -> Iterator[str]:
    """Yield the keys of numbers that are not what follows from the compliance, the stiffnesses and the design."""
    sizing, process = found.sizing, found.springs.process
    expected = {
        "contact.K_m_over_E_mm": found.contact.K_m_over_E(),
        "springs.K_m_over_E_mm": sizing.K_m_over_E,
        "springs.K_m_max_N_per_m": 1e3 * sizing.K_m_max,
        "accuracy.contact.error_percent": 100.0 * found.contact.error_pair,
        "material.E_MPa": process.E_MPa,
        "material.poisson": process.poisson,
    }
    sized = zip(SIZED_KEYS, sizing.springs.stiffnesses, strict=True)
    expected |= {f"springs.{key}": 1e3 * K for key, K in sized}
    for spring in found.springs.springs:
        expected |= _of_spring(spring)
    yield from (key for key, value in expected.items() if not _same(number_at(report, key), value))
    if not _all_same(value_at(report, "deflections_mm"), found.springs.deflections):
        yield "deflections_mm"
    for arm in () if found.housing is None else found.housing.arms:
        if value_at(report, f"flexures.{arm.name}.dimensions_mm") != vars(arm.flexure):
            yield f"flexures.{arm.name}.dimensions_mm"


def _of_spring(spring: FittedSpring) -> dict[str, float]:
    """Return the numbers of a spring that follow from others, by their keys."""
    numbers = {"target_N_per_m": 1e3 * spring.target}
    if spring.safety_factor is not None:
        numbers["safety_factor"] = spring.safety_factor
    return {f"flexures.{spring.name}.{key}": value for key, value in numbers.items()}


def _rows(report: Plain) -> tuple[StoredForces, ...]:
    """Return what is compared of the response; raises ValueError where a row has another shape."""
    keys = [item.name for item in fields(StoredForces)]
    rows = from_plain(tuple[Plain, ...], value_at(report, "response"), "response")
    return tuple(
        from_plain(StoredForces, {key: row[key] for key in keys if key in row}, f"response[{place}]")
        for place, row in enumerate(rows)
    )


def _other_response(rows: Sequence[StoredForces], found: Recomputed) -> Iterator[str]:
    """Yield the rows of the response whose forces are not those of springs and fruit, or whose ratios not theirs."""
    if not _all_same([row.E_MPa for row in rows], found.design.fruit.E_MPa):
        yield "response[].E_MPa"
    for place, row in enumerate(rows):
        forces = row.forces
        ratio = np.divide(forces[1], forces[0], out=np.full(len(forces[0]), np.nan), where=(forces > 0.0).all(axis=0))
        if not _all_same(row.P, ratio):
            yield f"response[{place}].P"
        if found.level:
            expected = linear_response(found.contact.S, found.C, [row.E_MPa], row.x_mm).F[0].T
            same = [_all_same(*pair) for pair in zip(forces, expected, strict=True)]
            yield from (f"response[{place}].{key}" for key, good in zip(FORCE_KEYS, same, strict=True) if not good)


def _other_verdicts(stored: Sequence[Verdict], rows: Sequence[StoredForces], found: Recomputed) -> Iterator[str]:
    """Yield the names of verdicts whose value, limit or outcome is not what the numbers give."""
    by_name = {verdict.name: verdict for verdict in stored}
    for verdict in expected_verdicts(found):
        given = by_name.get(verdict.name)
        if given is not None and not _agree(given, verdict) and not _of_the_scene(given, rows, found):
            yield verdict.name
    spreads = [_spread(row.P) for row in rows]
    worst = None if None in spreads else max(filter(None, spreads), default=0.0)
    given = by_name.get("P_displacement_independent")
    if given is not None and not _same(given.value, worst):
        yield given.name


def _other_of_paper(report: Plain, found: Recomputed) -> Iterator[str]:
    """Yield the names of verdicts on the paper's springs that are not what the compliance gives."""
    paper = paper_verdicts(found.design, found.contact, found.sizing)
    if paper is None or value_at(report, "paper") is None:
        return
    stored = from_plain(tuple[Verdict, ...], value_at(report, "paper.verdicts"), "paper.verdicts")
    if len(stored) != len(paper):
        yield "paper.verdicts"
    yield from (f"paper.{a.name}" for a, b in zip(stored, paper, strict=False) if not _agree(a, b))


def _of_the_scene(verdict: Verdict, rows: Sequence[StoredForces], found: Recomputed) -> bool:
    """Say whether P_max or NL of a scene that is not flat and level is that of its own response at E_max.

    The response in the report has no P between its moduli, so that NL is only held to its own outcome.
    """
    if found.level or verdict.name not in ("P_max", "NL"):
        return False
    if verdict.name == "NL" or verdict.value is None:
        return True
    at_E_max = [row for row in rows if _same(row.E_MPa, found.design.fruit.E_max_MPa)]
    return all(row.ends_at(verdict.value, verdict.error or 0.0) for row in at_E_max)


def _missing(stored: Sequence[Verdict], design: Design) -> list[str]:
    """Return the names of verdicts that a run gives and a report has not, or has twice."""
    names = [verdict.name for verdict in stored]
    asked = set(_NEEDED)
    if design.targets is None:
        asked -= {"P_max", "NL"}
    if design.reading is not None:
        asked = {name for name in asked if not name.startswith(("P_", "NL"))} | set(READING_VERDICTS)
    needed = [name for name in (*READING_VERDICTS, *_NEEDED) if name in asked]
    twice = {name for name in names if names.count(name) > 1}
    return [*(name for name in needed if name not in names), *sorted(twice)]


def _wrong_outcomes(stored: Sequence[Verdict]) -> list[str]:
    """Return the names of verdicts whose outcome is not that of their value, limit, tolerance and error."""
    return [verdict.name for verdict in stored if verdict.passed not in outcome_of(verdict)]


def _agree(given: Verdict, expected: Verdict) -> bool:
    """Say whether a stored verdict is the expected one; an outcome may be undecided where nothing was made."""
    undecided = given.passed is None and given.name.startswith("printable.")
    numbers = ("value", "error", "tolerance")
    return (
        all(_same(getattr(given, name), getattr(expected, name)) for name in numbers)
        and (given.limit == expected.limit or _same(given.limit, expected.limit))
        and (given.passed is expected.passed or undecided)
        and given.relative == expected.relative
    )


def _spread(P: Sequence[float | None]) -> float | None:
    touching = [value for value in P if value is not None]
    return (max(touching) - min(touching)) * len(touching) / sum(touching) if len(touching) > 1 else None


def _same(given: object, expected: object) -> bool:
    """Say whether two numbers of order 1 are the same; below, only NL and spreads lie: differences of such numbers."""
    return same_number(given, expected, 1e-3)


def _all_same(given: Sequence[Any] | np.ndarray, expected: Sequence[Any] | np.ndarray) -> bool:
    """Say whether two rows of numbers are the same; nan is the same as nan."""
    first, second = (np.array(values, dtype=np.float64) for values in (given, expected))
    return first.shape == second.shape and bool(np.allclose(first, second, rtol=ROUND_OFF, atol=1e-12, equal_nan=True))
