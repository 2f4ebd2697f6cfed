"""The outputs that say what a run has found: design.toml, response.csv, report.html, report.json."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

from pipeline.options import run_key
from pipeline.report.of_result import report_of_result
from pipeline.report.page.page import page_of
from pipeline.report.report import ListedFile, read_data, report_data
from pipeline.report.response_csv import response_csv
from pipeline.result import SensorResult
from pipeline.storage.digests import REPORT, content_digest, file_digest
from pipeline.storage.folder import managed_files
from pipeline.storage.plain import Plain
from sensor.design.design_file import design_as_mapping, design_as_toml, without_former_defaults

PAGE = "report.html"
LATEST = "latest.js"  # beside the page of a look, which reads it
FORMER_FILES = "drawing-*"
"""Files that 0.1 wrote and no command makes any more: they are not kept."""


def write_outputs(result: SensorResult, folder: Path, *, page: bool = False) -> Plain:
    """Write the files, report.json last, with the digest of every other; return its data.

    A `page`, report.html, is made of the report without the page itself. Files that earlier commands left in the
    output folder, and that this one does not make, are kept. Raises ValueError for nan or infinity.
    """
    design = f"# {result.options.command}\n{design_as_toml(result.design)}"
    (folder / "design.toml").write_text(design, encoding="utf-8")
    (folder / "response.csv").write_text(response_csv(result.errors.reading, result.design.tips), encoding="utf-8")
    stale = keep_earlier_files(result, folder)
    if result.options.look:
        (folder / LATEST).write_text(f'latest("{run_key(result.design, result.options)}")\n', encoding="utf-8")
    report = report_of_result(result, listed_files(folder), stale)
    if page:
        (folder / PAGE).write_text(page_of(report, result, folder), encoding="utf-8")
    data = report_data(replace(report, files=listed_files(folder)))
    text = json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / REPORT).write_text(f"{text}\n", encoding="utf-8")
    return data


def keep_earlier_files(result: SensorResult, folder: Path) -> dict[str, str]:
    """Copy what earlier commands made and this one did not into the folder; return what is stale by name.

    A stale file was made from another design, whose digest is given, or does not belong to the rough answer of a look.
    """
    earlier_folder = result.options.out  # `folder` takes its place once all files are written
    if earlier_folder is None:
        return {}
    earlier = managed_files(earlier_folder)
    if not earlier:
        return {}
    report = read_data(earlier_folder)
    made_from = report.get("stale", {})
    last_design = content_digest(without_former_defaults(report["design"]))
    this_design = content_digest(design_as_mapping(result.design))
    stale = {}
    for name in earlier:
        if name in (REPORT, PAGE, LATEST) or Path(name).match(FORMER_FILES) or (folder / name).exists():
            continue
        shutil.copy2(earlier_folder / name, folder / name)
        design = made_from.get(name, last_design)
        if design != this_design or result.options.look:
            stale[name] = design
    return stale


def listed_files(folder: Path) -> tuple[ListedFile, ...]:
    """Return every file in the folder but its report.json with its digest, in order of their names."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / REPORT)
    return tuple(ListedFile(path=path.relative_to(folder).as_posix(), sha256=file_digest(path)) for path in paths)
