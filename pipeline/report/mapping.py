"""The report of a run: its results in the units of report.json, None where there is no number."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from importlib.metadata import version

import numpy as np

from cad.design.tips import Tips
from cad.theory.two_spring_law import PAPER_SPRINGS
from cad.verdict import Verdict
from pipeline.reading.analysis import Readings, SensorModel
from pipeline.reading.measurement import LineModel
from pipeline.report.notes import notes
from pipeline.report.run_key import run_key
from pipeline.report.stored import (
    Matrix,
    Numbers,
    StoredAccuracy,
    StoredArm,
    StoredBehaviour,
    StoredBudget,
    StoredChoice,
    StoredContact,
    StoredContribution,
    StoredCurve,
    StoredDepth,
    StoredFile,
    StoredLevel,
    StoredMaterial,
    StoredMode,
    StoredModulus,
    StoredPaper,
    StoredPressure,
    StoredReading,
    StoredReadOut,
    StoredReport,
    StoredResponse,
    StoredSizing,
    StoredSpring,
    StoredTargets,
    StoredTip,
    as_data,
)
from pipeline.response.scene_press import spring_shares
from pipeline.result import SensorResult
from pipeline.springs.behaviour import GAUGE_FACTOR, GRID_MM, ArmBehaviour, SpringBehaviour
from pipeline.springs.fitted_springs import FittedSpring, FittedSprings
from pipeline.springs.sizing import SpringSizing
from pipeline.storage.digests import with_digest
from pipeline.storage.plain import Plain
from pipeline.verdicts.errors.budget import Contribution, UncertaintyBudget
from pipeline.verdicts.errors.sensor_errors import ReadingTable
from pipeline.verdicts.targets import SceneTargets
from solve.arrays import Floats
from solve.contact.linear_response import SensorResponse
from solve.fruit.compliance import FruitCompliance

PACKAGES = ("twintip", "cadquery", "cadquery-ocp", "gmsh", "scikit-fem", "numpy", "scipy", "meshio", "pyvista")


def report_mapping(result: SensorResult, files: Iterable[StoredFile] = ()) -> Plain:
    """Return the JSON data of a run's report with its own digest."""
    data: Plain = as_data(stored_report(result, files))
    if not result.options.fabrication:
        del data["tolerance"]
    data["key"] = run_key(result.design, result.options)
    return with_digest(data)


def stored_report(result: SensorResult, files: Iterable[StoredFile] = ()) -> StoredReport:
    """Return the report of a run whose folder has these files beside report.json."""
    springs = result.springs
    process = springs.process
    remedies = [verdict.remedy for verdict in result.verdicts if verdict.remedy is not None]
    return StoredReport(
        design=result.design,
        springs=stored_sizing(result.sizing),
        flexures={spring.name: stored_spring(spring, springs) for spring in springs.springs},
        housing=springs.housing,
        deflections_mm=tuple(springs.deflections),
        material=StoredMaterial(
            name=process.material, E_MPa=process.E_MPa, poisson=process.poisson, process=process.name
        ),
        behaviour=None if result.behaviour is None else _behaviour(result.behaviour),
        contact=stored_contact(result.contact),
        response=stored_response(result.design.tips, result.contact, springs, result.press.table),
        curve=_curve(result.errors.reading),
        tips=stored_tips(result.design.tips),
        read_out=stored_read_out(result.read_out),
        reading=None if result.readings is None else stored_reading(result.readings),
        level=stored_targets(result.reached),
        verdicts=result.verdicts,
        remedy=remedies[0] if remedies else None,
        errors={name: _budget(budget) for name, budget in vars(result.errors.budgets).items()},
        paper=None if result.paper is None else _paper(result.paper),
        accuracy=_accuracy(result),
        notes=tuple(notes(result)),
        versions={name: version(name) for name in PACKAGES},
        files=tuple(files),
        seconds=result.seconds.wall,
        cpu_seconds=result.seconds.cpu,
        tolerance=None if result.errors.scatter is None else asdict(result.errors.scatter),
    )


def stored_sizing(sizing: SpringSizing) -> StoredSizing:
    """Return the springs that were sized and the fruit stiffness that sized them."""
    return StoredSizing(
        K_l_N_per_m=1e3 * sizing.springs.K_l,
        K_h_N_per_m=1e3 * sizing.springs.K_h,
        K_m_max_N_per_m=1e3 * sizing.K_m_max,
        K_m_over_E_mm=sizing.K_m_over_E,
        fruit_stiffness=sizing.basis,
    )


def stored_spring(spring: FittedSpring, springs: FittedSprings) -> StoredSpring:
    """Return one of the springs; numbers of a spring that cannot be made are None."""
    K = spring.K
    strain = spring.root_strain
    info = None if springs.fitted is None else springs.fitted.stiffness.info
    return StoredSpring(
        target_N_per_m=1e3 * spring.target,
        stiffness_N_per_m=None if K is None else 1e3 * K.value,
        error_percent=None if K is None else K.percent,
        dimensions_mm=spring.flexure,
        root_strain=None if strain is None else strain.value,
        root_strain_error_percent=None if strain is None else strain.percent,
        safety_factor=spring.safety_factor,
        dofs=None if info is None else info.dofs,
        seconds=None if info is None else info.seconds,
    )


def _behaviour(behaviour: SpringBehaviour) -> StoredBehaviour:
    modes = []
    if behaviour.modes is not None:
        rows = zip(behaviour.modes.frequencies_Hz, behaviour.modes.errors, behaviour.modes.shapes, strict=True)
        for frequency, error, shape in rows:
            modes.append(StoredMode(frequency_Hz=frequency, error_percent=100.0 * error, shape=shape))
    return StoredBehaviour(
        crosstalk_C12_over_C22=behaviour.crosstalk,
        gauge_factor=GAUGE_FACTOR,
        gauge_grid_mm=GRID_MM,
        gauges=behaviour.gauges,
        modes=tuple(modes),
        low=_arm(behaviour.arms["low"]),
        high=_arm(behaviour.arms["high"]),
    )


def _arm(arm: ArmBehaviour) -> StoredArm:
    return StoredArm(
        tilt_at_full_force_rad=arm.tilt_at_full_force_rad,
        large_deflection_stiffening=arm.large_deflection_stiffening,
        natural_frequency_Hz=arm.natural_frequency_Hz,
        bridge_mV_per_V=tuple(arm.bridge_mV_per_V),
        bridge_error_percent=None if arm.bridge_error is None else 100.0 * arm.bridge_error,
    )


def stored_contact(contact: FruitCompliance) -> StoredContact:
    """Return the compliance of the fruit with its errors and what it cost."""
    return StoredContact(
        error_percent=100.0 * contact.error_pair,
        s11_error_percent=100.0 * contact.error_own,
        **asdict(contact.info),
        compliance_per_mm=_matrix(contact.S.tolist()),
        K_m_over_E_mm=contact.K_m_over_E(),
    )


def stored_response(
    tips: Tips, contact: FruitCompliance, springs: FittedSprings, table: SensorResponse
) -> tuple[StoredResponse, ...]:
    """Return the response at each modulus with the errors of contact and springs."""
    relative = np.array(tips.each(*(spring.error / spring.stiffness for spring in springs.springs)))
    rows = []
    for i, E in enumerate(table.E.tolist()):
        rows.append(stored_row(table, i, tips, spring_shares(contact, springs.C, E) * relative))
    return tuple(rows)


def stored_row(table: SensorResponse, i: int, tips: Tips, spring_errors: Floats) -> StoredResponse:
    """Return the response at one modulus; `spring_errors` (tips,) are the errors of the forces [1] by the springs."""
    low, high = (table.F[i, :, list(kind)].mean(axis=0) for kind in tips.spring_groups)
    return StoredResponse(
        E_MPa=float(table.E[i]),
        x_mm=tuple(table.x.tolist()),
        P=_numbers(table.P[i]),
        F_l_N=_numbers(low),
        F_h_N=_numbers(high),
        slope_ratio=_numbers(table.slope_ratio[i]),
        F_error_percent=_numbers(100.0 * (table.F_error[i] + spring_errors.max())),
        P_error_percent=_numbers(100.0 * (table.P_error[i] + spring_errors.sum())),
        F_N=() if tips.tip_layout.is_pair else tuple(_numbers(forces) for forces in table.F[i].T),
    )


def _curve(table: ReadingTable) -> StoredCurve:
    """Return P at full travel over the modulus, with the moduli that may show it; the first modulus is no fruit's."""
    response = table.response
    return StoredCurve(
        x_mm=float(response.x[-1]),
        P_softest=_numbers(response.P[:1, -1])[0],
        E_MPa=tuple(response.E[1:].tolist()),
        P=_numbers(response.P[1:, -1]),
        E_lower_as_printed_MPa=_numbers(table.printed[1:, -1, 0]),
        E_upper_as_printed_MPa=_numbers(table.printed[1:, -1, 1]),
        E_lower_calibrated_MPa=_numbers(table.calibrated[1:, -1, 0]),
        E_upper_calibrated_MPa=_numbers(table.calibrated[1:, -1, 1]),
    )


def stored_tips(tips: Tips) -> tuple[StoredTip, ...]:
    """Return the tips in the order of the forces in every table."""
    rows = zip(tips.names, tips.places_mm, tips.springs, strict=True)
    return tuple(StoredTip(name=name, x_mm=x, y_mm=y, spring=spring) for name, (x, y), spring in rows)


def stored_read_out(sensor: SensorModel) -> StoredReadOut:
    """Return the numbers that turn forces into a modulus: those of the contrast, or of the line through a press."""
    read_out = sensor.model
    depths = []
    for row in sensor.deep:
        depths.append(StoredDepth(depth_sides=row.depth, factor=row.factor, error_percent=100.0 * row.error))
    by_line = StoredReadOut(
        method=read_out.method,
        springs_mm_per_N=_matrix(read_out.C if isinstance(read_out, LineModel) else read_out.law.C),
        full_scale_N=tuple(sensor.full_scale),
        model_error_percent=100.0 * sensor.model_error,
        level=tuple(StoredLevel(E_MPa=row.E, read_MPa=row.read) for row in sensor.level),
        own_less_other_per_mm=read_out.own_less_other if isinstance(read_out, LineModel) else None,
        large_strain=tuple(depths),
    )
    if isinstance(read_out, LineModel):
        return by_line
    law = read_out.law
    return replace(
        by_line, weights=tuple(law.weights), gaps_mm=tuple(law.gaps), fruit_per_mm=_matrix(law.S), hertz=law.hertz
    )


def stored_reading(readings: Readings) -> StoredReading:
    """Return how good readings are, in per cent of the modulus, and how hard the tips press the skin."""
    assessed = readings.analysis
    bias = assessed.bias
    uncertainty = assessed.uncertainty
    moduli = []
    for row in assessed.moduli:
        modulus = StoredModulus(
            E_MPa=row.E,
            E_bias_percent=100.0 * row.bias,
            worst=str(row.worst),
            uncertainty_percent=100.0 * row.sources.total,
            sources=_percent(row.sources.contributions),
        )
        moduli.append(modulus)
    pressures = []
    for skin in readings.pressures:
        pressure = StoredPressure(
            E_MPa=skin.E, pressure_MPa=skin.pressure.value, limit_MPa=skin.limit, worst=str(skin.placement)
        )
        pressures.append(pressure)
    return StoredReading(
        E_bias_percent=None if bias is None else 100.0 * bias.value,
        E_bias_error_percent=None if bias is None else 100.0 * bias.error,
        uncertainty_percent=None if uncertainty is None else 100.0 * uncertainty.value,
        sources={} if uncertainty is None else _percent(assessed.worst_uncertainty.sources.contributions),
        method=assessed.method,
        lift_deg=assessed.lift.value,
        plates_before_zeroing_percent=100.0 * readings.plates,
        noise_for_10_percent=assessed.noise_percent,
        refused=assessed.refused,
        moduli=tuple(moduli),
        skin_pressure=tuple(pressures),
    )


def stored_targets(reached: SceneTargets) -> StoredTargets:
    """Return P_max and NL of a level sensor with flat sharp tips on flat fruit, whatever scene was asked for."""
    P_max, NL = reached.level
    return StoredTargets(P_max=P_max.value, P_max_error=P_max.error, NL=NL.value, NL_error=NL.error)


def _budget(budget: UncertaintyBudget | None) -> StoredBudget | None:
    if budget is None:
        return None
    return StoredBudget(
        discretisation_percent=100.0 * budget.numerical,
        model=tuple(map(_contribution, budget.model)),
        inputs=tuple(map(_contribution, budget.input)),
        model_percent=100.0 * budget.model_total,
        inputs_percent=100.0 * budget.input_total,
    )


def _contribution(part: Contribution) -> StoredContribution:
    return StoredContribution(effect=part.effect, size_percent=100.0 * part.size, reason=part.reason)


def _paper(verdicts: tuple[Verdict, ...]) -> StoredPaper:
    return StoredPaper(
        K_l_N_per_m=1e3 * PAPER_SPRINGS.K_l, K_h_N_per_m=1e3 * PAPER_SPRINGS.K_h, verdicts=tuple(verdicts)
    )


def _accuracy(result: SensorResult) -> StoredAccuracy:
    contact = result.contact
    springs = None
    if result.springs.fitted is not None:
        stiffness = result.springs.fitted.stiffness
        springs = StoredChoice(error_percent=100.0 * max(stiffness.error), choice=stiffness.info.status)
    choice = f"{contact.info.method}: {contact.info.status}"
    return StoredAccuracy(
        tolerance=result.options.tolerance,
        springs=springs,
        contact=StoredChoice(error_percent=100.0 * contact.error_pair, choice=choice),
    )


def _numbers(values: Floats) -> Numbers:
    return tuple(value if math.isfinite(value) else None for value in values.tolist())


def _matrix(rows: Iterable[Iterable[float]]) -> Matrix:
    return tuple(map(tuple, rows))


def _percent(sources: Mapping[str, float]) -> dict[str, float]:
    return {f"{name.removesuffix('_percent')}_percent": 100.0 * value for name, value in sources.items()}
