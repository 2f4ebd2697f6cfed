"""The main job, in order: contact, springs, leaves, solids, meshes, stiffness, response, verdicts, outputs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cad.design.design_file import design_as_toml
from cad.design.parameters import Design
from cad.verdict import Verdict, all_passed
from pipeline.accuracy import CONTACT_SHARE
from pipeline.options import RunOptions
from pipeline.report.mapping import accuracy_entry, compose, file_entries, write_report
from pipeline.report.response_csv import response_table
from pipeline.stages.fields import write_solutions
from pipeline.stages.kept import kept_contact
from pipeline.stages.sizing import size
from pipeline.stages.solids import write_solids
from pipeline.stages.springs import PrintedSprings, print_springs
from pipeline.stages.verdict_rules import advised
from pipeline.stages.verdicts import Case, judge
from pipeline.storage.folder import output_folder
from pipeline.storage.stopwatch import Stopwatch


@dataclass(frozen=True, kw_only=True)
class RunResult:
    """The report as it stands in report.json, and whether every verdict in it passed; None when one is undecided."""

    report: dict[str, Any]
    passed: bool | None


More = Callable[[Case, PrintedSprings, Path, Stopwatch], tuple[tuple[Verdict, ...], dict[str, Any]]]
"""A further stage: writes files into the folder, returns verdicts and entries of the report."""


def run(design: Design, options: RunOptions, more: More | None = None) -> RunResult:
    """Run every stage and write the outputs, which appear whole or, when this raises, not at all."""
    clock = Stopwatch()
    with output_folder(options.out) as folder:
        with clock.stage("contact"):
            contact = kept_contact(design, options.contact_method, CONTACT_SHARE * options.tolerance)
            case = Case(design=design, contact=contact, sizing=size(design, contact, options.fruit_stiffness))
        with clock.stage("flexures"):
            springs = print_springs(design, case.sizing, options.tolerance)
        with clock.stage("solids"):
            geometry = write_solids(design, springs, folder)
        with clock.stage("response"):
            found = case.respond(springs.compliance, design.fruit.E_MPa)
        with clock.stage("verdicts"):
            judged = judge(case, springs, geometry, found)
            verdicts = tuple(advised(verdict, options.tolerance) for verdict in judged) if springs.plain else judged
        added, entries = ((), {}) if more is None else more(case, springs, folder, clock)
        report = compose(case, springs, found, (*verdicts, *added)) | entries
        report["accuracy"] = accuracy_entry(options.tolerance, case.contact, springs)
        with clock.stage("solutions"):
            left_out = write_solutions(case, springs, folder, fields=options.fields)
            report["notes"] += [left_out] if left_out else []
        with clock.stage("tables"):
            (folder / "design.toml").write_text(reproducing(design, options), encoding="utf-8")
            table = response_table(case.judged(springs.stiffnesses, springs.errors), design.fruit.E_max_MPa)
            (folder / "response.csv").write_text(table, encoding="utf-8")
        report |= {"files": file_entries(folder), "seconds": clock.wall_seconds(), "cpu_seconds": clock.cpu_seconds()}
        write_report(report, folder)
    return RunResult(report=report, passed=all_passed((*verdicts, *added)))


def reproducing(design: Design, options: RunOptions) -> str:
    """Return the design file with the command that repeats the run as its first line."""
    flags = (
        f"--fruit-stiffness {options.fruit_stiffness} --contact-method {options.contact_method} "
        f"--tol {options.tolerance:g}"
    )
    return f"# pipeline run --design design.toml {flags}\n{design_as_toml(design)}"
