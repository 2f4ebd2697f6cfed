"""The page of a study, one file that needs no network: effects of each key, points as lines, the best ten."""

from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, FileSystemLoader

from cad.design.design_file import design_as_toml
from cad.quantity import validation_error
from pipeline.storage.files import place_files, refuse_taken
from pipeline.study.answers.point_columns import PointColumns, point_columns
from pipeline.study.answers.study_plots import MOST_DOTS, MOST_LINES, constants, drawings
from pipeline.study.levels.printed import PRINTED_KEYS
from pipeline.study.points import design_of
from pipeline.study.store import StudyStore
from pipeline.study.study_file import Study

FLAG = "--html"
TEMPLATE = "page.html.j2"
BEST = 10
_BEST_DESIGNS = "best-designs"


@dataclass(frozen=True, kw_only=True)
class BestRow:
    """A line of the table of the best points: its number, its cells, and its design file as the page names it.

    A point of a study of prints has no design file.
    """

    number: int
    design: str | None
    cells: tuple[str, ...]


def refuse_page(path: Path, folder: Path, *, force: bool = False) -> None:
    """Raise InputError where no page of the study of a folder can be written, before anything is solved."""
    if path.suffix != ".html":
        raise validation_error(FLAG, str(path), "", "a file name that ends in .html", "change its ending")
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise validation_error(FLAG, str(path), "", "a file in a folder that is there", "make that folder first")
    if not force:
        refuse_taken(path.parent, [path.name], FLAG)
        designs = folder / _BEST_DESIGNS
        refuse_taken(designs, [place.name for place in sorted(designs.glob("point-*.toml"))], "--out")


def write_page(store: StudyStore, study: Study, path: Path, *, force: bool = False) -> None:
    """Write the page of a study to a file, and the design files of its best ten points beside its store.

    Means are over all points that are done; of many points some, drawn at random, are shown as dots and lines. Raises
    InputError where a foreign file is there and `force` does not keep it as NAME.bak, or none can be written.
    """
    keys = tuple(dict.fromkeys((*study.vary, *study.wanted)))
    columns = point_columns(store, keys)
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True)
    text = environment.get_template(TEMPLATE).render(
        name=study.name,
        level=study.level,
        counts=store.counts(),
        drawings=drawings(columns, tuple(study.vary), study.wanted),
        dots=MOST_DOTS,
        lines=MOST_LINES,
        constants={key: _cell(value) for key, value in constants(columns, keys).items()},
        first=study.wanted[0],
        header=[key.split(".") for key in keys],
        best=_best_rows(store, study, columns, path, force=force),
        prints_vary=prints_vary(study),
        messages=store.messages(),
    )
    place_files(path.parent, {path.name: text.encode()}, FLAG, force=force)


def _best_rows(store: StudyStore, study: Study, columns: PointColumns, page: Path, *, force: bool) -> list[BestRow]:
    """Return the best ten points, their design files written beside the store; there are none where prints vary."""
    best = store.picked(columns.best(study.wanted[0], BEST))
    links: list[str | None] = [None] * len(best)
    if not prints_vary(study):
        designs = {
            f"point-{point.number}.toml": design_as_toml(design_of(study, point.settings)).encode() for point in best
        }
        paths = place_files(store.path.parent / _BEST_DESIGNS, designs, "--out", force=force)
        links = [_link(path, page.parent) for path in paths]
    keys = tuple(dict.fromkeys((*study.vary, *study.wanted)))
    return [
        BestRow(
            number=point.number,
            design=link,
            cells=tuple(_cell({**point.settings, **point.values}.get(key)) for key in keys),
        )
        for point, link in zip(best, links, strict=True)
    ]


def prints_vary(study: Study) -> bool:
    """Say whether the points of a study are prints that miss their drawing, so that no design file has them."""
    return any(key in PRINTED_KEYS for key in study.vary)


def _link(target: Path, page: Path) -> str:
    """Return how a page in a folder names a design file."""
    near = target.resolve().is_relative_to(page.resolve())
    return str(target.resolve().relative_to(page.resolve())) if near else target.resolve().as_uri()


def _cell(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value)
