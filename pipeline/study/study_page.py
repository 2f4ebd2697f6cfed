"""The self-contained HTML page of a study, which shows the trade-offs between its points and the ten best points."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.report.explain.entries import entries
from pipeline.report.keys import report_key
from pipeline.report.page.page_template import FIGURES, render_page
from pipeline.storage.files import check_paths_are_free, write_files
from pipeline.storage.plain import Plain
from pipeline.study.store import StudyStore
from pipeline.study.study_file import REFUSED, Study
from pipeline.study.wanted import VERDICT_FIELDS, verdict_field
from sensor.design.design_file import TABLE_TYPES, design_as_toml
from sensor.verdict import row_of
from sensor.words import value_text

PAGE = "study.html"
BEST = 10  # number of best points by default
MAX_DOTS = 1_000  # maximum number of points in a plot; more would overlap
_DESIGNS = "best-designs"  # folder of the design files, inside the folder of the study
_BASE = "base.toml"
_SEED = 1  # a fixed seed, so that a study always has the same page
_VALUE_SENTENCE = re.compile(r"The value is [^.]*\.")  # in the text of a verdict
_LINK = re.compile(r"\[([^]]*)\]\([^)]*\)")  # a Markdown link


class ShownKey(NamedTuple):
    """A key on the page of a study.

    `label` includes the unit. `low` and `high` are the ends of its range over all points; they are None if no value is
    a number. `counts` holds each string value of the key and its number of points.
    """

    key: str
    label: str
    varies: bool
    low: float | None
    high: float | None
    meaning: str
    counts: tuple[tuple[str, int], ...] = ()


def refuse_page(folder: Path, *, force: bool) -> None:
    """Raise InputError if the page of a study cannot be written to a folder; call this before anything is solved."""
    designs = folder / _DESIGNS
    paths = [folder / PAGE, designs / _BASE, *designs.glob("point-*.toml")]
    check_paths_are_free(paths, "--out", force=force)


def write_page(
    store: StudyStore,
    study: Study,
    best: Sequence[int] | None = None,
    proved: Mapping[int, Path] | None = None,
    *,
    force: bool = False,
) -> Path:
    """Write the page of a study, its base design, and the designs of its best points; return the path of the page.

    The files are written into the folder of the store. `best` holds the numbers of the best points, the best one first.
    By default, these are the `BEST` points with the smallest values of the first key in `wanted`. `proved` holds the
    design file of each point whose whole run passed, keyed by the number of the point. The page shows all of these
    points, and at most `MAX_DOTS` others, which are drawn at random.

    Raises InputError if a file cannot be written, or if it would replace a file of the user; with `force`, such a file
    is kept as NAME.bak.
    """
    proved = proved or {}
    if best is None:
        best = store.best(study.wanted[0], BEST)
    files, links = _design_files(store, study, best, proved)
    keys = shown_keys(study, store)
    text = render_page(
        "study.html.j2",
        (*FIGURES, "study.js"),
        {**_plot_data(store, study, keys, best, proved), "links": links},
        study=study,
        counts=store.counts(),
        dots=MAX_DOTS,
        keys=keys,
        messages=store.messages(),
    )
    path = store.path.parent / PAGE
    write_files({**files, path: text.encode()}, "--out", force=force)
    return path


def _plot_data(
    store: StudyStore, study: Study, keys: Sequence[ShownKey], best: Sequence[int], proved: Mapping[int, Path]
) -> Plain:
    """Return the data for the plots of the page: the keys that can be shown, and the points.

    `keys` are the keys with their own row on the page. `best` holds the numbers of the best points, and `proved` the
    design file of each point whose whole run passed, keyed by its number.
    """
    minimised_key = study.goal.minimise if study.how == "search" else study.wanted[0]
    front = {"key": study.goal.front_key, "values": study.front, "proved": list(proved)} if study.front else None
    return {
        "vary": list(study.vary),
        "wanted": list(study.wanted),
        "shown": [shown_key.key for shown_key in keys],
        "labels": {shown_key.key: shown_key.label for shown_key in keys},
        "axes": [shown_key.key for shown_key in keys if store.differs(shown_key.key)],  # a constant makes no axis
        "parts": [key for key in study.wanted if is_part_of_limit(key)],  # limits of which a plot shows the used part
        "minimise": minimised_key,
        "points": _drawn_points(store, {*best, *proved}),
        "best": list(best),
        "front": front,
    }


def _drawn_points(store: StudyStore, required: set[int]) -> list[Plain]:
    """Return the settings, values and number of each point that the plots show, sorted by number.

    The plots show the points with the numbers in `required`, and a random sample of at most `MAX_DOTS` other points.
    """
    sample = np.random.default_rng(_SEED).permutation(store.done())[:MAX_DOTS].tolist()
    points = store.rows(sorted({*required, *sample}))
    return [{**point.settings, **point.values, "number": point.number} for point in points]


def shown_keys(study: Study, store: StudyStore) -> tuple[ShownKey, ...]:
    """Return the varied keys and requested outputs that have their own row on the page."""
    without_row = _keys_without_row(study)
    return tuple(_shown_key(key, study, store) for key in study.keys if key not in without_row)


def _keys_without_row(study: Study) -> set[str]:
    """Return the keys that have no row of their own on the page.

    If the value of a verdict is requested, its error, limit, tolerance and outcome appear in the row of the value.
    """
    # A search adds the key REFUSED for its own use, so the page does not show it.
    keys = {REFUSED} if study.how == "search" else set()
    for key in study.wanted:
        verdict, _, last_part = key.rpartition(".")
        if verdict.startswith("verdicts.") and last_part == "value":
            keys |= {f"{verdict}.{field}" for field in VERDICT_FIELDS if field != "value"}
    return keys


def _shown_key(key: str, study: Study, store: StudyStore) -> ShownKey:
    """Return a key of a study with its label, its meaning, and its range over the stored points."""
    low, high = store.span(key) or (None, None)
    varies = key in study.vary
    label, markdown = _label_and_meaning(key, varies=varies)
    meaning = _LINK.sub(r"\1", markdown).replace("`", "")  # the page shows plain text, not Markdown
    counts = {value_text(value): count for value, count in store.text_counts(key).items()}
    return ShownKey(key, label, varies, low, high, meaning, tuple(sorted(counts.items())))


def is_part_of_limit(key: str) -> bool:
    """Return whether a key is the limit of a verdict that limits its value on one side, from above or from below."""
    name, field = verdict_field(key)
    return field == "limit" and row_of(name).sense is not None


def _label_and_meaning(key: str, *, varies: bool) -> tuple[str, str]:
    """Return the label of a key on the page, and its meaning as Markdown.

    The label includes the unit if the key itself does not. A key that `varies` is looked up among the keys of a design
    first. All other keys are looked up only among the keys of the report. The meaning is empty if it is not known.
    """
    verdict, verdict_part = verdict_field(key)
    if verdict:
        return _verdict_label_and_meaning(verdict, verdict_part)
    table, _, field_name = key.partition(".")
    if varies and table in TABLE_TYPES:
        design_fields = {item.name: item for item in fields(TABLE_TYPES[table])}
        if field_name in design_fields:
            return key, design_fields[field_name].metadata["meaning"]
    entry = report_key(key)
    meaning = "" if entry is None else entry.meaning
    return key, meaning


def _verdict_label_and_meaning(name: str, field: str) -> tuple[str, str]:
    """Return the label and the meaning of a field of the verdict called `name`, such as its value or its limit.

    The text of a verdict begins with its question, and a later sentence describes its value. The meaning is the
    question. If the field is `value`, the sentence on the value follows. The meaning of an unknown verdict is empty.
    """
    label = name if field == "value" else f"{name}, {field}"
    # An entry explains one verdict, or several verdicts whose names are in `each`.
    entry = next((candidate for candidate in entries() if name in (candidate.each or (candidate.name,))), None)
    if entry is None:
        return label, ""
    if row_of(name).standard and field != "passed":
        # A study shows the values in report.json, which are standard deviations. Other pages show half widths at 95 %.
        label = f"{label}, one standard deviation"
    has_unit = entry.unit != "1" and field != "passed"
    if has_unit:
        label = f"{label} [{entry.unit}]"
    question, _, _ = entry.meaning.partition("?")
    meaning = f"{question}?"
    value_sentence = _VALUE_SENTENCE.search(entry.meaning)
    if field == "value" and value_sentence:
        meaning = f"{meaning} {value_sentence[0]}"
    return label, meaning


def _design_files(
    store: StudyStore, study: Study, best: Sequence[int], proved: Mapping[int, Path]
) -> tuple[dict[Path, bytes], dict[str, str]]:
    """Return the design files of the base and of the best points, keyed by path, and a link to the file of each point.

    `best` holds the numbers of the best points, and `proved` the design file of each point whose whole run passed. A
    proved point is linked to this file, so no other file is written for it. The links are relative to the folder of the
    study, and keyed by "base" or by the number of the point.

    An incomplete base design has no file. If the study varies between several processes that the base defines, the base
    is not linked, because its file contains only one of them.
    """
    folder = store.path.parent
    files = {}
    links = {}
    if study.design is not None:
        files[folder / _DESIGNS / _BASE] = design_as_toml(study.design).encode()
        varies_own_processes = bool(study.base.custom_processes) and "print.process" in study.vary
        if not varies_own_processes:
            links["base"] = f"{_DESIGNS}/{_BASE}"
    for number, path in proved.items():
        links[str(number)] = path.relative_to(folder).as_posix()
    for point in store.rows([number for number in best if number not in proved]):
        name = f"point-{point.number}.toml"
        files[folder / _DESIGNS / name] = design_as_toml(study.base.design(point.settings)).encode()
        links[str(point.number)] = f"{_DESIGNS}/{name}"
    return files, links
