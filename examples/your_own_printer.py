"""Your own printer: a process file with your measurements, and its effect on the springs.

my_printer.toml describes a printer with a 0.6 mm nozzle. Its walls are thicker, so the leaves must be longer.
"""

from pathlib import Path

import twintip

OWN = Path(__file__).with_name("my_printer.toml")


def print_leaves(title: str, changes: dict[str, object]) -> None:
    """Evaluate the default design with changes, and print the leaves of both springs and the verdicts."""
    result = twintip.evaluate(twintip.load_design("paper", changes))
    for name, spring in result.springs.springs.items():
        leaf = spring.flexure
        print(f"{title:12} {name:4} leaf {leaf.length:6.2f} x {leaf.thickness:.1f} x {leaf.depth:g} mm")
    failed = [verdict.name for verdict in result.verdicts if not verdict.passed]
    print(f"{title:12} {'all verdicts pass' if result.passed else 'not passed: ' + ', '.join(failed)}")


print_leaves("fdm-petg", {})
print_leaves("my-printer", {"print.process_file": str(OWN)})
