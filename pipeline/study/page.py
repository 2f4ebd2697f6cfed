"""The page of a study, one file that needs no network: what the points trade off, and the best ten."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cad.design.design_file import design_as_toml, design_from_mapping
from pipeline.report.page.template import FIGURES, rendered
from pipeline.storage.files import refuse_taken, write_files
from pipeline.study.columns import point_columns
from pipeline.study.outputs import refuse_output
from pipeline.study.points import design_of
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study

FLAG = "--html"
PAGE = "study.html"
BEST = 10
MOST_DOTS = 1_000  # of the points: more hide each other
_FOLDER = "best-designs"
_BASE = "base.toml"
_SEED = 1


def refuse_page(path: Path, folder: Path, *, force: bool = False) -> None:
    """Raise InputError where no page of the study of a folder can be written, before anything is solved."""
    refuse_output(path, [".html"], folder, FLAG, force=force)
    designs = folder / _FOLDER
    refuse_taken([designs / _BASE, *designs.glob("point-*.toml")], "--out", force=force, renew=True)


def write_page(
    store: StudyStore, study: Study, path: Path, best: Sequence[int] | None = None, *, force: bool = False
) -> None:
    """Write the page of a study to a file; beside its store the base design and those of its best ten points.

    `best` are the numbers of the best points, the best first; by default those with the least of the first wanted key.
    Of many points some, drawn at random, are shown beside them. Raises InputError as `write_files`.
    """
    columns = point_columns(store, study.keys)
    best = list(best if best is not None else columns.best(study.wanted[0], BEST))[:BEST]
    at_random = np.random.default_rng(_SEED).permutation(columns.points)[:MOST_DOTS].tolist()
    points = []
    for point in store.rows(sorted({*best, *at_random})):
        points.append({**point.settings, **point.values, "number": point.number})
    constants = {}
    for key, values in columns.values.items():
        if not columns.differs(key):
            constants[key] = float(np.nanmin(values))
    folder = store.path.parent / _FOLDER
    base = folder / _BASE
    designs = {base: design_as_toml(design_from_mapping(study.base)).encode()}
    links = {"base": _link(base, path)}
    for point in store.rows(best):
        design = folder / f"point-{point.number}.toml"
        designs[design] = design_as_toml(design_of(study, point.settings)).encode()
        links[str(point.number)] = _link(design, path)
    write_files(designs, "--out", force=force, renew=True)
    data = {
        "vary": list(study.vary),
        "wanted": list(study.wanted),
        "axes": [key for key in study.keys if columns.differs(key)],
        "minimise": study.goal.minimise if study.how == "search" else study.wanted[0],
        "points": points,
        "best": best,
        "links": links,
    }
    text = rendered(
        "study.html.j2",
        (*FIGURES, "study.js"),
        data,
        study=study,
        counts=store.counts(),
        dots=MOST_DOTS,
        constants=constants,
        messages=store.messages(),
    )
    write_files({path: text.encode()}, FLAG, force=force, renew=True)


def _link(design: Path, page: Path) -> str:
    """Return how a page names a design file: from its own folder where it can, so that both may be moved."""
    folder = page.parent.resolve()
    target = design.resolve()
    return str(target.relative_to(folder)) if target.is_relative_to(folder) else target.as_uri()
