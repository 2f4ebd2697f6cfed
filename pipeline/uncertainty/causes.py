"""What moves a number beside its numerical error: effects that the model leaves out, and the scatter of the inputs."""

from collections.abc import Iterable, Sequence

from pipeline.uncertainty.cause import Cause, Sensor
from pipeline.uncertainty.fruit_causes import flesh_effects, fruit_and_pose, skin_effects, tip_scatter
from pipeline.uncertainty.spring_causes import other_mount, print_causes, spring_effects

CALIBRATED = 0.01  # of each stiffness: what weighing a printed unit reaches
ZEROED_MM = 0.01  # what zeroing on a flat plate leaves between the heights of two tips: a judgement


def model_causes(sensor: Sensor, travel: float, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what the model leaves out at a travel [mm] where the springs give that far [mm]."""
    return (
        *spring_effects(sensor, gives),
        *other_mount(sensor.mounts),
        *flesh_effects(sensor.design, travel, gives),
        *skin_effects(sensor, travel),
    )


def input_causes(sensor: Sensor, travel: float, gives: Sequence[float]) -> tuple[Cause, ...]:
    """Return what is not known of the inputs, two sigma, at a travel [mm] where the springs give that far [mm]."""
    design, radius = sensor.design, sensor.springs.edge_radius(sensor.design.tips)
    return *print_causes(sensor), *tip_scatter(design, radius, travel, gives), *fruit_and_pose(sensor)


def calibrated_causes(causes: Iterable[Cause]) -> tuple[Cause, ...]:
    """Return what is left of inputs after calibrating a unit: each stiffness known to 1 %, the tips zeroed."""
    reason = f"known to {100.0 * CALIBRATED:g} %"
    zeroed = f"tips zeroed on a flat plate to {ZEROED_MM:g} mm"
    return (
        *(cause for cause in causes if not cause.calibrated),
        Cause(effect="low spring", reason=reason, springs=(CALIBRATED, 0.0)),
        Cause(effect="high spring", reason=reason, springs=(0.0, CALIBRATED)),
        Cause(effect="tip height", reason=zeroed, lead=(-0.5 * ZEROED_MM, 0.5 * ZEROED_MM)),
    )
