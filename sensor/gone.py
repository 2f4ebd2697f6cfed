"""Keys, flags and presets of version 0.2 that were removed, with their replacements.

Error messages and the changelog use the same sentences.
"""

from collections.abc import Mapping

from sensor.quantity import InputError

_PRINTED = "Print the leaves; for springs that do not creep, set print.process = 'dmls-17-4ph'."
_SURFACE = "Use verdicts.geometry.as_designed, which compares whole surfaces."
_HALL = "Leave it out: [readout] has a Hall sensor at each shuttle."

REMOVED = {
    "print.leaves": _PRINTED,
    "print.leaf_measured_low_mm": "Give the printed thickness as print.leaf_thickness_low_mm, or leave it out.",
    "print.leaf_measured_high_mm": "Give the printed thickness as print.leaf_thickness_high_mm, or leave it out.",
    "print.clamp_mm": _PRINTED,
    "print.gauges": _HALL,
    "readout.transducer": _HALL,
    "readout.excitation_V": _HALL,
    "pipeline read --counts": "Read a press: a file with columns of counts.",
    "pipeline read --tare": "Read a press: its first ten samples are its tare.",
    "pipeline view --compare": "Write a page of each run with --html.",
    "pipeline view --pvd": "Write the fields at full travel with pipeline run --fields.",
    "pipeline run --contact-method": "Leave it out: one method solves every contact.",
    "pipeline design --contact-method": "Leave it out: one method solves every contact.",
    "python -m pipeline": "Use python -m twintip, or the command pipeline.",
    "behaviour.modes": "Use behaviour.low.natural_frequency_Hz and behaviour.high.natural_frequency_Hz.",
    "stale": "A folder belongs to one answer: a new one replaces all its files.",
    "verdicts.geometry.fillets": _SURFACE,
    "verdicts.geometry.tips": _SURFACE,
    "verdicts.geometry.sockets": _SURFACE,
    "verdicts.geometry.plate_holes": _SURFACE,
    "verdicts.geometry.cover_holes": _SURFACE,
    "verdicts.geometry.mount_holes": _SURFACE,
    "verdicts.geometry.step_round_trip": _SURFACE,
    "verdicts.geometry.same_volume": _SURFACE,
    "preset fruit": "Use the preset of one fruit, or find a design by pipeline suggest --fruit.",
}
"""Removed names, each with a sentence that says what to use instead."""
INEFFECTIVE_VALUES = {"print.leaves": "printed", "print.gauges": "none", "readout.transducer": "displacement"}
"""Removed keys of a design file, each with the value that had no effect in 0.2.

A key with this value is accepted in a design file, but it is not written again.
"""
REPORT_KEYS = (
    *("behaviour.modes", "stale"),
    *(name for name in REMOVED if name.startswith("verdicts.")),
    *("housing.gauges", "behaviour.gauge_factor", "behaviour.gauge_grid_mm", "behaviour.gauges"),
    *(f"behaviour.{arm}.bridge_{key}" for arm in ("low", "high") for key in ("mV_per_V", "error_percent")),
    *(f"read_out.signal.{key}" for key in ("transducer", "mV_per_V", "self_heating_K", "self_heating_percent")),
)
"""Keys that report.json had in version 0.2 and that were removed. They are ignored when a report is read."""


def refuse_removed(*names: str) -> None:
    """Raise InputError if one of these names was removed. The message says what to use instead."""
    for name in names:
        if name in REMOVED:
            msg = f"{name} was removed in 0.3. {REMOVED[name]}"
            raise InputError(msg, field=name, bound="left out")


def refuse_removed_key(key: str) -> None:
    """Raise InputError if a key of report.json, or a table that contains it, was removed and has a replacement.

    The message says what to use instead. Nothing is raised for a removed key without a replacement.
    """
    for removed_key in REPORT_KEYS:
        if f"{key}.".startswith(f"{removed_key}."):  # the key itself, or a key in a removed table
            refuse_removed(removed_key)


def drop_ineffective_keys(table: str, values: Mapping[str, object]) -> Mapping[str, object]:
    """Return the keys and values of a table of a design, without removed keys whose value had no effect in 0.2."""
    # The Ellipsis is not equal to any value in a file, so a key without an entry in INEFFECTIVE_VALUES is returned.
    return {key: value for key, value in values.items() if value != INEFFECTIVE_VALUES.get(f"{table}.{key}", ...)}
