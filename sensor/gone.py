"""Keys, flags and files of 0.2 that are gone, each with what to use: refusals and the changelog say the same words."""

from sensor.quantity import InputError

GONE = {
    "pipeline read --counts": "Read a press: a file with columns of counts.",
    "pipeline read --tare": "Read a press: its first ten samples are its tare.",
    "pipeline view --compare": "Write a page of each run with --html.",
    "pipeline view --pvd": "Write the fields at full travel with pipeline run --fields.",
}
"""What to use in place of each."""


def refusal(name: str) -> InputError:
    """Return the error for a name of GONE."""
    return InputError(f"{name} is gone since 0.3. {GONE[name]}", field=name, bound="left out")
