"""What decides the results of a study, as its store keeps it, and what sets two studies apart."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from cad.quantity import InputError
from pipeline.storage.plain import Plain, to_plain
from pipeline.storage.versions import code_digest
from pipeline.study.study_file import Study

_PACKAGES = ("twintip", "numpy", "scipy", "scikit-fem", "gmsh", "cadquery")


def refuse_other(path: Path, kept: Plain | None, asked: Plain) -> None:
    """Raise InputError that names the difference where a store holds another study; a longer one may go on."""
    if kept is None:
        return
    for place, before, now in _differences("", kept, asked):
        if place in _grows(asked) and isinstance(before, int) and isinstance(now, int) and now >= before:
            continue
        remedy = "change it back, or name another --out"
        msg = f"{place} = {_short(now)}: must be {_short(before)}, as in {path}; {remedy}"
        raise InputError(msg)


def _grows(asked: Plain) -> tuple[str, ...]:
    """Return the keys that may grow: the points of a longer study begin with those of the shorter one.

    Those of sensitivities do not: their numbers count blocks of `samples`.
    """
    return ("goal.evaluations",) if asked["how"] == "sensitivity" else ("goal.evaluations", "samples")


def study_facts(study: Study) -> Plain:
    """Return what decides the results of a study."""
    vary = {key: {"kind": type(varied).__name__, **asdict(varied)} for key, varied in study.vary.items()}
    plain: Plain = {
        "base": study.base,
        "vary": vary,
        "order": list(study.vary),
        "wanted": list(study.wanted),
        "goal": to_plain(study.goal),
        **{name: getattr(study, name) for name in ("how", "samples", "seed", "tol", "level", "contact", "audit")},
        "rows": [list(row) for row in study.rows],
        "versions": {name: version(name) for name in _PACKAGES},
        "code": code_digest()[:16],
    }
    facts: Plain = json.loads(plain_json(plain))
    return facts


def _differences(place: str, before: object, now: object) -> Iterator[tuple[str, object, object]]:
    """Yield each dotted place where two trees of plain data differ, with both values; None stands for nothing there."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in (*before, *(key for key in now if key not in before)):
            yield from _differences(f"{place}.{key}" if place else key, before.get(key), now.get(key))
    elif before != now:
        yield place, before, now


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."  # noqa: PLR2004 - of one line


def plain_json(value: object) -> str:
    """Return a value as JSON; raises TypeError for what is no plain data, ValueError for a number not finite."""
    return json.dumps(value, allow_nan=False, default=_as_list)


def _as_list(value: object) -> object:
    if isinstance(value, Mapping):
        return dict(value)
    msg = f"{type(value).__name__}: must be plain data; turn it into some first"
    raise TypeError(msg)
