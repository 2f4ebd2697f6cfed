"""Keys, flags and files of 0.2 that are gone, each with what to use: refusals and the changelog say the same words."""

from sensor.quantity import InputError

GONE = {
    "pipeline read --counts": "Read a press: a file with columns of counts.",
    "pipeline read --tare": "Read a press: its first ten samples are its tare.",
    "pipeline view --compare": "Write a page of each run with --html.",
    "pipeline view --pvd": "Write the fields at full travel with pipeline run --fields.",
    "preset fruit": "Take the preset of one fruit, or find a design by pipeline suggest --fruit.",
}
"""What to use in place of each."""


def refuse_gone(name: str) -> None:
    """Raise InputError, which says what to use, for a name of GONE."""
    if name in GONE:
        msg = f"{name} is gone since 0.3. {GONE[name]}"
        raise InputError(msg, field=name, bound="left out")
