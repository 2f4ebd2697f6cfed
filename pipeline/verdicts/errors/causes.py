"""What moves a number beside its numerical error: effects that the model leaves out, and the scatter of the inputs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pipeline.verdicts.errors.cause import Cause, Sensor
from pipeline.verdicts.errors.fruit_causes import flesh_effects, fruit_and_pose, skin_effects, tip_scatter
from pipeline.verdicts.errors.spring_causes import other_mount, print_causes, spring_effects

CALIBRATED = 0.01  # of each stiffness: what weighing a printed unit reaches
ZEROED_MM = 0.01  # what zeroing on a flat plate leaves between the heights of two tips: a judgement


@dataclass(frozen=True)
class Causes:
    """What the model leaves out, and what is not known of the inputs, two sigma."""

    model: tuple[Cause, ...]
    input: tuple[Cause, ...]

    def that_move(self, what: Literal["springs", "fruit"]) -> "Causes":
        """Return those that move the springs, or the fruit."""
        model, inputs = (
            tuple(cause for cause in causes if any(getattr(cause, what))) for causes in (self.model, self.input)
        )
        return Causes(model, inputs)

    def after_calibration(self) -> "Causes":
        """Return what calibrating a unit leaves: each stiffness known to 1 %, the tips zeroed."""
        model, inputs = (
            tuple(cause for cause in causes if not cause.calibrated) for causes in (self.model, self.input)
        )
        return Causes(model, (*inputs, *_CALIBRATED_UNIT))


_REASON = f"known to {100.0 * CALIBRATED:g} %"
_CALIBRATED_UNIT = (
    Cause(effect="low spring", reason=_REASON, springs=(CALIBRATED, 0.0)),
    Cause(effect="high spring", reason=_REASON, springs=(0.0, CALIBRATED)),
    Cause(
        effect="tip height",
        reason=f"tips zeroed on a flat plate to {ZEROED_MM:g} mm",
        lead=(-0.5 * ZEROED_MM, 0.5 * ZEROED_MM),
    ),
)


def causes_of(sensor: Sensor, travel: float, gives: Sequence[float]) -> Causes:
    """Return what moves the numbers of a sensor at a travel [mm] where its springs give that far [mm]."""
    design, radius = sensor.design, sensor.springs.edge_radius(sensor.design.tips)
    return Causes(
        model=(
            *spring_effects(sensor, gives),
            *other_mount(sensor.mounts),
            *flesh_effects(design, travel, gives),
            *skin_effects(sensor, travel),
        ),
        input=(*print_causes(sensor), *tip_scatter(design, radius, travel, gives), *fruit_and_pose(sensor)),
    )
