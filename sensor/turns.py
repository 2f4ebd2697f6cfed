"""Threads of a program take turns: the libraries below keep settings and work arrays that all of a process share."""

import functools
import threading
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
_TURN = threading.RLock()  # a function that takes turns may call another one


def in_turn(function: Callable[P, R]) -> Callable[P, R]:
    """Let one thread at a time be inside the functions that are decorated so; the others wait.

    Threads share gmsh's session, OCCT's settings and CadQuery's imports. SciPy's `lu_solve` changes the pivots of a
    factor that is kept while it uses them: two threads got NaN, or another last digit.
    """

    @functools.wraps(function)
    def take_turn(*arguments: P.args, **named: P.kwargs) -> R:
        with _TURN:
            return function(*arguments, **named)

    return take_turn
