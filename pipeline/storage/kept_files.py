"""Files that a task writes, kept with the verdicts on them: the same inputs give the same bytes again."""

import base64
import os
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path

from cad.files.file_date import NAME
from pipeline.storage.cache import cached, stored
from pipeline.storage.workers import finished_future, submit
from sensor.verdict import Verdict

Inputs = Mapping[str, object]
Verdicts = tuple[Verdict, ...]
Written = tuple[tuple[Path, ...], Verdicts]
"""The files that were written, and the verdicts on them."""


@dataclass(frozen=True, kw_only=True)
class Solids:
    """Files by name, as text in base 64, and the verdicts on them."""

    files: dict[str, str]
    verdicts: Verdicts

    def __post_init__(self) -> None:
        """Raise ValueError for a name that leads out of the folder, and for text that is no base 64."""
        for name, text in self.files.items():
            if Path(name).name != name:
                raise ValueError(name)
            base64.b64decode(text, validate=True)


def begin_files(
    stage: str, inputs: Inputs, write: Callable[[], Written], folder: Path, executor: Executor | None
) -> Future[Verdicts]:
    """Begin to write the files of a stage into a folder; the result is the verdicts on them.

    Both are kept by the inputs and the date of files. Those that are kept are written at once, which needs no worker.
    """
    found = stored(stage, _dated(inputs), Solids)
    if found is not None:
        return finished_future(_placed(found, folder))
    return submit(executor, _written_once, stage, inputs, write, folder)


def _written_once(stage: str, inputs: Inputs, write: Callable[[], Written], folder: Path) -> Verdicts:
    """Return the verdicts on the files of a stage, which are written unless another process has kept them since."""

    def solids() -> Solids:
        paths, verdicts = write()
        files = {path.name: base64.b64encode(path.read_bytes()).decode() for path in paths}
        return Solids(files=files, verdicts=verdicts)

    return _placed(cached(stage, _dated(inputs), solids, Solids), folder)


def _dated(inputs: Inputs) -> dict[str, object]:
    return {**inputs, "date": os.environ.get(NAME)}


def _placed(found: Solids, folder: Path) -> Verdicts:
    for name, text in found.files.items():
        (folder / name).write_bytes(base64.b64decode(text))
    return found.verdicts
