"""The answer of a run that has been: printed again where its folder still holds just what the run would write."""

import hashlib
import os
from dataclasses import asdict, replace
from pathlib import Path

from cad.design.design_file import design_as_mapping
from cad.design.parameters import Design
from cad.files.file_date import NAME
from pipeline.options import RunOptions
from pipeline.report.answer.answer import RunAnswer
from pipeline.storage.cache import store, stored
from pipeline.storage.folder import whole_report
from pipeline.storage.packages import declared_packages, installed_version
from pipeline.storage.plain import Plain

_STAGE = "answer"


def kept_answer(design: Design, options: RunOptions, folder: Path) -> tuple[RunAnswer, bytes] | None:
    """Return the answer and report.json of the run that wrote all that a folder holds; None where no such run is kept.

    It had the same design and options, and was made by the same program.

    Raises OutputError where the folder cannot be used or another run writes it.
    """
    report = whole_report(folder)
    if report is None:
        return None
    answer = stored(_STAGE, _inputs(design, options, report), RunAnswer)
    return None if answer is None else (answer, report)


def keep_answer(answer: RunAnswer, design: Design, options: RunOptions, report: bytes) -> None:
    """Keep the answer of the run that wrote a report.json."""
    store(_STAGE, _inputs(design, options, report), answer)


def _inputs(design: Design, options: RunOptions, report: bytes) -> Plain:
    """Return what the files of a run follow from, wherever they are, and the digest of their report."""
    return {
        "design": design_as_mapping(design),
        "options": asdict(replace(options, out=None, force=False)),
        "date": os.environ.get(NAME),
        "packages": _packages(),
        "report": hashlib.sha256(report).hexdigest(),
    }


def _packages() -> dict[str, str | None]:
    """Return the version of the program and of each package that it needs, those for plots and pages too.

    Python's and those of optional solvers are in the digest of the code, which every entry of the cache has.
    """
    return {name: installed_version(name) for name in ("twintip", *declared_packages())}
