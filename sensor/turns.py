"""A lock that lets one thread at a time use libraries with settings and work arrays that a whole process shares."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

_TURN = threading.RLock()  # a function that takes turns may call another one


@contextmanager
def in_turn() -> Iterator[None]:
    """Let only one thread at a time run the functions decorated with `@in_turn()`; other threads wait.

    Threads share gmsh's session, OCCT's settings and CadQuery's imports. SciPy's `lu_solve` changes the pivots of a
    cached factor while it uses them, so two threads at once would get NaN or a different last digit.
    """
    with _TURN:
        yield
