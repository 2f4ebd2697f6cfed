"""What a person reads of a result: an answer that fits one screen, and on request every table."""

from rich.markup import escape

from cad.theory.two_spring_law import PAPER_SPRINGS
from pipeline.report.answer.answer import AnswerPart, AnswerTable, RunAnswer
from pipeline.report.notes import notes
from pipeline.report.verdict_table import OUTCOME, reasons, shown, verdict_table
from pipeline.result import SensorResult
from pipeline.springs.fitted_spring import FittedSpring
from pipeline.verdicts.errors.budget import UncertaintyBudget

_TARGETS = (
    *("reading.bias", "reading.uncertainty", "reading.lift", "bruise"),
    *("P_max", "NL", "K_l", "K_h", "P_displacement_independent", "P_monotonic"),
)
_ADVICE = 3  # lines of what is wrong before the rest is counted


def run_answer(result: SensorResult) -> RunAnswer:
    """Return what is printed of a result, without where its files are."""
    return RunAnswer(passed=result.passed, summary=_summary(result), everything=_everything(result))


def _summary(result: SensorResult) -> tuple[AnswerPart, ...]:
    """Return the answer on one screen: the verdict, targets against values, springs, what is wrong."""
    shown = [verdict for verdict in result.verdicts if verdict.name in _TARGETS]
    rest = [verdict for verdict in result.verdicts if verdict.name not in _TARGETS]
    passed = sum(verdict.passed is True for verdict in rest)
    counted = (f"{len(rest)} on geometry and print", "", "", "", "", f"{passed} passed")
    springs = (escape(_spring_line(spring, result)) for spring in result.springs.springs)
    return (
        AnswerPart(lines=(_headline(result),)),
        AnswerPart(table=verdict_table("", shown, counted), lines=(*springs, *_advice(result))),
    )


def _advice(result: SensorResult) -> tuple[str, ...]:
    """Return why the first verdicts did not pass, and what would make them pass."""
    wrong = sorted((v for v in result.verdicts if v.passed is not True), key=lambda verdict: verdict.passed is None)
    told = reasons(wrong[:_ADVICE])
    if len(wrong) > _ADVICE:
        return (*told, f"and {len(wrong) - _ADVICE} more: --verbose lists them all")
    return told


def _everything(result: SensorResult) -> tuple[AnswerPart, ...]:
    """Return every verdict, the springs, the make-up of errors, the response, the paper's springs, notes and costs."""
    wrong = [verdict for verdict in result.verdicts if verdict.passed is not True]
    parts = [
        AnswerPart(lines=(_headline(result),)),
        AnswerPart(table=verdict_table(f"twintip · {result.design.name}", result.verdicts), lines=reasons(wrong)),
        *(AnswerPart(table=table) for table in (_spring_table(result), _error_table(result), _response_table(result))),
    ]
    if result.paper is not None:
        K_l, K_h = (1e3 * K for K in PAPER_SPRINGS.stiffnesses)
        title = f"the paper's springs, {K_l:g} and {K_h:g} N/m, under the same contact"
        parts.append(AnswerPart(table=verdict_table(title, result.paper)))
    lines = (*_method_lines(result), *notes(result), *_scatter_lines(result), _cost_line(result))
    parts.append(AnswerPart(lines=tuple(escape(line) for line in lines)))
    return tuple(parts)


def _headline(result: SensorResult) -> str:
    count = len(result.verdicts)
    failed, open_ = (sum(v.passed is outcome for v in result.verdicts) for outcome in (False, None))
    words = [f"{failed} failed" if failed else "", f"{open_} undecided" if open_ else ""]
    outcome = (
        f"all {count} verdicts passed" if result.passed else f"of {count} verdicts {', '.join(filter(None, words))}"
    )
    return f"{OUTCOME[result.passed]}  twintip · {escape(result.design.name)}: {outcome}"


def _leaf(spring: FittedSpring) -> str:
    leaf = spring.flexure
    return "" if leaf is None else f"{leaf.length:g} x {leaf.thickness:g} x {leaf.depth:g}"


def _spring_line(spring: FittedSpring, result: SensorResult) -> str:
    strain = spring.root_strain
    if spring.K is None or strain is None:
        return f"{spring.name} spring: {1e3 * spring.target:.6g} N/m, not made"
    process = result.springs.process.name
    stiffness = f"{1e3 * spring.K.value:.5g} N/m ± {spring.K.percent:.2g} % by FE"
    bent = f"strain {strain.value:.2g} at full travel, limit {spring.printable.strain_limit:.2g}"
    return f"{spring.name} spring: {stiffness}, leaves {_leaf(spring)} mm in {process}, {bent}"


def _spring_table(result: SensorResult) -> AnswerTable:
    heads = ("spring", "target N/m", "FE N/m", "± %", "leaf L x t x w mm", "strain", "safety", "dofs", "s")
    return AnswerTable(heads=heads, rows=tuple(_spring_row(spring, result) for spring in result.springs.springs))


def _spring_row(spring: FittedSpring, result: SensorResult) -> tuple[str, ...]:
    K, strain, fitted = spring.K, spring.root_strain, result.springs.fitted
    return (
        spring.name,
        f"{1e3 * spring.target:.6g}",
        shown(None if K is None else 1e3 * K.value),
        shown(None if K is None else K.percent),
        _leaf(spring),
        shown(None if strain is None else strain.value),
        shown(spring.safety_factor),
        "" if fitted is None else str(fitted.stiffness.info.dofs),
        "" if fitted is None else f"{fitted.stiffness.info.seconds:.5g}",
    )


def _error_table(result: SensorResult) -> AnswerTable:
    """Return what each error is made of; verdicts use the first column, calibration of a print settles the last."""
    heads = ("error of", "mesh ± %", "left out of the model %", "scatter of the print ± %", "largest shares")
    budgets: dict[str, UncertaintyBudget | None] = vars(result.errors.budgets)
    rows = tuple(_error_row(name, budget) for name, budget in budgets.items() if budget is not None)
    return AnswerTable(heads=heads, rows=rows)


def _error_row(name: str, budget: UncertaintyBudget) -> tuple[str, ...]:
    shares = sorted((*budget.model, *budget.input), key=lambda share: -abs(share.size))
    largest = ", ".join(f"{share.effect} {100.0 * share.size:+.2g}" for share in shares[:2])
    totals = (budget.numerical, budget.model_total, budget.input_total)
    return (name, *(f"{100.0 * total:.2g}" for total in totals), largest)


def _response_table(result: SensorResult) -> AnswerTable:
    response = result.press.table
    forces = [f"F_{tip} N" for tip in result.contact.tips]
    rows = []
    for i, E in enumerate(response.E):
        ends = (response.P[i, 0], response.P[i, -1], *response.F[i, -1], response.slope_ratio[i, -1])
        rows.append((f"{E:g}", *("off" if end != end else f"{end:.5g}" for end in ends)))
    return AnswerTable(heads=("E MPa", "P first", "P last", *forces, "slope ratio"), rows=tuple(rows))


def _method_lines(result: SensorResult) -> list[str]:
    contact, fitted = result.contact, result.springs.fitted
    info = contact.info
    lines = [
        f"contact: K_m/E = {contact.K_m_over_E():.6g} mm ± {100.0 * contact.error_pair:.2g} %, {info.method}, "
        f"{info.dofs} dofs; {info.status}"
    ]
    if fitted is not None:
        lines.append(f"springs, --tol {result.options.tolerance:g}: {fitted.stiffness.info.status}")
    return lines


def _scatter_lines(result: SensorResult) -> list[str]:
    scatter = result.errors.scatter
    if scatter is None:
        return []
    bands = {name: value for name, value in vars(scatter).items() if isinstance(value, tuple)}
    ends = {name: [_shown_end(end) for end in band] for name, band in bands.items()}
    listed = ", ".join(f"{name} {least} to {most}" for name, (least, most) in ends.items())
    error = scatter.calibrated_modulus_error
    known = "not known" if error is None else f"known to {100.0 * error:.1f} %"
    return [
        f"before calibration 95 % of prints have: {listed}",
        f"with both stiffnesses of a unit known to 1 %, the modulus it reads is {known}",
    ]


def _shown_end(end: float | None) -> str:
    return "no limit" if end is None else f"{end:.4g}"


def _cost_line(result: SensorResult) -> str:
    wall, cpu = result.seconds.wall, result.seconds.cpu
    stages = ", ".join(f"{name} {value:.2f}/{cpu[name]:.2f}" for name, value in wall.items())
    return f"seconds (wall/processor): {stages}"
