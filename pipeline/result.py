"""What a run returns: every number, verdict and error of a sensor, typed and frozen."""

from dataclasses import dataclass

from cad.design.parameters import Design
from cad.verdict import Verdict, all_passed
from pipeline.options import RunOptions
from pipeline.stages.characteristics import SpringBehaviour
from pipeline.stages.response import ScenePress
from pipeline.stages.sizing import SpringSizing
from pipeline.stages.springs import FittedSprings
from pipeline.storage.stopwatch import Seconds
from pipeline.uncertainty.budget import Budgets
from pipeline.uncertainty.print_scatter import ScatterBands
from solve.fruit.compliance import FruitCompliance


@dataclass(frozen=True, kw_only=True)
class SensorResult:
    """A design with what each stage of its run has found; `scatter` only where fabrication was asked for.

    `paper` are the verdicts on the paper's own springs, None where fruit or tips are not the paper's. `seconds` are
    wall and processor seconds by stage. `left_out` says why a file of fields is not there.
    """

    design: Design
    options: RunOptions
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings
    press: ScenePress
    behaviour: SpringBehaviour | None
    verdicts: tuple[Verdict, ...]
    paper: tuple[Verdict, ...] | None
    budgets: Budgets
    scatter: ScatterBands | None
    left_out: str | None
    seconds: Seconds

    @property
    def passed(self) -> bool | None:
        """Say whether every verdict passed; None when one is undecided and none failed."""
        return all_passed(self.verdicts)
