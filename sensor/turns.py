"""A lock for libraries whose settings and work arrays are shared by all threads of a process."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

_TURN = threading.RLock()  # reentrant, because a decorated function may call another one


@contextmanager
def in_turn() -> Iterator[None]:
    """Let only one thread at a time run the functions decorated with `@in_turn()`; other threads wait.

    The lock is needed because threads share gmsh's session, OCCT's settings and CadQuery's imports. Also, SciPy's
    `lu_solve` changes the pivots of a cached factorisation during a solve. Two simultaneous solves would return nan or
    different last digits.
    """
    with _TURN:
        yield
