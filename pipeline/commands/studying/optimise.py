"""`pipeline optimise`: the best design that a study file asks for, proved by a run."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from cad.quantity import validation_error
from pipeline.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_json
from pipeline.commands.studying.study import add_engine_flags, refuse_two_engines

if TYPE_CHECKING:
    from pipeline.study.optimise import Candidate, Proof

PURPOSE = "find the design that makes a number least while verdicts pass"
EXAMPLE = "pipeline optimise sharper.toml"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the study file and where it runs."""
    parser.add_argument(
        "file", metavar="FILE.toml", type=Path, help="a study file with [optimise], see docs/studies.md"
    )
    add_engine_flags(parser)
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Search, prove the best candidate by a run, print it; return 0 when all verdicts of the run pass, else 1."""
    from pipeline.study.optimise import base_candidate, prove, refuse_occupied, search
    from pipeline.study.page import PAGE, write_page
    from pipeline.study.store import stored_study
    from pipeline.study.study_file import read_study
    from pipeline.study.workers import chosen_engine, shown_progress

    study = read_study(arguments.file)
    if study.how != "search":
        raise validation_error(
            "how", study.how, "", "search, with [optimise] in the file", "leave samples and points out"
        )
    refuse_two_engines(arguments)
    folder = arguments.out or Path("outputs") / study.name
    refuse_occupied(folder, force=arguments.force)
    with chosen_engine(arguments.processes, arguments.scheduler) as engine, shown_progress() as progress:
        candidates = search(study, folder, engine, progress)
    with stored_study(folder) as store:
        best = [candidate.result.number for candidate in candidates if candidate.result.status == "done"]
        write_page(store, study, folder / PAGE, best, force=arguments.force)
        proof = prove(study, candidates, folder, force=arguments.force)
        messages = store.messages()
    with answering():
        if arguments.json:
            print_json(_as_mapping(candidates, proof, messages))
        else:
            _print_counts(candidates, messages)
            _print_proof(candidates, proof, folder)
            print(folder / PAGE)
            if proof is not None and proof.candidate == base_candidate(study, candidates):
                print("nothing better than the base was found: it is the base itself")
    return PASSED if proof is not None and proof.passed else FAILED


def _as_mapping(
    candidates: "tuple[Candidate, ...]", proof: "Proof | None", messages: dict[str, int]
) -> dict[str, object]:
    data: dict[str, object] = {
        "candidates": len(candidates),
        "possible": sum(candidate.violation == 0.0 for candidate in candidates),
        "messages": messages,
        "design": None,
        "passed": None,
    }
    if proof is not None:
        data["design"] = None if proof.design is None else str(proof.design)
        data["passed"] = proof.passed
        data["value"] = proof.candidate.value
        data["settings"] = dict(proof.candidate.result.settings)
    return data


def _print_counts(candidates: "tuple[Candidate, ...]", messages: dict[str, int]) -> None:
    possible = sum(candidate.violation == 0.0 for candidate in candidates)
    print(f"{len(candidates)} candidates, {possible} of them pass the verdicts that the file names")
    for message, count in messages.items():
        print(f"  {count} x {message}")


def _print_proof(candidates: "tuple[Candidate, ...]", proof: "Proof | None", folder: Path) -> None:
    """Print the best candidate and how its run ended, or why there is none."""
    if proof is None:
        if any(candidate.result.status == "done" for candidate in candidates):
            print("no candidate passes: widen the spans under [vary], or name fewer verdicts")
        else:
            print("no candidate has results: change what the messages name, under [vary], [set] or in the base")
        return
    best = proof.candidate
    title = "best" if proof.passed else "the last that was run, as none passes in full"
    print(f"{title}: {best.value:.4g} at point {best.result.number}")
    for key, value in best.result.settings.items():
        shown = f"{value:.6g}" if isinstance(value, float) else value
        print(f"  {key} = {shown}")
    print(f"its run {'passes' if proof.passed else 'does not pass'} all verdicts")
    print(proof.design or folder / "best")
