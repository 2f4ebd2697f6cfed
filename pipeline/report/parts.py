"""Parts of report.json whose keys differ from the results of the stages; `from_stage` converts a result.

A program that only reads reports can import this file without importing the stages.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from pipeline.reading.read_out import Matrix
from pipeline.reading.reading_records import CalibrationErrors, Moment, SkinPressure, UnevenFruit
from pipeline.report.response_table import band_columns, force_columns, numbers
from sensor.arrays import Floats, rows_of
from sensor.quantity import report_field
from sensor.theory.two_spring_law import PAPER_SPRINGS
from sensor.verdict import Verdict
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance, SkinTable

if TYPE_CHECKING:
    from pipeline.errors.sensor_errors import ReadingTable
    from pipeline.reading.analysis import ModulusAccuracy, ReadingAccuracy
    from pipeline.reading.reading_over_time import ReadingOverTime
    from pipeline.springs.leaf_lengths import FittedHousing
    from pipeline.springs.sizing import SpringSizing
    from sensor.design.processes import Process
    from sensor.design.tips import Tips
    from solve.contact.linear_response import SensorResponse

Numbers = tuple[float | None, ...]
"""Numbers as a function of travel or modulus; None if a tip is out of contact, or if a bound does not exist."""


@dataclass(frozen=True, kw_only=True)
class SizingReport:
    """The springs as sized, and the fruit stiffness used to size them."""

    K_l_N_per_m: float = report_field("N/m", "stiffness of the low spring, from the targets or from the design")
    K_h_N_per_m: float = report_field("N/m", "stiffness of the high spring, from the targets or from the design")
    K_m_max_N_per_m: float = report_field(
        "N/m", "stiffness of the firmest fruit under one tip, from which the springs were sized"
    )
    K_m_over_E_mm: float = report_field("mm", "`K_m_max_N_per_m` divided by the modulus of the firmest fruit")
    fruit_stiffness: str = report_field("", "`contact`: from the solved contact; `hayes`: from the paper's formula (6)")
    beam_law_leaves_mm: tuple[float, ...] | None = report_field(
        "mm",
        "length of the leaves of the low and of the high spring by the beam law; the printed leaves are up to 15 % "
        "longer or shorter. It is null for tips without a housing",
        default=None,
        since="0.3",
    )

    @classmethod
    def from_stage(cls, sizing: "SpringSizing", beam_law_leaves_mm: tuple[float, ...] | None) -> Self:
        """Return the sized springs in the units of report.json, with the lengths of their leaves [mm].

        The lengths are None for tips without a housing.
        """
        return cls(
            K_l_N_per_m=1e3 * sizing.springs.K_l,  # the stage has N/mm
            K_h_N_per_m=1e3 * sizing.springs.K_h,
            K_m_max_N_per_m=1e3 * sizing.K_m_max,
            K_m_over_E_mm=sizing.K_m_over_E,
            fruit_stiffness=sizing.basis,
            beam_law_leaves_mm=beam_law_leaves_mm,
        )


@dataclass(frozen=True, kw_only=True)
class MaterialReport:
    """The material of the print process."""

    name: str = report_field("", "name of the material")
    E_MPa: float = report_field("MPa", "modulus of the material")
    poisson: float = report_field("1", "Poisson's ratio of the material")
    process: str = report_field("", "name of the print process")

    @classmethod
    def from_stage(cls, process: "Process") -> Self:
        """Return the material of a print process."""
        return cls(name=process.material, E_MPa=process.E_MPa, poisson=process.poisson, process=process.name)


@dataclass(frozen=True, kw_only=True)
class SkinReport:
    """The compliance of a fruit with a skin; each matrix has the shape (tips, tips)."""

    E_MPa: tuple[float, ...] = report_field("MPa", "moduli of the flesh")
    compliance_per_mm: tuple[Matrix, ...] = report_field(
        "1/mm", "compliance of the fruit with its skin at each of these moduli, times E"
    )


@dataclass(frozen=True, kw_only=True)
class ContactReport:
    """The compliance (tips, tips) of the fruit under its tips, with its errors and its cost."""

    error_percent: float = report_field("%", "half width of the error bar of s11 - s12")
    s11_error_percent: float = report_field("%", "half width of the error bar of s11")
    method: str = report_field("", "solver of the contact: `split` (singularity subtraction)")
    dofs: int = report_field("1", "number of unknowns of the mesh")
    seconds: float = report_field("s", "wall time of the solution", level="")
    status: str = report_field("", "a sentence on how the compliance was solved")
    compliance_per_mm: Matrix = report_field(
        "1/mm",
        "rows of the compliance matrix S: indentation of tip i per force on tip j, times E; tips in the "
        "order of `tips`",
    )
    K_m_over_E_mm: float = report_field("mm", "stiffness of the fruit under one tip divided by E, 1 / (s11 - s12)")
    skin: SkinReport | None = report_field(
        "",
        "the compliance with the skin, only for a fruit with a skin; `compliance_per_mm` is then for "
        "the flesh without skin",
        default=None,
        left_out=True,
    )

    @classmethod
    def from_stage(cls, contact: FruitCompliance) -> Self:
        """Return the compliance that the contact stage solved, with its errors in per cent and its cost.

        The method `compliance` converts it back.
        """
        skin = None
        if contact.skin is not None:
            matrices = tuple(rows_of(S) for S in contact.skin.S)
            skin = SkinReport(E_MPa=tuple(contact.skin.E.tolist()), compliance_per_mm=matrices)
        info = contact.info
        return cls(
            error_percent=100.0 * contact.difference_error,  # relative error of s11 - s12
            s11_error_percent=100.0 * contact.s11_error,  # relative error of s11
            method=info.method,
            dofs=info.dofs,
            seconds=info.seconds,
            status=info.status,
            compliance_per_mm=rows_of(contact.S),
            K_m_over_E_mm=contact.K_m_over_E(),
            skin=skin,
        )

    def compliance(self, tips: tuple[str, ...]) -> FruitCompliance:
        """Return the compliance of the fruit times E [1/mm] with its relative errors [1], the inverse of `from_stage`.

        `tips` are the names of the tips. The status of the solution becomes "read from report.json".
        """
        skin = None
        if self.skin is not None:
            skin = SkinTable(E=np.array(self.skin.E_MPa), S=np.array(self.skin.compliance_per_mm))
        return FruitCompliance(
            skin=skin,
            tips=tips,
            S=np.array(self.compliance_per_mm),
            difference_error=0.01 * self.error_percent,
            s11_error=0.01 * self.s11_error_percent,
            info=SolveInfo(method=self.method, dofs=self.dofs, seconds=self.seconds, status="read from report.json"),
        )


@dataclass(frozen=True, kw_only=True)
class ResponseReport:
    """The response at one modulus, as a function of the travel.

    `F_N` has a row for each tip; it is empty for a pair.
    """

    E_MPa: float = report_field("MPa", "modulus of the fruit")
    x_mm: tuple[float, ...] = report_field(
        "mm",
        "travel of the middle of the tips, from the first step above 0 to `press.travel_mm`; 0 is where a level "
        "sensor first touches, whatever the tilt",
    )
    P: Numbers = report_field("1", "force ratio; null if a tip is off the fruit")
    F_l_N: Numbers = report_field(
        "N", "force on the low tip at each travel; for other layouts the mean over the low tips"
    )
    F_h_N: Numbers = report_field(
        "N", "force on the high tip at each travel; for other layouts the mean over the high tips"
    )
    slope_ratio: Numbers = report_field(
        "1",
        "slope of the high force against the travel, divided by the slope of the low force; null if a tip is "
        "off the fruit. Once the two faces are in full contact, it does not depend on which tip touched first, "
        "unlike P",
    )
    F_error_percent: Numbers = report_field("%", "half width of the error bar of the forces")
    P_error_percent: Numbers = report_field("%", "half width of the error bar of P")
    F_N: tuple[Numbers, ...] = report_field(
        "N", "force of each tip at each travel; left out for a pair of tips", default=(), left_out=True
    )

    @classmethod
    def rows(cls, table: "SensorResponse", tips: "Tips", spring_errors: Sequence[Floats]) -> tuple[Self, ...]:
        """Return the response for each modulus of a table of forces.

        `spring_errors` has a row (tips,) for each modulus. It holds the relative error of each tip's force [1] due to
        the numerical error of the spring stiffness. The error of the forces is one number for all tips, so it includes
        the maximum of the row. P is a ratio of forces, whose errors add up, so its error includes the sum of the row.
        """
        columns = force_columns(table, tips) | {"slope_ratio": table.slope_ratio}  # arrays (moduli, travels)
        rows = []
        for i, (E, spring_error) in enumerate(zip(table.E.tolist(), spring_errors, strict=True)):
            columns_over_travel: dict[str, Any] = {name: numbers(grid[i]) for name, grid in columns.items()}
            columns_over_travel["E_MPa"] = E  # one number instead of a column of equal moduli
            row = cls(
                **columns_over_travel,
                F_error_percent=numbers(100.0 * (table.F_error[i] + spring_error.max())),
                P_error_percent=numbers(100.0 * (table.P_error[i] + spring_error.sum())),
                F_N=tuple(numbers(table.F[i, :, tip]) for tip in tips.own_columns),
            )
            rows.append(row)
        return tuple(rows)


@dataclass(frozen=True, kw_only=True)
class CurveReport:
    """P at full travel as a function of the modulus, and the error band of the modulus for each P."""

    x_mm: float = report_field("mm", "full travel, at which P is computed; it is counted like `response[].x_mm`")
    P_softest: float | None = report_field("1", "limit of the force ratio for E towards 0")
    E_MPa: tuple[float, ...] = report_field("MPa", "moduli in fine steps up to `design.fruit.E_max_MPa`")
    P: Numbers = report_field("1", "force ratio at each of these moduli; null if a tip is off the fruit")
    E_lower_as_printed_MPa: Numbers = report_field(
        "MPa", "smallest modulus that can cause this P on a sensor as printed, as in response.csv; null without a bound"
    )
    E_upper_as_printed_MPa: Numbers = report_field(
        "MPa", "largest modulus that can cause this P on a sensor as printed; null without a bound"
    )
    E_lower_calibrated_MPa: Numbers = report_field(
        "MPa", "smallest modulus that can cause this P on a calibrated unit; null without a bound"
    )
    E_upper_calibrated_MPa: Numbers = report_field(
        "MPa", "largest modulus that can cause this P on a calibrated unit; null without a bound"
    )

    @classmethod
    def from_stage(cls, table: "ReadingTable", tips: "Tips") -> Self:
        """Return P at full travel and the ends of the error band of the modulus, as lists over the moduli of a table.

        The first modulus of the table represents the softest possible fruit. Its P becomes `P_softest`, and the lists
        begin with the second modulus. The layout of `tips` determines which tips are on the low and on the high spring.
        """
        bands = band_columns(table)
        columns = force_columns(table.response, tips) | bands  # arrays (moduli, travels)
        at_full_travel: dict[str, Any] = {name: numbers(grid[:, -1]) for name, grid in columns.items()}
        return cls(
            x_mm=float(table.response.x[-1]),
            P_softest=at_full_travel["P"][0],
            **{name: at_full_travel[name][1:] for name in ("E_MPa", "P", *bands)},
        )


@dataclass(frozen=True, kw_only=True)
class TipReport:
    """A tip and its spring."""

    name: str = report_field("", "name of the tip")
    x_mm: float = report_field("mm", "position of the tip along the length, relative to the midpoint of the tips")
    y_mm: float = report_field("mm", "position of the tip across the length, relative to the midpoint of the tips")
    spring: str = report_field("", "the spring that carries the tip, `low` or `high`")

    @classmethod
    def rows(cls, tips: "Tips") -> tuple[Self, ...]:
        """Return one row for each tip, in the order of the forces in every table."""
        rows = zip(tips.names, tips.places_mm, tips.springs, strict=True)
        return tuple(cls(name=name, x_mm=x, y_mm=y, spring=spring) for name, (x, y), spring in rows)


@dataclass(frozen=True, kw_only=True)
class ModulusReport:
    """The accuracy of readings at one modulus."""

    E_MPa: float = report_field("MPa", "modulus of the fruit")
    E_bias_percent: float = report_field(
        "%", "largest error of the modulus read without noise, over all fruits and poses, with its sign"
    )
    worst: str = report_field("", "the pose with the largest error")
    uncertainty_percent: float = report_field("%", "standard uncertainty of the modulus from all sources together")
    sources: dict[str, float] = report_field(
        "%", "standard uncertainty of the modulus from each source", each="SOURCE_percent"
    )
    fruit: UnevenFruit | None = report_field(
        "", "additional uncertainty due to uneven skin and flesh at this modulus", default=None, left_out=True
    )
    form_percent: tuple[float, ...] = report_field(
        "%",
        "change in E due to one standard deviation of each form error of the domes, with its sign: first of their "
        "radius, then of caps of each radius. It holds without a reference ball; reports before 0.3 do not have it",
        default=(),
        left_out=True,
    )

    @classmethod
    def from_stage(cls, row: "ModulusAccuracy") -> Self:
        """Return the bias and uncertainty of readings at one modulus."""
        return cls(
            E_MPa=row.E,
            E_bias_percent=100.0 * row.bias.value,
            worst=str(row.worst),
            uncertainty_percent=100.0 * row.sources.total,
            sources=_percent(row.sources.contributions),
            fruit=row.uneven,
            form_percent=tuple(100.0 * each for each in row.form),
        )


@dataclass(frozen=True, kw_only=True)
class ReadingReport:
    """The accuracy of readings over all poses that `[reading]` allows."""

    E_bias_percent: float | None = report_field(
        "%",
        "largest error of the modulus read without noise, over all fruits and poses that give a reading; "
        "null if a level press gives none",
    )
    E_bias_error_percent: float | None = report_field("%", "half width of the error bar of `E_bias_percent`")
    uncertainty_percent: float | None = report_field(
        "%",
        "standard uncertainty of the modulus from all sources together, a root mean square over fruits and "
        "poses drawn at random. It is given at the modulus where its ratio to the limit is largest",
    )
    sources: dict[str, float] = report_field(
        "%",
        "standard uncertainty of the modulus from each source: noise, drifts, springs, gains, creep, shape "
        "and pose, thickness of the flesh, Poisson's ratio, conversion times of the channels. They hold for "
        "a press by hand of 3 s, or for the fastest press that the read-out allows if that is longer",
        each="SOURCE_percent",
    )
    method: str = report_field("", "the method that computes a modulus from the forces")
    touch_fraction: float | None = report_field(
        "1",
        "travel at which the last tip touches divided by the full travel, the largest over fruits and poses",
    )
    noise_for_10_percent: float | None = report_field(
        "% of full scale",
        "noise of the forces at which the uncertainty of the modulus reaches 10 %: an upper limit for the "
        "noise of the amplifier. Null if the other sources exceed 10 % without any noise",
    )
    refused: str | None = report_field(
        "", "the number of poses without a reading, and the reason for one of them; null if every pose has a reading"
    )
    moduli: tuple[ModulusReport, ...] = report_field("", "bias and uncertainty at each modulus")
    skin_pressure: tuple[SkinPressure, ...] = report_field("", "the pressure at each modulus of `fruit.E_MPa`")
    fruit: UnevenFruit | None = report_field(
        "",
        "additional uncertainty due to uneven skin and flesh; `uncertainty_percent` is for an even fruit. It is given "
        "at the modulus where it is largest. Reports before 0.3 do not have it",
        default=None,
        left_out=True,
    )
    calibration: CalibrationErrors | None = report_field(
        "",
        "errors of springs and gains after calibration on the bench of the design. Reports before 0.3 do not have it",
        default=None,
        left_out=True,
    )

    @classmethod
    def from_stage(cls, readings: "ReadingAccuracy") -> Self:
        """Return the bias and the uncertainty of readings in per cent, at each modulus and at the worst one.

        If a level press has no reading, the bias and the uncertainty are None and `sources` is empty.
        """
        bias = readings.bias
        uncertainty = readings.uncertainty
        sources: dict[str, float] = {}
        if uncertainty is not None:
            sources = _percent(readings.worst_uncertainty.sources.contributions)
        return cls(
            E_bias_percent=None if bias is None else 100.0 * bias.value,
            E_bias_error_percent=None if bias is None else 100.0 * bias.error,
            uncertainty_percent=None if uncertainty is None else 100.0 * uncertainty.value,
            sources=sources,
            method=readings.method,
            touch_fraction=readings.touch.value,
            noise_for_10_percent=readings.noise_percent,
            refused=readings.refused,
            moduli=tuple(ModulusReport.from_stage(row) for row in readings.moduli),
            skin_pressure=readings.pressures,
            fruit=readings.uneven,
            calibration=readings.calibration,
        )


@dataclass(frozen=True, kw_only=True)
class PaperReport:
    """The verdicts on the springs of the paper, for the same contact."""

    K_l_N_per_m: float = report_field("N/m", "stiffness of the paper's low spring, 753")
    K_h_N_per_m: float = report_field("N/m", "stiffness of the paper's high spring, 17300")
    verdicts: tuple[Verdict, ...] = report_field("", "verdicts on these springs, as in `verdicts[]`", each="KEY")

    @classmethod
    def from_stage(cls, verdicts: tuple[Verdict, ...]) -> Self:
        """Return the paper's springs with the verdicts on them."""
        return cls(K_l_N_per_m=1e3 * PAPER_SPRINGS.K_l, K_h_N_per_m=1e3 * PAPER_SPRINGS.K_h, verdicts=verdicts)


@dataclass(frozen=True, kw_only=True)
class SolveReport:
    """The accuracy with which a stage was solved."""

    error_percent: float = report_field("%", "largest error bar of the solved numbers")
    choice: str = report_field("", "a sentence on the method and the meshes that were chosen")


@dataclass(frozen=True, kw_only=True)
class AccuracyReport:
    """The requested accuracy, and the methods and meshes by which it was reached."""

    tolerance: float = report_field("1", "`--tol`, the relative error allowed to both spring stiffnesses")
    springs: SolveReport | None = report_field(
        "", "accuracy of both spring stiffnesses; null if springs are not made, as for a line of tips"
    )
    contact: SolveReport = report_field("", "accuracy of the compliance s11 - s12")

    @classmethod
    def from_stage(cls, tolerance: float, fitted: "FittedHousing | None", contact: FruitCompliance) -> Self:
        """Return the requested tolerance [1], and the errors [%] and methods of the springs and of the contact.

        `fitted` is the housing with the error bars of its springs; it is None if no housing was made.
        """
        springs = None
        if fitted is not None:
            stiffness = fitted.stiffness
            largest_error = max(stiffness.error)  # the larger of the relative errors of the two springs
            springs = SolveReport(error_percent=100.0 * largest_error, choice=stiffness.info.status)
        choice = f"{contact.info.method}: {contact.info.status}"
        return cls(
            tolerance=tolerance,
            springs=springs,
            contact=SolveReport(error_percent=100.0 * contact.difference_error, choice=choice),
        )


@dataclass(frozen=True, kw_only=True)
class RelaxingModulusReport:
    """The forces as a function of time on a fruit of one modulus."""

    E_MPa: float = report_field("MPa", "instantaneous modulus of the fruit")
    F_N: tuple[Numbers, ...] = report_field(
        "N", "force on each tip as a function of time, with a row for each tip in the order of `tips`"
    )
    P: Numbers = report_field("1", "force ratio as a function of time; null if a tip is off the fruit")
    E_apparent_MPa: Numbers = report_field(
        "MPa", "modulus that is computed from the forces at each time as if the flesh were elastic"
    )


@dataclass(frozen=True, kw_only=True)
class RelaxationReport:
    """A level press to full travel and its hold, on flesh that relaxes; lists have one entry for each of `t_s`."""

    t_s: tuple[float, ...] = report_field("s", "times from the first touch")
    stop_s: float = report_field("s", "time at which the housing stops")
    at_s: float = report_field("s", "time at which the forces are read")
    moves_percent: float | None = report_field(
        "%",
        "largest change of the apparent modulus during the hold, relative to the reading, over all moduli; "
        "null if a tip is off the fruit",
    )
    moves_error_percent: float | None = report_field("%", "half width of the error bar of `moves_percent`")
    moduli: tuple[RelaxingModulusReport, ...] = report_field(
        "", "forces as functions of time, on a fruit of each modulus"
    )
    moments: tuple[Moment, ...] = report_field("", "the best time of a reading")

    @classmethod
    def from_stage(cls, over_time: "ReadingOverTime") -> Self:
        """Return forces, P and the apparent modulus over time for each modulus, and the best moment for a reading.

        If a tip is out of contact, the change of the apparent modulus is not finite, and is stored as None.
        """
        moduli = []
        for i, E in enumerate(over_time.E.tolist()):
            modulus = RelaxingModulusReport(
                E_MPa=E,
                F_N=tuple(numbers(tip_forces) for tip_forces in over_time.F[i].T),  # (times, tips) to one row per tip
                P=numbers(over_time.P[i]),
                E_apparent_MPa=numbers(over_time.apparent[i]),
            )
            moduli.append(modulus)
        # `numbers` replaces values that are not finite by None.
        moves, error = numbers(100.0 * np.array([over_time.moves.value, over_time.moves.error]))
        return cls(
            t_s=tuple(over_time.t.tolist()),
            stop_s=float(over_time.t[over_time.stop]),
            at_s=float(over_time.t[over_time.at]),
            moves_percent=moves,
            moves_error_percent=error,
            moduli=tuple(moduli),
            moments=(over_time.steadiest,),  # the key holds a list, here of a single moment
        )


def _percent(sources: Mapping[str, float]) -> dict[str, float]:
    """Return the uncertainty [1] from each source in per cent, with keys that end in `_percent`.

    The suffix is not repeated for a source whose name has it already, such as `noise_percent`.
    """
    return {f"{name.removesuffix('_percent')}_percent": 100.0 * value for name, value in sources.items()}
