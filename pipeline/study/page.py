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
    files, links = _designs(store, study, best, proved)
    at_random = np.random.default_rng(_SEED).permutation(columns.points)[:MOST_DOTS].tolist()
    points = []
    for point in store.rows(sorted({*best, *proved, *at_random})):
        points.append({**point.settings, **point.values, "number": point.number})
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
    path = store.path.parent / PAGE
    write_files({**files, path: text.encode()}, "--out", force=force, renew=True)
    return path


def _designs(
    store: StudyStore, study: Study, best: Sequence[int], proved: Mapping[int, Path]
) -> tuple[dict[Path, bytes], dict[str, str]]:
    """Return the design files to write, of the base and of the best points, and the link of each point to its file.

    A point that is proved links to the file of its run, and gets none here.
    """
    folder = store.path.parent
    files = {folder / _DESIGNS / _BASE: design_as_toml(design_from_mapping(study.base)).encode()}
    links = {"base": f"{_DESIGNS}/{_BASE}"}
    for number, path in proved.items():
        links[str(number)] = path.relative_to(folder).as_posix()
    for point in store.rows([number for number in best if number not in proved]):
        name = f"point-{point.number}.toml"
        files[folder / _DESIGNS / name] = design_as_toml(design_of(study, point.settings)).encode()
        links[str(point.number)] = f"{_DESIGNS}/{name}"
    return files, links
