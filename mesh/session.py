"""The one gmsh session of a process: opened with explicit options, always closed, its errors in one form."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import gmsh

OPTIONS = {
    "General.Terminal": 0.0,
    "General.NumThreads": 1.0,
    "General.AbortOnError": 2.0,  # raise; with 0 a failed step returns as if it had succeeded
    "Mesh.RandomSeed": 1.0,
    "Mesh.Algorithm": 6.0,
    "Mesh.Algorithm3D": 1.0,
    "Mesh.ElementOrder": 1.0,
    "Mesh.Optimize": 1.0,
    "Mesh.MeshSizeMin": 0.0,
    "Mesh.MeshSizeExtendFromBoundary": 0.0,
    "Mesh.MeshSizeFromPoints": 0.0,
    "Mesh.MeshSizeFromCurvature": 0.0,
}


class MeshError(RuntimeError):
    """A mesh that cannot be made or must not be used: the stage that failed, why, and what to do."""

    def __init__(self, stage: str, reason: str, remedy: str) -> None:
        """Compose the one line of the message."""
        super().__init__(f"mesh, stage {stage!r}: {reason}; {remedy}")
        self.stage = stage
        self.reason = reason
        self.remedy = remedy

    def __reduce__(self) -> tuple[type["MeshError"], tuple[str, str, str], dict[str, object]]:
        """Say how the error is rebuilt in another process."""
        return type(self), (self.stage, self.reason, self.remedy), vars(self)


@contextmanager
def gmsh_session() -> Iterator[None]:
    """Open gmsh with this project's options and close it whatever happens; raises MeshError when it is open already."""
    if gmsh.isInitialized():
        raise MeshError("session", "gmsh is open already", "close the other session first, gmsh is one per process")
    # Not interruptible: gmsh would replace the signal handler of Ctrl-C. No config files: a mesh must repeat anywhere.
    with _signals_kept():
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        with stage("session", "check the option names against the installed gmsh"):
            for name, value in OPTIONS.items():
                gmsh.option.setNumber(name, value)
        yield
    finally:
        gmsh.finalize()


@contextmanager
def _signals_kept() -> Iterator[None]:
    """Set the handlers of signals again after the block that gmsh takes away below Python."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE)}
    yield
    if threading.current_thread() is threading.main_thread():  # elsewhere Python sets none
        for number, handler in handlers.items():
            if handler is not None:
                signal.signal(number, handler)


@contextmanager
def stage(name: str, remedy: str) -> Iterator[None]:
    """Turn an error of gmsh inside the block into a MeshError with this stage and remedy; others pass unchanged."""
    try:
        yield
    except Exception as error:
        # gmsh raises the bare class Exception and nothing else; every subclass is somebody else's.
        if type(error) is not Exception:
            raise
        raise MeshError(name, f"gmsh says {str(error).strip() or 'nothing'!r}", remedy) from error
