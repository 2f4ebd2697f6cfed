"""The errors that a piece of work ends with in another process, and how they come back from there."""

import pickle
import traceback

FAILURES = (
    RuntimeError, ValueError, ArithmeticError, LookupError, TypeError, AttributeError, OSError, MemoryError,
    AssertionError, ImportError, EOFError,
)  # fmt: skip
# Every class that a solve can raise, of libraries too: a point that meets a rare fault must not stop a million others.
# MeshError and SolveError are RuntimeErrors; ExportError, SplitDomainError and LinAlgError are ValueErrors.


def sendable(error: Exception) -> Exception:
    """Return an error, or its words as a RuntimeError where it cannot be rebuilt at the other end of a pipe."""
    try:
        pickle.loads(pickle.dumps(error))
    except (pickle.PickleError, *FAILURES):
        return RuntimeError(repr(error))
    return error


def with_trace(error: Exception) -> Exception:
    """Return an error that carries the lines it came from as a note, which its one-line message leaves out."""
    error.add_note("".join(traceback.format_exception(error)))
    return error
