"""`pipeline optimise`: the best design that a study file asks for, proved by a run."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from cad.quantity import validation_error
from pipeline.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_json
from pipeline.commands.studying.study import add_engine_flags

if TYPE_CHECKING:
    from pipeline.study.optimise import Proof

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
    from pipeline.study.optimise import is_base, prove, refuse_occupied, search
    from pipeline.study.page import write_page
    from pipeline.study.store import stored_study
    from pipeline.study.study_file import read_study
    from pipeline.study.workers import chosen_engine, shown_progress

    study = read_study(arguments.file)
    if study.how != "search":
        hint = "leave samples and points out"
        raise validation_error("how", study.how, "", "search, with [optimise] in the file", hint)
    folder = arguments.out or Path("outputs") / study.name
    refuse_occupied(folder, force=arguments.force)
    with chosen_engine(arguments.processes, arguments.scheduler) as engine, shown_progress() as progress:
        candidates = search(study, folder, engine, progress)
    possible = sum(candidate.violation == 0.0 for candidate in candidates)
    done = [candidate.result.number for candidate in candidates if candidate.result.status == "done"]
    with stored_study(folder) as store:
        page = write_page(store, study, done, force=arguments.force)
        messages = store.messages()
    proof = prove(study, candidates, folder, force=arguments.force)
    with answering():
        if arguments.json:
            counts = {"candidates": len(candidates), "possible": possible, "messages": messages}
            print_json({**counts, **_as_mapping(proof)})
        else:
            print(f"{len(candidates)} candidates, {possible} of them pass the verdicts that the file names")
            for message, count in messages.items():
                print(f"  {count} x {message}")
            if proof is not None:
                _print_proof(proof, folder)
            elif done:
                print("no candidate passes: widen the spans under [vary], or name fewer verdicts")
            else:
                print("no candidate has results: change what the messages name, under [vary], [set] or in the base")
            print(page)
            if proof is not None and is_base(study, proof.candidate):
                print("nothing better than the base was found: it is the base itself")
    return PASSED if proof is not None and proof.passed else FAILED


def _as_mapping(proof: "Proof | None") -> dict[str, object]:
    if proof is None:
        return {"design": None, "passed": None}
    return {
        "design": None if proof.design is None else str(proof.design),
        "passed": proof.passed,
        "value": proof.candidate.value,
        "settings": dict(proof.candidate.result.settings),
    }


def _print_proof(proof: "Proof", folder: Path) -> None:
    """Print the best candidate and how its run ended."""
    best = proof.candidate
    title = "best" if proof.passed else "the last that was run, as none passes in full"
    print(f"{title}: {best.value:.4g} at point {best.result.number}")
    for key, value in best.result.settings.items():
        print(f"  {key} = {value:.6g}")
    print(f"its run {'passes' if proof.passed else 'does not pass'} all verdicts")
    print(proof.design or folder / "best")
