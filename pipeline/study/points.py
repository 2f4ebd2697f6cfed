"""The points of a study, by their numbers: those of a grid, of a Sobol sequence, or of the rows of a file."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from scipy.stats import qmc

from cad.design.design_file import design_from_mapping
from cad.design.parameters import Design
from cad.quantity import fault
from pipeline.storage.plain import Plain
from pipeline.study.levels.printed import PRINTED_KEYS
from pipeline.study.study_file import MOST_POINTS, Study
from pipeline.study.variation import Setting, setting_of_cell

SOBOL_BITS = 30


@dataclass(frozen=True, kw_only=True)
class Point:
    """One point of a study: its number from 0, and the value of each key that varies."""

    number: int
    settings: Mapping[str, Setting]


def point_count(study: Study) -> int:
    """Return how many points a study has."""
    if study.how == "points":
        return len(study.rows)
    if study.how == "sobol":
        return study.samples
    if study.how == "sensitivity":
        return study.samples * (len(study.vary) + 2)
    if study.how == "search":
        raise fault("how", study.how, "", "sobol, grid or points for a study", "run it with: pipeline optimise")
    count = math.prod(len(varied.grid()) for varied in study.vary.values())
    if count > MOST_POINTS:
        raise fault("vary", count, "points", f"at most {MOST_POINTS}", "take fewer steps")
    return count


def points_between(study: Study, start: int, stop: int) -> Iterator[Point]:
    """Yield the points from a number up to, not including, another one; the same ones whoever asks."""
    if study.how == "sobol":
        for number, shares in enumerate(sobol_shares(len(study.vary), study.seed, start, stop), start):
            yield point_at(study, number, shares)
        return
    if study.how == "sensitivity":
        yield from _exchanged(study, start, stop)
        return
    for number in range(start, stop):
        values = _row(study, number) if study.how == "points" else _grid_values(study, number)
        yield Point(number=number, settings=dict(zip(study.vary, values, strict=True)))


def sobol_shares(keys: int, seed: int, start: int, stop: int) -> list[list[float]]:
    """Return points of a scrambled Sobol sequence [1], (points, keys): a longer one begins with those of a shorter."""
    sequence = qmc.Sobol(keys, scramble=True, bits=SOBOL_BITS, rng=seed)
    if start:
        sequence.fast_forward(start)
    # The first point by itself: a call for more would ask for a power of two.
    drawn = sequence.random(min(1, stop - start)).tolist(), sequence.random(max(0, stop - start - 1)).tolist()
    return [*drawn[0], *drawn[1]]


def _exchanged(study: Study, start: int, stop: int) -> Iterator[Point]:
    """Yield points of a study of sensitivities: sample A, sample B, then for each key A with this key from B."""
    keys = len(study.vary)
    drawn = sobol_shares(2 * keys, study.seed, 0, study.samples)
    for number in range(start, stop):
        block, row = divmod(number, study.samples)
        own, other = drawn[row][:keys], drawn[row][keys:]
        shares = other if block == 1 else list(own)
        if block > 1:
            shares[block - 2] = other[block - 2]
        yield point_at(study, number, shares)


def point_at(study: Study, number: int, shares: Sequence[float]) -> Point:
    """Return the point at shares [1] from 0 to 1 of what varies, in the order of the study file."""
    pairs = zip(study.vary.items(), shares, strict=True)
    return Point(number=number, settings={key: varied.at(share) for (key, varied), share in pairs})


def _grid_values(study: Study, number: int) -> tuple[Setting, ...]:
    """Return the values of a point of the grid; the last key varies fastest."""
    values = []
    for varied in reversed(tuple(study.vary.values())):
        number, place = divmod(number, len(varied.grid()))
        values.append(varied.grid()[place])
    return tuple(reversed(values))


def _row(study: Study, number: int) -> tuple[Setting, ...]:
    return tuple(setting_of_cell(cell) for cell in study.rows[number])


def design_of(study: Study, settings: Mapping[str, Setting]) -> Design:
    """Return the design of a point; raises InputError where it is outside the bounds of the design file."""
    return design_from_mapping(_with_settings(study.base, settings))


def _with_settings(base: Mapping[str, object], settings: Mapping[str, Setting]) -> Plain:
    tables: Plain = {key: dict(value) if isinstance(value, Mapping) else value for key, value in base.items()}
    for name, value in settings.items():
        if name in PRINTED_KEYS:
            continue  # a print that misses its drawing is of the same design
        table, _, key = name.partition(".")
        tables.setdefault(table, {})[key] = value
    return tables
