"""What only some points of a study need, imported when the first of them comes: solids, their meshes, whole runs."""

from pathlib import Path

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Tips
from pipeline.storage.plain import Plain
from pipeline.study.report_keys import Level
from solve.fruit.compliance import FruitCompliance


def direct_solve(fruit: Fruit, tips: Tips) -> FruitCompliance:
    """Return the compliance [1/mm] under a flat pair by direct finite elements."""
    from pipeline.response.contact import direct_contact

    return direct_contact(fruit, tips)


def solved_report(design: Design, level: Level, tolerance: float, out: Path | None) -> Plain:
    """Return what report.json would say of a design with its springs solved to a relative tolerance [1].

    At the level "files" it is the whole run, whose files stand in `out`.
    """
    from pipeline.study.levels.solved import fitted_report, whole_report

    return fitted_report(design, tolerance) if level == "flexures" else whole_report(design, tolerance, out)
