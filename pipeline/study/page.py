"""The page of a study, one file that needs no network: what the points trade off, and the best ten."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pipeline.report.page.template import FIGURES, render_page
from pipeline.storage.files import refuse_taken, write_files
from pipeline.study.columns import point_columns
from pipeline.study.points import design_of
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study
from sensor.design.design_file import design_as_toml, design_from_mapping

PAGE = "study.html"
BEST = 10
MOST_DOTS = 1_000  # of the points: more hide each other
_DESIGNS = "best-designs"
_BASE = "base.toml"
_SEED = 1


def refuse_page(folder: Path, *, force: bool = False) -> None:
    """Raise InputError where the page of the study of a folder could not be written, before anything is solved."""
    designs = folder / _DESIGNS
    paths = [folder / PAGE, designs / _BASE, *designs.glob("point-*.toml")]
    refuse_taken(paths, "--out", force=force, renew=True)


def write_page(
    store: StudyStore,
    study: Study,
    best: Sequence[int] | None = None,
    proved: Mapping[int, Path] | None = None,
    *,
    force: bool = False,
) -> Path:
    """Write the page of a study beside its store, with the base design and those of its best points; return it.

    `best` are the numbers of the best points, the best first; by default the ten with the least of the first wanted
    key. `proved` are those whose runs passed, with their design files. Of many points some, drawn at random, are shown
    beside them. Raises InputError as `write_files`.
    """
    columns = point_columns(store, study.keys)
    proved = proved or {}
    if best is None:
        best = columns.best(study.wanted[0], BEST)
    at_random = np.random.default_rng(_SEED).permutation(columns.points)[:MOST_DOTS].tolist()
    points = []
    for point in store.rows(sorted({*best, *proved, *at_random})):
        points.append({**point.settings, **point.values, "number": point.number})
    designs = {_BASE: design_as_toml(design_from_mapping(study.base))}
    links = {"base": f"{_DESIGNS}/{_BASE}"}
    folder = store.path.parent
    for number, path in proved.items():
        links[str(number)] = path.relative_to(folder).as_posix()
    for point in store.rows([number for number in best if number not in proved]):
        name = f"point-{point.number}.toml"
        designs[name] = design_as_toml(design_of(study, point.settings))
        links[str(point.number)] = f"{_DESIGNS}/{name}"
    files = {folder / _DESIGNS / name: text.encode() for name, text in designs.items()}
    data = {
        "vary": list(study.vary),
        "wanted": list(study.wanted),
        "axes": [key for key in study.keys if columns.differs(key)],
        "minimise": study.goal.minimise if study.how == "search" else study.wanted[0],
        "points": points,
        "best": list(best),
        "front": {"key": study.goal.front, "values": study.front, "proved": list(proved)} if study.front else None,
        "links": links,
    }
    text = render_page(
        "study.html.j2",
        (*FIGURES, "study.js"),
        data,
        study=study,
        counts=store.counts(),
        dots=MOST_DOTS,
        constants={key: columns.span(key)[0] for key in columns.values if not columns.differs(key)},
        messages=store.messages(),
    )
    write_files({**files, folder / PAGE: text.encode()}, "--out", force=force, renew=True)
    return folder / PAGE
