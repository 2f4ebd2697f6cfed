"""The one gmsh session of a process: explicit options, left as it was found, its errors and arrays in one form."""

import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import gmsh
import numpy as np
from numpy.typing import NDArray

from sensor.arrays import Floats
from sensor.machine_error import MachineError

Ints = NDArray[np.int64]

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

_CHANGED_BY_WRITING = ("General.Terminal", "Print.Format")
_REINSTALL = "free memory, or install gmsh again"


class MeshError(RuntimeError):
    """A mesh that cannot be made or must not be used: the stage that failed, why, and what to do."""

    def __init__(self, stage: str, reason: str, hint: str) -> None:
        """Compose the one line of the message."""
        super().__init__(f"mesh, stage {stage!r}: {reason}; {hint}")
        self.stage = stage
        self.reason = reason
        self.hint = hint

    def __reduce__(self) -> tuple[type["MeshError"], tuple[str, str, str], dict[str, object]]:
        """Say how the error is rebuilt in another process."""
        return type(self), (self.stage, self.reason, self.hint), vars(self)


@contextmanager
def gmsh_session() -> Iterator[None]:
    """Give gmsh with this project's options and an empty model, whatever a program does with gmsh itself.

    Where gmsh is closed, it is opened and closed again. Where the program has it open, the work stands beside its own,
    which it finds as it left it. Raises MachineError where gmsh fails.
    """
    with _beside_the_program() if gmsh.isInitialized() else _opened():
        with stage("session", "check the option names against the installed gmsh"):
            for name, value in OPTIONS.items():
                gmsh.option.setNumber(name, value)
        yield


@contextmanager
def _opened() -> Iterator[None]:
    # Not interruptible: gmsh would replace the signal handler of Ctrl-C. No config files: a mesh must repeat anywhere.
    with _signals_kept(), stage("session", _REINSTALL):
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        yield
    finally:
        gmsh.finalize()


@contextmanager
def _beside_the_program() -> Iterator[None]:
    """Give a model of its own and gmsh's default options; then give back the model and the options of the program."""
    with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
        options = str(Path(folder) / "program.opt")
        with stage("session", _REINSTALL):
            model = gmsh.model.getCurrent()
            numbers = {name: gmsh.option.getNumber(name) for name in _CHANGED_BY_WRITING}
            gmsh.option.setNumber("General.Terminal", 0.0)
            gmsh.write(options)  # those that are not as gmsh has them by default
            gmsh.model.add("twintip")
            gmsh.option.restoreDefaults()
        try:
            yield
        finally:
            with stage("session", _REINSTALL):
                gmsh.model.remove()
                gmsh.model.setCurrent(model)
                gmsh.option.restoreDefaults()
                gmsh.merge(options)
                for name, number in numbers.items():
                    gmsh.option.setNumber(name, number)


@contextmanager
def _signals_kept() -> Iterator[None]:
    """Set the handlers of signals again after the block that gmsh takes away below Python; until then they wait."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE)}
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    try:
        signal.pthread_sigmask(signal.SIG_BLOCK, handlers)
        yield
    finally:
        if threading.current_thread() is threading.main_thread():  # elsewhere Python sets none
            for number, handler in handlers.items():
                if handler is not None:
                    signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)


@contextmanager
def stage(name: str, hint: str) -> Iterator[None]:
    """Turn an error of gmsh inside the block into a MachineError with this stage and hint; others pass unchanged.

    What gmsh itself raises is a fault of gmsh or of memory. Whether a mesh is good is checked here, by MeshError.
    """
    try:
        yield
    except Exception as error:
        # gmsh raises the bare class Exception and nothing else; every subclass is somebody else's.
        if type(error) is not Exception:
            raise
        msg = f"mesh, stage {name!r}: gmsh says {str(error).strip() or 'nothing'!r}; {hint}"
        raise MachineError(msg) from error


@dataclass(frozen=True)
class Nodes:
    """Points of nodes (3, n) [mm], and the index of each tag of gmsh among them, -1 for a tag that is not used."""

    points: Floats
    index: Ints


def element_nodes(kind: str, order: int = 1, entity: int = -1) -> Ints:
    """Return gmsh's tags of the nodes of all elements of a kind, or of those on one entity, shape (nodes, elements)."""
    number = gmsh.model.mesh.getElementType(kind, order)
    count = gmsh.model.mesh.getElementProperties(number)[3]
    nodes = gmsh.model.mesh.getElementsByType(number, entity)[1]
    return np.asarray(nodes, dtype=np.int64).reshape(-1, count).T


def used_nodes(elements: Ints) -> Nodes:
    """Return the nodes that elements use, of shape (nodes, elements), in the order of their tags."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    used = np.unique(elements)
    index = np.full(int(np.max(tags)) + 1, -1, dtype=np.int64)
    index[used] = np.arange(len(used))
    order = np.empty_like(index)
    order[np.asarray(tags, dtype=np.int64)] = np.arange(len(tags))
    return Nodes(np.ascontiguousarray(np.reshape(coordinates, (-1, 3))[order[used]].T), index)


def index_by_nodes(facets: Ints, wanted: Ints) -> Ints:
    """Return the column of `facets` that has the nodes of each column of `wanted`, shape (k,), -1 where none has.

    Facets or edges by their nodes, (nodes, n) and (nodes, k), which may stand in any order.
    """
    nodes = np.sort(np.concatenate([facets, wanted], axis=1), axis=0)
    _, label = np.unique(nodes, axis=1, return_inverse=True)
    column = np.full(nodes.shape[1], -1, dtype=np.int64)
    column[label[: facets.shape[1]]] = np.arange(facets.shape[1])
    return column[label[facets.shape[1] :]]
