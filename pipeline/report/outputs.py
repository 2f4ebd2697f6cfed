"""Write the files with the results of a run: design.toml, response.csv, report.html and report.json."""

import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from pipeline.report.of_result import report_of_result
from pipeline.report.page.page import make_page
from pipeline.report.report import ListedFile, report_data
from pipeline.report.response_table import response_csv
from pipeline.result import SensorResult
from pipeline.storage.digests import REPORT, file_digest
from pipeline.storage.folder import OutputError, managed_files
from pipeline.storage.plain import Plain
from sensor.design.design_file import design_as_toml
from sensor.quantity import validation_error

PAGE = "report.html"
LATEST = "latest.js"  # the page of a run with --look reads this file to reload itself


class EarlierAnswer(NamedTuple):
    """The names of the files that an earlier run wrote into a folder, and the command that repeats this run."""

    names: tuple[str, ...]
    command: str

    def lost_files_text(self, folder: Path, command: str) -> str | None:
        """Return a sentence on the files that a new run removed from the folder, and the command that restores them.

        `command` is the command of the new run. If the earlier run had the same command, this command would not make
        the files again, so the sentence names no command. The result is None if every file of the earlier run still
        exists.
        """
        # `LATEST` is left out, because it is not a result and only a run with --look writes it.
        lost_names = [name for name in self.names if name != LATEST and not (folder / name).exists()]
        if not lost_names:
            return None
        count_text = f"files of the earlier run that were removed: {len(lost_names)}, for example {lost_names[0]}"
        if self.command == command:
            return count_text
        # The command names design.toml without its folder. The sentence adds the folder, so that it can be pasted.
        earlier_command = self.command.replace("design.toml", shlex.quote(str(folder / "design.toml")), 1)
        return (
            f"{count_text}. To make them again for this design, run: {earlier_command} --out {shlex.quote(str(folder))}"
        )


def write_outputs(result: SensorResult, folder: Path, *, page: bool = False) -> Plain:
    """Write the files with the results into a folder, and return the data of report.json.

    report.json is written last, because it contains the digests of all other files. With `page`, report.html is written
    too. The page shows the report without the digest of the page itself. Raises ValueError if a number is nan or
    infinite.
    """
    # `earlier_answer` reads the command from the first line.
    design_text = f"# {result.options.command}\n{design_as_toml(result.design)}"
    (folder / "design.toml").write_text(design_text, encoding="utf-8")
    (folder / "response.csv").write_text(response_csv(result.errors.reading, result.design.tips), encoding="utf-8")
    report = report_of_result(result)
    if result.options.look:
        (folder / LATEST).write_text(f'latest("{report.key}")\n', encoding="utf-8")
    report = replace(report, files=listed_files(folder))
    if page:
        (folder / PAGE).write_text(make_page(report, result, folder), encoding="utf-8")
    data = report_data(replace(report, files=listed_files(folder)))  # listed again, now with the page
    text = json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / REPORT).write_text(f"{text}\n", encoding="utf-8")
    return data


def refuse_folder_of_a_run(folder: Path) -> None:
    """Raise OutputError if a folder holds the files of a whole run, which a run with --look must not replace."""
    files = managed_files(folder)
    if files and LATEST not in files:
        bound = "a new or empty folder, or a folder of an earlier run with --look, but it holds a whole run"
        error = validation_error("--out", str(folder), "", bound, "name another folder")
        raise OutputError(str(error), field="--out", value=str(folder), bound=bound)


def earlier_answer(folder: Path) -> EarlierAnswer:
    """Return the files and the command of the run that wrote a folder; both are empty for a new folder.

    The command is in the first line of design.toml.
    """
    names = managed_files(folder)
    command = ""
    if "design.toml" in names:
        first_line, _, _ = (folder / "design.toml").read_text(encoding="utf-8").partition("\n")
        command = first_line.removeprefix("# ")
    return EarlierAnswer(names=tuple(names), command=command)


def listed_files(folder: Path) -> tuple[ListedFile, ...]:
    """Return every file in the folder except report.json, with its digest.

    The files are sorted by their paths, so that the order does not depend on the file system.
    """
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / REPORT)
    return tuple(ListedFile(path=path.relative_to(folder).as_posix(), sha256=file_digest(path)) for path in paths)
