"""An output folder as one web page that needs nothing else: its bodies with their fields, or two runs side by side."""

from pathlib import Path

import numpy as np

from cad.files.glb import GlbBody, glb_of
from pipeline.report.page import answer
from pipeline.report.page.bodies import assembly_body, legend, page_body, palette_colours
from pipeline.report.page.template import BODIES, FIGURES, render_page
from pipeline.report.report import Report, read_report, report_of, written_data
from pipeline.report.verdict_rule import ERRORS_IN_WORDS, as_read, limit_text, measured
from pipeline.storage.files import refuse_taken, write_files
from pipeline.storage.plain import Plain
from pipeline.view.scene import DISPLACEMENT, Field, FieldScene, deformed_surface
from pipeline.view.scenes import field_scenes
from sensor.design.design_file import design_as_mapping
from sensor.quantity import COVERAGE, validation_error
from sensor.verdict import Verdict

FLAG = "--html"
COMPARE = "--compare"


def refuse_page(path: Path, flag: str, *, force: bool = False) -> None:
    """Raise InputError where a path ends in another way than .html, or a file that is not ours is there."""
    if path.suffix != ".html":
        hint = f"write {path.with_suffix('.html').name}"
        raise validation_error(flag, str(path), "", "a file name that ends in .html", hint)
    refuse_taken([path], flag, force=force, renew=True)


def write_web_page(folder: Path, path: Path, *, force: bool = False) -> Path:
    """Write the bodies of an output folder with their fields as one web page; return its path.

    Raises InputError where the folder has no body, and where the path ends in another way than .html or cannot be
    written. It does so too where an unmanaged file is there and `force` does not keep it as NAME.bak.
    """
    refuse_page(path, FLAG, force=force)
    report = read_report(folder)
    bodies = field_bodies(report, folder) + assembly_bodies(folder)
    if not bodies:
        bound = "an output folder with an assembly, or with fields"
        raise validation_error("DIR", str(folder), "", bound, "write one with pipeline run --fields")
    page = render_page("scenes.html.j2", (*FIGURES, *BODIES, "scenes.js"), {"bodies": bodies}, name=report.design.name)
    write_files({path: page.encode()}, FLAG, force=force, renew=True)
    return path


def assembly_bodies(folder: Path) -> list[Plain]:
    """Return the assembly of an output folder, if it has one."""
    try:
        return [assembly_body(folder)]
    except ValueError:
        return []


def field_bodies(report: Report, folder: Path) -> list[Plain]:
    """Return each scene of an output folder in the colours of each of its fields; none without fields."""
    return [_coloured(scene, field) for scene in field_scenes(report, folder) for field in scene.fields]


def _coloured(scene: FieldScene, field: Field) -> Plain:
    """Return a scene in the colours of a field, which its animation bends."""
    scene = scene.drawn_for(field)
    at_rest, _ = deformed_surface(scene, subdivision=0)
    surface = at_rest.triangulate()
    lowest, highest = field.range_on(scene.mesh)
    values = np.asarray(surface.point_data[field.array], dtype=np.float64)
    body = GlbBody(
        name=scene.name,
        vertices=np.asarray(surface.points, dtype=np.float64),
        triangles=surface.regular_faces,
        colour=palette_colours(values, lowest, highest if highest > lowest else lowest + 1.0),
        moved=scene.factor * np.asarray(surface.point_data[DISPLACEMENT], dtype=np.float64),
    )
    colours = legend(field.title, lowest, highest)
    name = f"{scene.name}: {field.title}"
    return page_body(name, glb_of([body]), slider="press", caption=f"{scene.caption}.", legend=colours, labels=[])


def write_comparison(folders: tuple[Path, Path], path: Path, *, force: bool = False) -> Path:
    """Write two output folders side by side as one web page: verdicts, plots and parts; return its path.

    Raises InputError as `write_web_page`.
    """
    refuse_page(path, COMPARE, force=force)
    sides: list[Plain] = []
    reports: list[Report] = []
    for folder in folders:
        data = written_data(folder)
        report = report_of(folder, data)
        reports.append(report)
        title = report.design.name
        if sides and sides[0]["title"] == title:
            title = f"{title} ({folder.name})"
        sides.append({"title": title, "report": data, "bodies": assembly_bodies(folder)})
    answers = [answer.answer_of(report) for report in reports]
    designs = [_flat(design_as_mapping(report.design)) for report in reports]
    page = render_page(
        "comparison.html.j2",
        (*FIGURES, *BODIES, "comparison.js"),
        {"sides": sides, "coverage": COVERAGE},
        sides=[{"title": side["title"], "answer": one} for side, one in zip(sides, answers, strict=True)],
        inputs=_different(*designs),
        rows=_verdict_rows(reports),
        outcomes=answer.OUTCOMES,
        errors_in_words=ERRORS_IN_WORDS,
        measured=measured,
        limit_text=limit_text,
    )
    write_files({path: page.encode()}, COMPARE, force=force, renew=True)
    return path


def _verdict_rows(reports: list[Report]) -> dict[str, list[Verdict | None]]:
    """Return the verdict of each report by its name, None where a report has none; those on the part come last."""
    by_name = [{verdict.name: as_read(verdict) for verdict in report.verdicts} for report in reports]
    verdicts = [verdict for report in reports for verdict in report.verdicts]
    names = [verdict.name for verdict in sorted(verdicts, key=answer.is_on_the_part)]
    return {name: [one.get(name) for one in by_name] for name in names}


def _flat(design: Plain) -> Plain:
    """Return the keys of a design by their dotted names."""
    flat: Plain = {}
    for table, values in design.items():
        if isinstance(values, dict):
            flat |= {f"{table}.{key}": value for key, value in values.items()}
    return flat


def _different(first: Plain, second: Plain) -> dict[str, tuple[object, object]]:
    """Return the keys whose values differ in two designs, with both values, None for one that is not set."""
    pairs = {key: (first.get(key), second.get(key)) for key in {**first, **second}}
    return {key: pair for key, pair in pairs.items() if pair[0] != pair[1]}
