"""The solid modeller of a run: the CAD kernel in a process of its own, which models while the run goes on with numbers.

Kernel and triangles take as long to import as both springs to solve, and neither needs the other.
"""

import fcntl
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

from cad.parts.housing import Housing, PartSize
from pipeline.storage.modeller.answer import Answer, Done, timed

# Not multiprocessing: its spawn runs a user's script again, which then starts a run of its own, and its fork copies
# the threads of libraries half-way. The program is told where the user's modules are, and what it reads from.
_PROGRAM = (
    "import sys; sys.path[:] = sys.argv[3:]; from pipeline.storage.modeller.serving import serve; "
    "serve(int(sys.argv[1]), int(sys.argv[2]))"
)

_STREAMS = 3  # input, output, errors: the first numbers of open files
_ENDING_SECONDS = 60.0


class ModellerLostError(OSError):
    """The process that models ended before it answered; the message is one line."""


class Modeller:
    """Does tasks that need the CAD kernel in this process, each when its answer is waited for."""

    def __enter__(self) -> Self:
        """Return the modeller."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let go of what the modeller holds, whatever it is at."""

    def start(self) -> None:
        """Get ready for tasks; here there is nothing to do."""

    @property
    def cpu_seconds(self) -> float:
        """Return how long other processes computed for its tasks [s]."""
        return 0.0

    def part_size(self, housing: Housing) -> Answer[PartSize]:
        """Return volume, surface and areas of named faces of the solid of a housing [mm]."""
        return self.ask("part_size", housing)

    def ask(self, task: str, *given: object) -> Answer[Any]:
        """Return the answer to a task by its name; it raises what the task raises."""
        return Answer(partial(_done_here, task, given))


class ModellerProcess(Modeller):
    """Does the tasks in a process of its own, in the order in which they are asked; as above where none can be started.

    It is started by the first task, or ahead of it by `start`, and ended at the end of the block.
    """

    def __init__(self) -> None:
        """Start nothing yet."""
        self._process: subprocess.Popen[bytes] | None = None
        self._stream: Any = None
        self._asked = 0
        self._read: list[tuple[bool, Any]] = []
        self._here = not _can_gain()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the process, whatever it is at."""
        self._here = True
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    @property
    def cpu_seconds(self) -> float:
        """Return how long the process has computed for its tasks [s], the import of the kernel not counted."""
        return float(sum(found.cpu for succeeded, found in self._read if succeeded))

    def start(self) -> None:
        """Start the process, if it is not there yet: it imports the kernel and waits for tasks."""
        if self._process is not None or self._here:
            return
        ours, theirs = _link()
        # The system ends a process with the thread that started it: only the main one lives as long as the run.
        parent = os.getpid() if threading.current_thread() is threading.main_thread() else 0
        words = [sys.executable, "-W", "ignore", "-c", _PROGRAM, str(theirs.fileno()), str(parent), *sys.path]
        with ours, theirs:
            try:
                self._process = subprocess.Popen(
                    words,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    pass_fds=(theirs.fileno(),),
                    process_group=0,  # a signal from the terminal is for the run, which ends this process
                )
            except OSError:
                self._here = True
            self._stream = ours.makefile("rwb")

    def ask(self, task: str, *given: object) -> Answer[Any]:
        """Return the answer to a task, which the process begins as soon as it has done those before it."""
        self.start()
        if self._process is None or self._here:
            return super().ask(task, *given)
        with suppress(BrokenPipeError, ConnectionResetError):  # whoever waits for the answer is told
            pickle.dump((task, given), self._stream)
            self._stream.flush()
        self._asked += 1
        return Answer(partial(self._answer, self._process, self._asked, task, given))

    def _answer(self, process: subprocess.Popen[bytes], number: int, task: str, given: tuple[object, ...]) -> Done[Any]:
        """Return the answer of a number from 1 on; those before it are kept for whoever waits for them.

        A process that leaves has met what it could not send: the task is done here, where it fails in full or not.
        """
        while len(self._read) < number:
            try:
                self._read.append(pickle.load(self._stream))
            except (EOFError, ConnectionResetError, pickle.UnpicklingError) as error:
                code = _end_of(process)
                if code < 0:
                    raise _lost(signal.Signals(-code), task) from error
                return _done_here(task, given)
        succeeded, found = self._read[number - 1]
        if not succeeded:
            raise found
        return cast("Done[Any]", found)


def _link() -> tuple[socket.socket, socket.socket]:
    """Return the two ends of a link, beyond the numbers of the standard streams, which may be closed here."""
    ends = socket.socketpair()
    with ends[0], ends[1]:
        ours, theirs = (fcntl.fcntl(end.fileno(), fcntl.F_DUPFD_CLOEXEC, _STREAMS) for end in ends)
    return socket.socket(fileno=ours), socket.socket(fileno=theirs)


def _end_of(process: subprocess.Popen[bytes]) -> int:
    """Return the exit code of a process that ends, less than 0 by a signal; one that does not end is ended."""
    try:
        return process.wait(_ENDING_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def _can_gain() -> bool:
    """Say whether a second process has a core to run on, and is Python: inside another program it would be that one."""
    return len(os.sched_getaffinity(0)) > 1 and Path(sys.executable or "").name.startswith("python")


def _done_here(task: str, given: tuple[object, ...]) -> Done[Any]:
    from pipeline.storage.modeller.tasks import TASKS

    return timed(TASKS[task], given)


def _lost(by: signal.Signals, task: str) -> ModellerLostError:
    what = f"{task.replace('_', ' ')}: the process that makes them ended by signal {by.name}"
    remedy = "free some memory, then run again" if by == signal.SIGKILL else "run again"
    return ModellerLostError(f"{what}; must live until it answers; {remedy}")
