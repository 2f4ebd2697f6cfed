"""The outputs that say what a run has found: design.toml, response.csv, report.html, report.json."""

import json
from pathlib import Path

from cad.design.design_file import design_as_toml
from pipeline.report.mapping import report_mapping
from pipeline.report.page.page import page_of
from pipeline.report.response_csv import response_csv
from pipeline.report.stored import StoredFile, report_of
from pipeline.result import SensorResult
from pipeline.storage.digests import REPORT, file_digest

PAGE = "report.html"


def write_outputs(result: SensorResult, folder: Path, *, page: bool = False) -> None:
    """Write the files, report.json last, with the digest of every other; raises ValueError for nan or infinity.

    A `page`, report.html, is made of the report without the page itself.
    """
    (folder / "design.toml").write_text(reproducing(result), encoding="utf-8")
    (folder / "response.csv").write_text(response_csv(result.errors.reading, result.design.tips), encoding="utf-8")
    if page:
        shown = report_of(folder, report_mapping(result, listed_files(folder)))
        (folder / PAGE).write_text(page_of(shown, result), encoding="utf-8")
    report = report_mapping(result, listed_files(folder))
    text = json.dumps(report, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / REPORT).write_text(f"{text}\n", encoding="utf-8")


def reproducing(result: SensorResult) -> str:
    """Return the design file with the command that repeats the run as its first line."""
    options = result.options
    flags = (
        f"--fruit-stiffness {options.fruit_stiffness} --contact-method {options.contact_method} "
        f"--tol {options.tolerance:g}"
    )
    return f"# pipeline run --design design.toml {flags}\n{design_as_toml(result.design)}"


def listed_files(folder: Path) -> list[StoredFile]:
    """Return every file in the folder but its report.json with its digest, in order of their names."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / REPORT)
    return [StoredFile(path=path.relative_to(folder).as_posix(), sha256=file_digest(path)) for path in paths]
