"""Values of a study file, each of the kind that its key has."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from cad.quantity import InputError, nearest, validation_error


def refuse_unknown_keys(given: Iterable[str], known: Sequence[str], *, table: str = "", of_what: str = "") -> None:
    """Raise InputError for the first key that is not known, with the nearest one that is."""
    for key in given:
        if key not in known:
            msg = (
                f"{table}{key}: unknown key{of_what}; must be one of {', '.join(known)}; "
                f"did you mean {nearest(key, known)}?"
            )
            raise InputError(msg)


def texts(name: str, given: object) -> list[str]:
    """Return a list of texts; raises InputError that names the key."""
    if not isinstance(given, list | tuple) or not all(isinstance(word, str) for word in given):
        raise validation_error(name, str(given), "", "a list of texts", 'for instance ["springs.K_l_N_per_m"]')
    return [str(word) for word in given]


def text_at(data: Mapping[str, Any], name: str, default: str) -> str:
    """Return a text that is not empty; raises InputError that names the key."""
    value = data.get(name, default)
    if not isinstance(value, str) or not value:
        raise validation_error(name, str(value), "", "text", "write it in quotes")
    return value


def whole_at(data: Mapping[str, Any], name: str, default: int) -> int:
    """Return a whole number [unit of the key]; raises InputError that names the key."""
    value = data.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise validation_error(name, str(value), "", "a whole number", "write it without a point")
    return value


def real_at(data: Mapping[str, Any], name: str, default: float) -> float:
    """Return a number [unit of the key]; raises InputError that names the key."""
    value = data.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise validation_error(name, str(value), "", "a number", f"the default is {default:g}")
    return float(value)
