"""The keys of report.json that a study may ask for, and from one table what each of them has to be solved for."""

from collections.abc import Iterable, Sequence
from typing import Literal

from cad.design.tips import Tips
from cad.quantity import InputError, nearest
from pipeline.report.mapping import SIZED_KEYS
from pipeline.storage.plain import Plain

Stage = Literal["sizing", "level", "printable", "targets", "response", "reading", "flexures", "files"]
Level = Literal["contact", "flexures", "files"]

LEVELS: tuple[Level, ...] = ("contact", "flexures", "files")
"""By what they cost: closed forms and contact; springs fitted by finite elements; a whole run with its files."""

_SPRINGS = Tips().names
_VERDICT_FIELDS = ("value", "error", "limit", "tolerance", "passed")
_CONTACT = ("error_percent", "s11_error_percent", "method", "dofs", "K_m_over_E_mm", "compliance_per_mm")
_SPRING = (
    "target_N_per_m", "stiffness_N_per_m", "error_percent", "root_strain", "root_strain_error_percent", "safety_factor",
    "dofs", "dimensions_mm",
)  # fmt: skip
_READING = (
    "E_bias_percent",
    "E_bias_error_percent",
    "uncertainty_percent",
    "lift_deg",
    "noise_for_10_percent",
    "refused",
    "moduli",
    "skin_pressure",
)

TABLE: tuple[tuple[str, tuple[str, ...], Stage], ...] = (
    ("springs", (*SIZED_KEYS, "K_m_max_N_per_m", "K_m_over_E_mm"), "sizing"),
    ("contact", _CONTACT, "sizing"),
    ("level", ("P_max", "P_max_error", "NL", "NL_error"), "level"),
    ("verdicts.P_max", _VERDICT_FIELDS, "targets"),
    ("verdicts.NL", _VERDICT_FIELDS, "targets"),
    *((f"verdicts.printable.{name}", _VERDICT_FIELDS, "printable") for name in _SPRINGS),
    ("verdicts.P_displacement_independent", _VERDICT_FIELDS, "response"),
    ("verdicts.P_monotonic", _VERDICT_FIELDS, "response"),
    ("verdicts.geometry.tip_face", _VERDICT_FIELDS, "response"),
    ("verdicts.geometry.tip_shape", _VERDICT_FIELDS, "response"),
    ("verdicts.bruise", _VERDICT_FIELDS, "reading"),
    ("verdicts.reading.bias", _VERDICT_FIELDS, "reading"),
    ("verdicts.reading.uncertainty", _VERDICT_FIELDS, "reading"),
    ("verdicts.reading.lift", _VERDICT_FIELDS, "reading"),
    ("reading", _READING, "reading"),
    ("response", (), "response"),
    *((f"verdicts.{key.removesuffix('_N_per_m')}", _VERDICT_FIELDS, "flexures") for key in SIZED_KEYS),
    *((f"flexures.{name}", _SPRING, "flexures") for name in _SPRINGS),
    ("deflections_mm", (), "flexures"),
    ("behaviour", (), "files"),
    ("errors", (), "files"),
    ("paper", (), "files"),
    ("verdicts.geometry", (), "files"),
    ("verdicts.fit", (), "files"),
    ("passed", (), "files"),
)
"""Each part of report.json with its keys, any key below it where none is listed, and the stage that gives it."""

_LEVEL_OF: dict[Stage, Level] = {
    "sizing": "contact", "level": "contact", "printable": "contact", "targets": "contact", "response": "contact",
    "reading": "contact", "flexures": "flexures", "files": "files",
}  # fmt: skip


def stage_of(key: str) -> Stage:
    """Return the stage that gives a key of report.json; raises InputError that names the nearest known key."""
    for part, names, stage in TABLE:
        rest = key[len(part) + 1 :]
        if key == part and not names:
            return stage
        if key.startswith(f"{part}.") and (not names or rest.split(".")[0] in names):
            return stage
    known = known_keys()
    msg = f"{key}: unknown key of report.json; must be one of docs/studies.md; did you mean {nearest(key, known)}?"
    raise InputError(msg)


def known_keys() -> tuple[str, ...]:
    """Return every key that is listed by name."""
    return tuple(f"{part}.{name}" if name else part for part, names, _ in TABLE for name in names or ("",))


def stages_of(keys: Iterable[str]) -> frozenset[Stage]:
    """Return the stages that some keys need."""
    return frozenset(stage_of(key) for key in keys)


def level_of(keys: Iterable[str]) -> Level:
    """Return the cheapest level that gives all keys."""
    return max((_LEVEL_OF[stage] for stage in stages_of(keys)), key=LEVELS.index, default="contact")


def refuse_unknown(name: str, keys: Sequence[str]) -> None:
    """Raise InputError that names the list and the nearest known key, where a key is not one of report.json."""
    try:
        stages_of(keys)
    except InputError as error:
        msg = f"{name} {error}"
        raise InputError(msg) from error


def value_at_key(report: Plain, key: str) -> object:
    """Return the number, text or truth value at a dotted key; verdicts are found by name, lists by place from 0.

    Raises InputError where this design's report has no such key.
    """
    found: object = report
    words = key.split(".")
    if words[0] == "verdicts":
        name, field = ".".join(words[1:-1]), words[-1]
        rows = [row for row in report.get("verdicts", []) if row["name"] == name]
        if rows and field in rows[0]:
            return _scalar(key, rows[0][field])
        raise _absent(key)
    for word in words:
        if isinstance(found, dict) and word in found:
            found = found[word]
        elif isinstance(found, list) and word.isdigit() and int(word) < len(found):
            found = found[int(word)]
        else:
            raise _absent(key)
    return _scalar(key, found)


def _scalar(key: str, value: object) -> object:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    msg = f"wanted {key}: must be one number or text, and it is a list or a table; add the next key or the place in it"
    raise InputError(msg)


def _absent(key: str) -> InputError:
    msg = f"wanted {key}: must be in the report of this design, and it is not; ask for another key or change the base"
    return InputError(msg)
