"""Files that a task writes, cached with the verdicts on them: equal inputs give equal bytes."""

import base64
import os
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from pathlib import Path

from cad.files.file_date import NAME
from pipeline.storage.cache import cached, stored
from pipeline.storage.workers import finished_future, submit
from sensor.verdict import Verdict

Inputs = Mapping[str, object]
Verdicts = tuple[Verdict, ...]
Written = tuple[tuple[Path, ...], Verdicts]
"""The written files, and the verdicts on them."""


@dataclass(frozen=True, kw_only=True)
class KeptFiles:
    """Files by name as base64 text, and the verdicts on them."""

    files: dict[str, str] = field(default_factory=dict)
    verdicts: Verdicts = ()

    def __post_init__(self) -> None:
        """Raise ValueError for a name that leads out of the folder, and for invalid base64."""
        for name, text in self.files.items():
            if Path(name).name != name:
                raise ValueError(name)
            base64.b64decode(text, validate=True)

    def write_to(self, folder: Path) -> Verdicts:
        """Write the files into a folder and return the verdicts on them; raises OSError."""
        for name, text in self.files.items():
            (folder / name).write_bytes(base64.b64decode(text))
        return self.verdicts


def begin_files(
    stage: str, inputs: Inputs, write: Callable[[Path], Written], executor: Executor | None
) -> Future[KeptFiles]:
    """Begin to make the files of a stage; `write` writes them into a temporary folder.

    They are cached by inputs and file date. Cached files need no worker.
    """
    found = stored(stage, _dated(inputs), KeptFiles)
    if found is not None:
        return finished_future(found)
    return submit(executor, _made_once, stage, inputs, write)


def _made_once(stage: str, inputs: Inputs, write: Callable[[Path], Written]) -> KeptFiles:
    """Return the files of a stage; make them unless another process cached them meanwhile."""

    def make() -> KeptFiles:
        with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
            paths, verdicts = write(Path(folder))
            files = {path.name: base64.b64encode(path.read_bytes()).decode() for path in paths}
        return KeptFiles(files=files, verdicts=verdicts)

    return cached(stage, _dated(inputs), make, KeptFiles)


def _dated(inputs: Inputs) -> dict[str, object]:
    return {**inputs, "date": os.environ.get(NAME)}
