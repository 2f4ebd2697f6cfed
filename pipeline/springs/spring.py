"""One spring of a sensor, as required and as printed. The fields are keys of report.json."""

from dataclasses import dataclass

from sensor.quantity import report_field
from sensor.theory.leaf_spring import Flexure


@dataclass(frozen=True, kw_only=True)
class MadeSpring:
    """One spring, with stiffnesses in N/mm and errors as fractions; if it is not printed, only its target is set."""

    target: float = report_field(
        "N/m", "stiffness that the targets or the design require", key="target_N_per_m", times=1e3
    )
    K: float | None = report_field(
        "N/m",
        "stiffness in the exported housing, by finite elements; null if no housing is made",
        key="stiffness_N_per_m",
        times=1e3,
        default=None,
    )
    K_error: float | None = report_field(
        "%", "half width of the error bar of the stiffness", key="error_percent", times=100.0, default=None
    )
    flexure: Flexure | None = report_field(
        "", "dimensions of the leaves; null if they are not made", key="dimensions_mm", default=None
    )
    root_strain: float | None = report_field(
        "1",
        "largest strain of a leaf, at its root, at full travel on the firmest fruit. Above the strain limit "
        "of the material, the leaf breaks or stays bent",
        default=None,
    )
    root_strain_error: float | None = report_field(
        "%",
        "half width of the error bar of the strain",
        key="root_strain_error_percent",
        times=100.0,
        default=None,
    )
    safety_factor: float | None = report_field(
        "1",
        "strain limit of the material divided by the root strain; above 1 the leaf does not fail",
        default=None,
    )
    dofs: int | None = report_field("1", "number of unknowns of the mesh", default=None)
    seconds: float | None = report_field("s", "wall time of the fit of both springs", level="", default=None)

    @property
    def stiffness(self) -> float:
        """Return the stiffness by finite elements [N/mm], or the target if the spring is not printed."""
        return self.target if self.K is None else self.K

    @property
    def error(self) -> float:
        """Return the error of the stiffness [N/mm]; 0 for a target."""
        # `K_error` is None if the spring is not printed. It is then treated as 0.
        return self.stiffness * (self.K_error or 0.0)

    @property
    def highest_strain(self) -> float:
        """Return the upper end of the error bar of the root strain [1]; 0 if the spring is not printed."""
        # The strain and its error are None if the spring is not printed. They are then treated as 0.
        return (self.root_strain or 0.0) * (1.0 + (self.root_strain_error or 0.0))
