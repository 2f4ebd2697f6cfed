"""The points of a study, by their numbers: those of a grid, of a Sobol sequence, or of the rows of a file."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from scipy.stats import qmc

from cad.design.design_file import design_from_mapping
from cad.design.parameters import Design
from cad.quantity import validation_error
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
        raise validation_error(
            "how", study.how, "", "sobol, grid or points for a study", "run it with: pipeline optimise"
        )
    count = math.prod(len(varied.grid()) for varied in study.vary.values())
    if count > MOST_POINTS:
        raise validation_error("vary", count, "points", f"at most {MOST_POINTS}", "take fewer steps")
    return count


def points_between(study: Study, start: int, stop: int) -> Iterator[Point]:
    """Yield the points from a number up to, not including, another one; the same ones whoever asks."""
    if study.how in ("sobol", "sensitivity"):
        between = _sobol_between if study.how == "sobol" else _exchanged
        yield from between(study, start, stop)
        return
    grids = () if study.how == "points" else [varied.grid() for varied in study.vary.values()]
    for number in range(start, stop):
        values = _row(study, number) if study.how == "points" else _grid_values(grids, number)
        yield Point(number=number, settings=dict(zip(study.vary, values, strict=True)))


def _sobol_between(study: Study, start: int, stop: int) -> Iterator[Point]:
    for number, shares in enumerate(sobol_shares(len(study.vary), study.seed, start, stop), start):
        yield point_at(study, number, shares)


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
    while start < stop:
        block, row = divmod(start, study.samples)
        end = min(stop, (block + 1) * study.samples)
        for number, drawn in enumerate(sobol_shares(2 * keys, study.seed, row, row + end - start), start):
            own, other = drawn[:keys], drawn[keys:]
            shares = other if block == 1 else own
            if block > 1:
                shares[block - 2] = other[block - 2]
            yield point_at(study, number, shares)
        start = end


def point_at(study: Study, number: int, shares: Sequence[float]) -> Point:
    """Return the point at shares [1] from 0 to 1 of what varies, in the order of the study file."""
    pairs = zip(study.vary.items(), shares, strict=True)
    return Point(number=number, settings={key: varied.at(share) for (key, varied), share in pairs})


def _grid_values(grids: Sequence[tuple[Setting, ...]], number: int) -> tuple[Setting, ...]:
    """Return the values of a point of the grid; the last key varies fastest."""
    values = []
    for grid in reversed(grids):
        number, place = divmod(number, len(grid))
        values.append(grid[place])
    return tuple(reversed(values))


def _row(study: Study, number: int) -> tuple[Setting, ...]:
    return tuple(setting_of_cell(cell) for cell in study.rows[number])


def design_of(study: Study, settings: Mapping[str, Setting]) -> Design:
    """Return the design of a point; raises InputError where it is outside the bounds of the design file."""
    changed: dict[str, Plain] = {}
    for name, value in settings.items():
        if name in PRINTED_KEYS:
            continue  # a print that misses its drawing is of the same design
        table, _, key = name.partition(".")
        if table not in changed:
            own = study.base.get(table)
            changed[table] = dict(own) if isinstance(own, Mapping) else {}
        changed[table][key] = value
    return design_from_mapping({**study.base_tables, **changed})
