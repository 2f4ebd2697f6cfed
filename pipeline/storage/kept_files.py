"""Cache for the files that a stage writes, and for the verdicts on them; equal inputs give identical files."""

import base64
import os
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from pathlib import Path

from cad.files.file_date import DATE_VARIABLE
from pipeline.storage.cache import load_or_compute, load_stored
from pipeline.storage.workers import finished_future, submit
from sensor.verdict import Verdict

Inputs = Mapping[str, object]
Verdicts = tuple[Verdict, ...]
Written = tuple[tuple[Path, ...], Verdicts]
"""The paths of the written files, and the verdicts on them."""


@dataclass(frozen=True, kw_only=True)
class KeptFiles:
    """The contents of files as base64 text, keyed by file name, and the verdicts on these files."""

    files: dict[str, str] = field(default_factory=dict)
    verdicts: Verdicts = ()

    def __post_init__(self) -> None:
        """Raise ValueError for a name that contains a folder, and for invalid base64."""
        for name, text in self.files.items():
            if Path(name).name != name:
                raise ValueError(name)
            base64.b64decode(text, validate=True)

    def write_to(self, folder: Path) -> Verdicts:
        """Write the files into a folder and return the verdicts on them; raises OSError if a file cannot be written."""
        for name, text in self.files.items():
            (folder / name).write_bytes(base64.b64decode(text))
        return self.verdicts


def begin_files(
    stage: str, inputs: Inputs, write: Callable[[Path], Written], executor: Executor | None
) -> Future[KeptFiles]:
    """Start making the files of a stage in a worker process of `executor`, and return their future.

    `write` writes the files into a folder, and returns their paths and the verdicts on them. The key in the cache
    consists of `stage`, `inputs` and the file date. If the files are cached, the future is already finished and no
    worker is used. If `executor` is None, the files are made in this process before the function returns.
    """
    cached_files = load_stored(stage, _with_date(inputs), KeptFiles)
    if cached_files is not None:
        return finished_future(cached_files)
    return submit(executor, _make_or_load, stage, inputs, write)


def _make_or_load(stage: str, inputs: Inputs, write: Callable[[Path], Written]) -> KeptFiles:
    """Make the files of a stage, or load them if another process has cached them in the meantime."""

    def make() -> KeptFiles:
        with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
            paths, verdicts = write(Path(folder))
            files = {path.name: base64.b64encode(path.read_bytes()).decode() for path in paths}
        return KeptFiles(files=files, verdicts=verdicts)

    return load_or_compute(stage, _with_date(inputs), make, KeptFiles)


def _with_date(inputs: Inputs) -> dict[str, object]:
    """Return the inputs together with the date that the files contain, which the environment may set."""
    return {**inputs, "date": os.environ.get(DATE_VARIABLE)}
