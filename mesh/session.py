"""The only gmsh session of a process, with explicit options.

This module also converts gmsh's errors to exceptions, and its meshes to arrays.
"""

import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import gmsh
import numpy as np
from numpy.typing import NDArray

from sensor.arrays import Floats
from sensor.machine_error import MachineError

Ints = NDArray[np.int64]

CURVE, SURFACE = 1, 2  # gmsh identifies an entity by its dimension, 1 for a curve or 2 for a surface, and its tag

OPTIONS = {
    "General.Terminal": 0.0,
    "General.NumThreads": 1.0,
    "General.AbortOnError": 2.0,  # an error raises an exception; with 0, a failed step returns like a successful one
    "Mesh.RandomSeed": 1.0,
    "Mesh.Algorithm": 6.0,  # Frontal-Delaunay
    "Mesh.Algorithm3D": 1.0,  # Delaunay
    "Mesh.ElementOrder": 1.0,
    "Mesh.Optimize": 1.0,
    "Mesh.MeshSizeMin": 0.0,
    "Mesh.MeshSizeExtendFromBoundary": 0.0,
    "Mesh.MeshSizeFromPoints": 0.0,
    "Mesh.MeshSizeFromCurvature": 0.0,
}

_CHANGED_BY_WRITING = ("General.Terminal", "Print.Format")  # options that change when the program's options are saved
_REINSTALL = "free memory, or install gmsh again"


class MeshError(RuntimeError):
    """A mesh cannot be made or must not be used. The message names the stage that failed, the reason, and a hint."""

    def __init__(self, stage: str, reason: str, hint: str) -> None:
        """Compose the message from the stage, the reason, and the hint that tells the user what to do."""
        super().__init__(f"mesh, stage {stage!r}: {reason}; {hint}")
        self.stage = stage
        self.reason = reason
        self.hint = hint

    def __reduce__(self) -> tuple[type["MeshError"], tuple[str, str, str], dict[str, object]]:
        """Support pickling, so that the error can be passed to another process."""
        return type(self), (self.stage, self.reason, self.hint), vars(self)


@contextmanager
def gmsh_session() -> Iterator[None]:
    """Provide gmsh with this project's options and an empty model, even if the calling program uses gmsh itself.

    If gmsh is not initialised, it is initialised here and finalised at the end. Otherwise a separate model is used, and
    the program's model and options are restored at the end. Raises MachineError if gmsh fails.
    """
    with _separate_model() if gmsh.isInitialized() else _initialised_gmsh():
        with stage("session", "check the option names against the installed gmsh"):
            for name, value in OPTIONS.items():
                gmsh.option.setNumber(name, value)
        yield


@contextmanager
def _initialised_gmsh() -> Iterator[None]:
    """Initialise gmsh, and finalise it at the end."""
    # With interruptible=True, gmsh would replace the signal handler for Ctrl-C. With configuration files, meshes would
    # differ between machines.
    with _preserved_signal_handlers(), stage("session", _REINSTALL):
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        yield
    finally:
        gmsh.finalize()


@contextmanager
def _separate_model() -> Iterator[None]:
    """Provide a separate model with gmsh's default options, for a program that uses gmsh itself.

    At the end, the model and the options of the program are restored.
    """
    with tempfile.TemporaryDirectory(prefix="twintip-") as folder:
        options = str(Path(folder) / "program.opt")
        with stage("session", _REINSTALL):
            model = gmsh.model.getCurrent()
            numbers = {name: gmsh.option.getNumber(name) for name in _CHANGED_BY_WRITING}
            gmsh.option.setNumber("General.Terminal", 0.0)
            gmsh.write(options)  # only the options that differ from gmsh's defaults
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
def _preserved_signal_handlers() -> Iterator[None]:
    """Restore Python's signal handlers at the end of a `with` block, because gmsh replaces them in C.

    A signal that arrives inside the block is handled at its end.
    """
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE)}
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, ())  # blocks no signal; it only returns the current mask
    try:
        signal.pthread_sigmask(signal.SIG_BLOCK, handlers)  # from here on, these signals wait
        yield
    finally:
        if threading.current_thread() is threading.main_thread():  # Python can set handlers only in the main thread
            for number, handler in handlers.items():
                if handler is not None:  # Python cannot restore a handler that was set in C
                    signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


@contextmanager
def stage(name: str, hint: str) -> Iterator[None]:
    """Convert an error raised by gmsh in the block into a MachineError that names this stage and hint.

    `name` is the stage of meshing, for example "generate", and `hint` tells the user what to do. All other errors are
    raised unchanged. An error from gmsh indicates a faulty installation or a lack of memory. Meshes of insufficient
    quality are detected by this project's own checks, which raise MeshError.
    """
    try:
        yield
    except Exception as error:
        # gmsh raises only Exception itself. An instance of a subclass comes from other code.
        if type(error) is not Exception:
            raise
        msg = f"mesh, stage {name!r}: gmsh says {str(error).strip() or 'nothing'!r}; {hint}"
        raise MachineError(msg) from error


def import_brep(write: Callable[[Path], object], hint: str) -> list[tuple[int, int]]:
    """Load a shape into gmsh as a BREP file, and return gmsh's (dimension, tag) of each imported entity.

    `write` writes the shape to a path. The file is kept in memory, because a file on disk would remain if the process
    were killed. `hint` says what to do if gmsh fails. The caller must then synchronise gmsh's model. Raises
    MachineError if gmsh fails.
    """
    with os.fdopen(os.memfd_create("shape.brep")) as in_memory, stage("import", hint):
        path = Path(f"/proc/self/fd/{in_memory.fileno()}")
        write(path)
        imported: list[tuple[int, int]] = gmsh.model.occ.importShapes(str(path), format="brep")
        return imported


def bounding_curves(surfaces: Iterable[int]) -> list[int]:
    """Return gmsh's tags of the curves that bound surfaces. A curve between two of the surfaces is listed twice."""
    boundary = gmsh.model.getBoundary([(SURFACE, tag) for tag in surfaces], combined=False, oriented=False)
    return [tag for _, tag in boundary]


@dataclass(frozen=True)
class Nodes:
    """The nodes of a mesh.

    `points` (3, n) [mm] are their positions. `index` maps each gmsh tag to the column of its node in `points`, and each
    unused tag to -1.
    """

    points: Floats
    index: Ints


def element_nodes(kind: str, order: int = 1, entity: int = -1) -> Ints:
    """Return gmsh's node tags (nodes, elements) of all elements of one kind, such as "Triangle".

    `order` is the polynomial order of the elements. If `entity`, the tag of a curve, surface or volume, is given, only
    the elements on it are returned.
    """
    element_type = gmsh.model.mesh.getElementType(kind, order)
    nodes_per_element = gmsh.model.mesh.getElementProperties(element_type)[3]
    tags = gmsh.model.mesh.getElementsByType(element_type, entity)[1]
    return np.asarray(tags, dtype=np.int64).reshape(-1, nodes_per_element).T


def used_nodes(elements: Ints) -> Nodes:
    """Return the nodes of the given elements in ascending order of their tags.

    `elements` (nodes, elements) holds gmsh's node tags. Nodes that none of them uses are left out.
    """
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    used_tags = np.unique(elements)
    # Both arrays below have one entry for each tag, from 0 to the largest.
    index = np.full(int(np.max(tags)) + 1, -1, dtype=np.int64)
    index[used_tags] = np.arange(len(used_tags))
    row_of_tag = np.empty_like(index)  # the row in gmsh's coordinate array, which is not sorted by tag
    row_of_tag[np.asarray(tags, dtype=np.int64)] = np.arange(len(tags))
    positions = np.reshape(coordinates, (-1, 3))[row_of_tag[used_tags]]
    return Nodes(np.ascontiguousarray(positions.T), index)


def index_by_nodes(facets: Ints, queries: Ints) -> Ints:
    """Find facets or edges by their nodes, and return their column indices in `facets`, shape (k,).

    `facets` (nodes, n) and `queries` (nodes, k) hold node indices, one facet or edge per column. The order of the nodes
    in a column does not matter. The index is -1 for a column of `queries` that is not in `facets`.
    """
    # The nodes of each column are sorted, so that the order of the nodes does not matter.
    nodes = np.sort(np.concatenate([facets, queries], axis=1), axis=0)
    # Columns with the same nodes get the same label.
    _, labels = np.unique(nodes, axis=1, return_inverse=True)
    facet_count = facets.shape[1]
    facet_labels, query_labels = labels[:facet_count], labels[facet_count:]
    facet_of_label = np.full(nodes.shape[1], -1, dtype=np.int64)  # -1 for a label that only a query has
    facet_of_label[facet_labels] = np.arange(facet_count)
    return facet_of_label[query_labels]
