"""The report of a run: every number of its result in the unit of its key; None where there is no number."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib.metadata import version
from typing import Any

from pipeline.options import run_key
from pipeline.reading.analysis import Readings
from pipeline.reading.over_time import ReadingOverTime
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.report.notes import notes
from pipeline.report.report import (
    AccuracyReport,
    ContactReport,
    CurveReport,
    LeftOut,
    ListedFile,
    MaterialReport,
    ModulusReport,
    Numbers,
    PaperReport,
    ReadingReport,
    RelaxationReport,
    RelaxingModulusReport,
    Report,
    ResponseReport,
    SizingReport,
    SkinReport,
    SolveReport,
    TipReport,
)
from pipeline.report.response_table import band_columns, force_columns, numbers
from pipeline.result import SensorResult
from pipeline.sensor import Sensor
from pipeline.springs.fitted_springs import printable_leaves
from pipeline.springs.sizing import SpringSizing
from pipeline.verdicts.errors.sensor_errors import ReadingTable
from pipeline.verdicts.records import UncertaintyBudget
from pipeline.verdicts.targets import force_errors_of_springs
from sensor.arrays import Floats, rows_of
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from sensor.theory.two_spring_law import PAPER_SPRINGS
from sensor.verdict import Verdict
from solve.contact.linear_response import SensorResponse
from solve.fruit.compliance import FruitCompliance

PACKAGES = ("twintip", "cadquery", "cadquery-ocp", "gmsh", "scikit-fem", "numpy", "scipy", "meshio", "pyvista")


def report_of_result(result: SensorResult, files: Iterable[ListedFile] = ()) -> Report:
    """Return the report of a run whose folder has these files."""
    design = result.design
    process = result.springs.process
    return Report(
        **{name: part(result) for name, part in PARTS.items()},
        design=design,
        housing=result.springs.housing,
        material=MaterialReport(
            name=process.material, E_MPa=process.E_MPa, poisson=process.poisson, process=process.name
        ),
        behaviour=result.behaviour,
        curve=_curve(result.errors.reading, design.tips),
        tips=tip_reports(design.tips),
        read_out=result.read_out,
        verdicts=result.verdicts,
        remedy=next((verdict.remedy for verdict in result.verdicts if verdict.remedy is not None), None),
        errors=_errors(result),
        paper=_paper(result),
        accuracy=_accuracy(result),
        notes=tuple(notes(result)),
        versions={name: version(name) for name in PACKAGES},
        files=tuple(files),
        seconds=result.seconds.wall,
        cpu_seconds=result.seconds.cpu,
        relaxation=None if result.over_time is None else relaxation_report(result.over_time),
        tolerance=result.errors.scatter if result.options.fabrication else LeftOut.LEFT_OUT,
        key=run_key(design, result.options),
    )


PARTS: dict[str, Callable[[Sensor | SensorResult], Any]] = {
    "springs": lambda sensor: sizing_report(sensor.design, sensor.sizing),
    "flexures": lambda sensor: {} if sensor.springs.ideal else sensor.springs.springs,  # none for a line of tips
    "deflections_mm": lambda sensor: sensor.sizing.deflections(sensor.design.full_travels_mm),
    "contact": lambda sensor: contact_report(sensor.contact),
    "response": lambda sensor: response_reports(sensor.pressed, sensor.press.table),
    "level": lambda sensor: (sensor.level if isinstance(sensor, Sensor) else sensor.reached).level,
    "reading": lambda sensor: None if sensor.readings is None else reading_report(sensor.readings),
}
"""The keys that need no solid, and what each is filled from."""


class SensorParts(Mapping[str, object]):
    """The keys of a report that need no solid, of which each solves what it needs when it is asked for."""

    def __init__(self, sensor: Sensor) -> None:
        """Take the sensor."""
        self._sensor = sensor

    def __contains__(self, name: object) -> bool:
        """Return whether a key needs no solid; solves nothing."""
        return name in PARTS or name == "verdicts"

    def __getitem__(self, name: str) -> object:
        """Return the part of a key; raises KeyError for one that needs a solid."""
        return _VerdictsByName(self._sensor) if name == "verdicts" else PARTS[name](self._sensor)

    def __iter__(self) -> Iterator[str]:
        """Yield the keys."""
        return iter((*PARTS, "verdicts"))

    def __len__(self) -> int:
        """Return the number of keys."""
        return len(PARTS) + 1


class _VerdictsByName(Mapping[str, Verdict]):
    """The verdicts of a sensor by their names, of which each is judged when it is asked for."""

    def __init__(self, sensor: Sensor) -> None:
        self._sensor = sensor

    def __getitem__(self, name: str) -> Verdict:
        verdict = self._sensor.verdict(name)
        if verdict is None:
            raise KeyError(name)
        return verdict

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self._sensor.verdict(name) is not None

    def __iter__(self) -> Iterator[str]:
        return (verdict.name for verdict in self._sensor.verdicts)

    def __len__(self) -> int:
        return len(self._sensor.verdicts)


def sizing_report(design: Design, sizing: SpringSizing) -> SizingReport:
    """Return the springs that were sized and the fruit stiffness that sized them."""
    leaves = None
    if design.tips.tip_layout.has_housing:
        leaves = tuple(spring.length_mm for spring in printable_leaves(design, sizing).values())
    return SizingReport(
        K_l_N_per_m=1e3 * sizing.springs.K_l,
        K_h_N_per_m=1e3 * sizing.springs.K_h,
        K_m_max_N_per_m=1e3 * sizing.K_m_max,
        K_m_over_E_mm=sizing.K_m_over_E,
        fruit_stiffness=sizing.basis,
        beam_law_leaves_mm=leaves,
    )


def contact_report(contact: FruitCompliance) -> ContactReport:
    """Return the compliance of the fruit with its errors and what it cost."""
    skin = None
    if contact.skin is not None:
        matrices = tuple(rows_of(S) for S in contact.skin.S)
        skin = SkinReport(E_MPa=tuple(contact.skin.E.tolist()), compliance_per_mm=matrices)
    info = contact.info
    return ContactReport(
        error_percent=100.0 * contact.error_pair,
        s11_error_percent=100.0 * contact.error_own,
        method=info.method,
        dofs=info.dofs,
        seconds=info.seconds,
        status=info.status,
        compliance_per_mm=rows_of(contact.S),
        K_m_over_E_mm=contact.K_m_over_E(),
        skin=skin,
    )


def response_reports(sensor: PressedSensor, table: SensorResponse) -> tuple[ResponseReport, ...]:
    """Return the response at each modulus with the errors of contact and springs."""
    tips = sensor.design.tips
    columns = force_columns(table, tips) | {"slope_ratio": table.slope_ratio}
    rows = []
    for i, E in enumerate(table.E.tolist()):
        spring_errors = force_errors_of_springs(sensor, E)
        over_travel: dict[str, Any] = {name: numbers(grid[i]) for name, grid in columns.items()}
        row = ResponseReport(
            **over_travel | {"E_MPa": E},
            F_error_percent=numbers(100.0 * (table.F_error[i] + spring_errors.max())),
            P_error_percent=numbers(100.0 * (table.P_error[i] + spring_errors.sum())),
            F_N=tuple(numbers(table.F[i, :, tip]) for tip in tips.own_columns),
        )
        rows.append(row)
    return tuple(rows)


def _curve(table: ReadingTable, tips: Tips) -> CurveReport:
    """Return P at full travel over the modulus, with its bands; the first modulus stands for the softest fruit."""
    columns = force_columns(table.response, tips) | band_columns(table)
    at_full_travel: dict[str, Any] = {name: numbers(grid[:, -1]) for name, grid in columns.items()}
    return CurveReport(
        x_mm=float(table.response.x[-1]),
        P_softest=at_full_travel["P"][0],
        **{name: at_full_travel[name][1:] for name in ("E_MPa", "P", *band_columns(table))},
    )


def tip_reports(tips: Tips) -> tuple[TipReport, ...]:
    """Return the tips in the order of the forces in every table."""
    rows = zip(tips.names, tips.places_mm, tips.springs, strict=True)
    return tuple(TipReport(name=name, x_mm=x, y_mm=y, spring=spring) for name, (x, y), spring in rows)


def reading_report(readings: Readings) -> ReadingReport:
    """Return the bias and uncertainty of readings, in per cent of the modulus, and the pressure on the skin."""
    bias = readings.bias
    uncertainty = readings.uncertainty
    moduli = []
    for row in readings.moduli:
        modulus = ModulusReport(
            E_MPa=row.E,
            E_bias_percent=100.0 * row.bias.value,
            worst=str(row.worst),
            uncertainty_percent=100.0 * row.sources.total,
            sources=_percent(row.sources.contributions),
        )
        moduli.append(modulus)
    return ReadingReport(
        E_bias_percent=None if bias is None else 100.0 * bias.value,
        E_bias_error_percent=None if bias is None else 100.0 * bias.error,
        uncertainty_percent=None if uncertainty is None else 100.0 * uncertainty.value,
        sources={} if uncertainty is None else _percent(readings.worst_uncertainty.sources.contributions),
        method=readings.method,
        touch_fraction=readings.touch.value,
        noise_for_10_percent=readings.noise_percent,
        refused=readings.refused,
        moduli=tuple(moduli),
        skin_pressure=readings.pressures,
    )


def relaxation_report(over_time: ReadingOverTime) -> RelaxationReport:
    """Return forces, P and the apparent modulus over time, and the moment at which a reading moves least."""
    moduli = []
    for i, E in enumerate(over_time.E.tolist()):
        row = RelaxingModulusReport(
            E_MPa=E,
            F_N=_number_rows(over_time.F[i].T),
            P=numbers(over_time.P[i]),
            E_apparent_MPa=numbers(over_time.apparent[i]),
        )
        moduli.append(row)
    return RelaxationReport(
        t_s=tuple(over_time.t.tolist()),
        stop_s=float(over_time.t[over_time.stop]),
        at_s=float(over_time.t[over_time.at]),
        moves_percent=_finite(100.0 * over_time.moves.value),
        moves_error_percent=_finite(100.0 * over_time.moves.error),
        moduli=tuple(moduli),
        moments=(over_time.steadiest,),
    )


def _errors(result: SensorResult) -> dict[str, UncertaintyBudget | None]:
    """Return the budget of each number; springs that a line is given have none."""
    has_housing = result.design.tips.tip_layout.has_housing
    budgets = vars(result.errors.budgets)
    return {name: budget for name, budget in budgets.items() if has_housing or name not in ("K_l", "K_h")}


def _paper(result: SensorResult) -> PaperReport | None:
    if result.paper is None:
        return None
    return PaperReport(K_l_N_per_m=1e3 * PAPER_SPRINGS.K_l, K_h_N_per_m=1e3 * PAPER_SPRINGS.K_h, verdicts=result.paper)


def _accuracy(result: SensorResult) -> AccuracyReport:
    """Return the accuracy that was asked for, with the largest error of springs and contact and how each was solved."""
    contact = result.contact
    springs = None
    if result.springs.fitted is not None:
        stiffness = result.springs.fitted.stiffness
        springs = SolveReport(error_percent=100.0 * max(stiffness.error), choice=stiffness.info.status)
    return AccuracyReport(
        tolerance=result.options.tolerance,
        springs=springs,
        contact=SolveReport(
            error_percent=100.0 * contact.error_pair, choice=f"{contact.info.method}: {contact.info.status}"
        ),
    )


def _number_rows(values: Floats) -> tuple[Numbers, ...]:
    return tuple(numbers(row) for row in values)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _percent(sources: Mapping[str, float]) -> dict[str, float]:
    return {f"{name.removesuffix('_percent')}_percent": 100.0 * value for name, value in sources.items()}
