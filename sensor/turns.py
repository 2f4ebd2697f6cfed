"""A lock that lets one thread at a time use libraries with settings and work arrays that a whole process shares."""

import functools
import threading
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
_TURN = threading.RLock()  # a function that takes turns may call another one


def in_turn(function: Callable[P, R]) -> Callable[P, R]:
    """Let only one thread at a time run the functions with this decorator; other threads wait.

    Threads share gmsh's session, OCCT's settings and CadQuery's imports. SciPy's `lu_solve` changes the pivots of a
    cached factor while it uses them: two threads got NaN, or a different last digit.
    """

    @functools.wraps(function)
    def take_turn(*arguments: P.args, **named: P.kwargs) -> R:
        with _TURN:
            return function(*arguments, **named)

    return take_turn
