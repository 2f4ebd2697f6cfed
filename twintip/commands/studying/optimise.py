"""`pipeline optimise`: the best design that a study file asks for, proved by a run."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from sensor.quantity import validation_error
from twintip.commands.console import FAILED, PASSED, add_force_flag, add_json_flag, answering, print_json
from twintip.commands.studying.study import add_engine_flags

if TYPE_CHECKING:
    from pipeline.study.optimise import Place
    from pipeline.study.search.candidate import Candidate
    from pipeline.study.search.proof import Proof
    from pipeline.study.study_file import Study

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
    """Search, prove the best candidate by a run, print it; return 0 when all verdicts of the run pass, else 1.

    Of a front that is done for each value, and 0 is returned where all of them have a design.
    """
    from pipeline.study.optimise import places, prove, refuse_occupied, search
    from pipeline.study.page import BEST, write_page
    from pipeline.study.store import stored_study
    from pipeline.study.study_file import read_study
    from pipeline.study.workers import chosen_engine, shown_progress

    study = read_study(arguments.file)
    if study.how != "search":
        hint = "leave samples and points out"
        raise validation_error("how", study.how, "", "search, with [optimise] in the file", hint)
    folder = arguments.out or Path("outputs") / study.name
    refuse_occupied(study, folder, force=arguments.force)
    with chosen_engine(arguments.processes, arguments.scheduler) as engine, shown_progress() as progress:
        candidates = search(study, folder, engine, progress)
    proofs = {place: prove(study, candidates, place, force=arguments.force) for place in places(study, folder)}
    done = [candidate.number for candidate in candidates if candidate.verdicts is not None]
    proved = {proof.candidate.number: place.design for place, proof in proofs.items() if proof and proof.passed}
    best = list(proved) if study.front and proved else done[:BEST]
    with stored_study(folder) as store:
        page = write_page(store, study, best, proved, force=arguments.force)
        messages = store.messages()
    with answering():
        if arguments.json:
            _print_json(study, candidates, messages, proofs)
        else:
            _print(study, candidates, messages, proofs)
            print(page)
    return PASSED if len(proved) == len(proofs) else FAILED


def _print_json(
    study: "Study", candidates: "tuple[Candidate, ...]", messages: dict[str, int], proofs: "dict[Place, Proof | None]"
) -> None:
    """Print the number of candidates, and the proof of the best one; of a front those of all its values."""
    possible = sum(candidate.passes for candidate in candidates)
    counts = {"candidates": len(candidates), "possible": possible, "messages": messages}
    answers = [_as_mapping(place, proof) for place, proof in proofs.items()]
    if not study.front:
        print_json({**counts, **answers[0]})
        return
    of_front = [{"at": place.value, **answer} for place, answer in zip(proofs, answers, strict=True)]
    print_json({**counts, "front": of_front})


def _print(
    study: "Study", candidates: "tuple[Candidate, ...]", messages: dict[str, int], proofs: "dict[Place, Proof | None]"
) -> None:
    """Print the number of candidates, why some were refused, and the proof of the best one, or of each of a front."""
    possible = sum(candidate.passes for candidate in candidates)
    print(f"{len(candidates)} candidates, {possible} of them pass the verdicts that the file names")
    for message, count in messages.items():
        print(f"  {count} x {message}")
    is_proved = any(proof is not None and proof.passed for proof in proofs.values())
    if not is_proved and all(candidate.verdicts is None for candidate in candidates):
        print("no candidate has results: change what the messages name, under [vary], [set] or in the base")
        return
    for place, proof in proofs.items():
        _print_proof(study, place, proof)


def _as_mapping(place: "Place", proof: "Proof | None") -> dict[str, object]:
    """Return the proof of the best candidate as the data of `--json`."""
    if proof is None:
        return {"design": None, "passed": None}
    return {
        "design": str(place.design) if proof.passed else None,
        "passed": proof.passed,
        "value": proof.candidate.number_found,
        "settings": dict(proof.candidate.changes),
    }


def _print_proof(study: "Study", place: "Place", proof: "Proof | None") -> None:
    """Print the best candidate, of a front that at the value of the place, and how its run ended."""
    from pipeline.study.optimise import is_base, value_of_run

    at = f" at {study.goal.front} = {place.value}" if study.front else ""
    if proof is None:
        print(f"no candidate passes{at}: widen the spans under [vary], or name fewer verdicts")
        return
    best = proof.candidate
    found = best.number_found
    if found is None and not proof.passed:
        last = "the base" if is_base(study, best) else f"point {best.number}"
        fate = "is refused by its run" if proof.result is None else "does not pass in its run"
        print(f"no candidate passes{at}, and {last} {fate}: mend the base, or widen the spans under [vary]")
        return
    title = "best" if proof.passed else "the last that was run, as none passes in full"
    of_run = value_of_run(study, proof)
    in_search = "no number in the search" if found is None else f"{found:.4g}"
    in_run = "" if of_run is None else f", {of_run:.4g} in its run"
    print(f"{title}{at}: {study.goal.minimise} {in_search} at point {best.number}{in_run}")
    for key, value in best.changes.items():
        print(f"  {key} = {value if isinstance(value, str | list) else f'{value:.6g}'}")
    if is_base(study, best):
        print(f"nothing better than the base was found{at}: it is the base itself")
    print(f"its run {'passes' if proof.passed else 'does not pass'} all verdicts")
    print(place.design if proof.passed else place.run)
