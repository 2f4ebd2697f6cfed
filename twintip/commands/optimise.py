"""`pipeline optimise`: the best design for the goal in a study file, verified by a whole run."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from pipeline.find.candidate import Candidate
from pipeline.find.optimise import Place, is_base, places, prove, refuse_occupied, search, value_of_run
from pipeline.find.proved_candidate import Proof
from pipeline.study.engines import chosen_engine
from pipeline.study.store import stored_study
from pipeline.study.study_file import Study, read_study
from pipeline.study.study_page import BEST, write_page
from sensor.quantity import validation_error
from twintip.commands.console import FAILED, PASSED, Answer
from twintip.commands.progress import showing_progress

_NOTHING_SOLVED = (
    "No candidate could be solved. Change the values that these messages name, in [vary], [set] or the base."
)


def run(arguments: Namespace) -> Answer:
    """Search for the best design, and verify it by a whole run of the pipeline.

    The exit code is 0 if all verdicts of that run pass, and 1 if not. A study with a front has one best design for each
    value of the front's key. For such a study, the code is 0 if the runs of all best designs pass. Raises InputError if
    the file describes no search.
    """
    study = read_study(arguments.file)
    if study.how != "search":
        hint = "leave out samples and points"
        raise validation_error("how", study.how, "", "search, with a table [optimise] in the file", hint)
    folder = arguments.out or Path("outputs") / study.name
    refuse_occupied(study, folder, force=arguments.force)
    candidates, proofs = _search_and_prove(arguments, study, folder)
    # The numbers of all candidates that could be solved, the best first.
    solved = [candidate.number for candidate in candidates if candidate.verdicts is not None]
    # The design file of each candidate whose run passed, keyed by the number of the candidate.
    proved = {proof.candidate.number: place.design for place, proof in proofs.items() if proof and proof.passed}
    page, messages = _write_study_page(study, folder, solved, proved, force=arguments.force)
    passing_count = sum(candidate.passes for candidate in candidates)
    counts = {"candidates": len(candidates), "possible": passing_count, "messages": messages}
    lines = _search_lines(len(candidates), passing_count, messages)
    if solved or proved:
        lines += _proof_lines(study, proofs)
    else:
        lines.append(_NOTHING_SOLVED)
    return Answer(
        code=PASSED if len(proved) == len(proofs) else FAILED,
        data={**counts, **_best_design_data(study, proofs)},
        text="\n".join([*lines, str(page)]),
    )


def _search_and_prove(
    arguments: Namespace, study: Study, folder: Path
) -> tuple[Sequence[Candidate], dict[Place, Proof | None]]:
    """Search for the best designs and run them. Return all candidates, the best first, and the last run of each place.

    There is one place for the best design, or with a front, one for each value of the front's key. The proof of a place
    is None if no candidate was run. Progress is shown on stderr.
    """
    with showing_progress("solving candidates") as work:
        with chosen_engine(arguments.processes, arguments.scheduler) as engine:
            candidates = search(study, folder, engine, work.count)
        proofs = {
            place: prove(study, candidates, place, force=arguments.force, progress=work)
            for place in places(study, folder)
        }
    return candidates, proofs


def _write_study_page(
    study: Study, folder: Path, solved: list[int], proved: dict[int, Path], *, force: bool
) -> tuple[Path, dict[str, int]]:
    """Write the page of a search, and return its path and the most frequent error messages of the candidates.

    `solved` holds the numbers of the candidates that could be solved, the best first. `proved` maps the number of each
    candidate whose run passed to its design file. The page shows the designs of a front whose runs passed, or else the
    best candidates of the search.
    """
    has_proved_front = bool(study.front and proved)
    best = list(proved) if has_proved_front else solved[:BEST]
    with stored_study(folder) as store:
        page = write_page(store, study, best, proved, force=force)
        return page, store.messages()


def _search_lines(candidates: int, passing: int, messages: dict[str, int]) -> list[str]:
    """Return the lines on the search: the numbers of all and of passing candidates, and the most frequent errors.

    `messages` maps each error message to the number of candidates that have it.
    """
    lines = [f"{candidates} candidates, of which {passing} pass the verdicts that the file names"]
    lines += [f"  {count} x {message}" for message, count in messages.items()]
    return lines


def _proof_lines(study: Study, proofs: dict[Place, Proof | None]) -> list[str]:
    """Return the lines on the best design, or on the best design for each value of the front's key."""
    return [line for place, proof in proofs.items() for line in _best_design_lines(study, place, proof)]


def _best_design_data(study: Study, proofs: dict[Place, Proof | None]) -> dict[str, object]:
    """Return data for `--json`: the record of the best design.

    `proofs` holds the last run for each place, or None if no candidate was run. A study with a front has a record for
    each value of the front's key, which is stored as "at". These records are listed under "front".
    """
    if not study.front:
        [(place, proof)] = proofs.items()  # without a front, there is only one place
        return _proof_record(place, proof)
    return {"front": [{"at": place.value, **_proof_record(place, proof)} for place, proof in proofs.items()]}


def _proof_record(place: Place, proof: Proof | None) -> dict[str, object]:
    """Return the path of the best design, whether its run passed, its objective, and the keys that it changes.

    The path is None unless the run passed. If no candidate was run, `proof` is None, and the record has neither an
    objective nor changed keys.
    """
    if proof is None:
        return {"design": None, "passed": None}
    best = proof.candidate
    return {
        "design": str(place.design) if proof.passed else None,
        "passed": proof.passed,
        "value": best.number_found,
        "settings": dict(best.changes),
    }


def _best_design_lines(study: Study, place: Place, proof: Proof | None) -> list[str]:
    """Return the lines on the best design: its objective, the keys that it changes, and the outcome of its whole run.

    In a study with a front, `place` holds the value of the front's key for which this design is the best. `proof` is
    None if there was no candidate to run. If the design has no objective and its run does not pass, the only line says
    what to change.
    """
    at_value = f" at {study.goal.front_key} = {place.value}" if study.front else ""
    if proof is None:
        return [f"no candidate passes{at_value}: widen the spans under [vary], or name fewer verdicts"]
    best = proof.candidate
    if best.number_found is None and not proof.passed:
        subject = "the base design" if is_base(study, best) else f"point {best.number}"
        outcome = "is rejected as wrong input" if proof.result is None else "does not pass its run"
        advice = "correct the base design, or widen the spans under [vary]"
        return [f"no candidate passes{at_value}, and {subject} {outcome}: {advice}"]
    lines = [_objective_line(study, proof, at_value)]
    for key, value in best.changes.items():
        value_text = value if isinstance(value, str | list) else f"{value:.6g}"
        lines.append(f"  {key} = {value_text}")
    if is_base(study, best):
        lines.append(f"no candidate improves on the base design{at_value}")
    lines.append(f"its run {'passes' if proof.passed else 'does not pass'} all verdicts")
    # A design file is written only if the run passes. Otherwise, the line names the folder of the run.
    return [*lines, str(place.design if proof.passed else place.run)]


def _objective_line(study: Study, proof: Proof, at_value: str) -> str:
    """Return the line on the objective of the best design in the search and in its whole run.

    `at_value` names the value of the front's key, or is empty without a front.
    """
    best = proof.candidate
    title = "best" if proof.passed else "the last design that was run, because none passes all verdicts"
    run_objective = value_of_run(study, proof)
    in_search = "no value in the search" if best.number_found is None else f"{best.number_found:.4g}"
    in_run = "" if run_objective is None else f", {run_objective:.4g} in its run"
    return f"{title}{at_value}: {study.goal.minimise} {in_search} at point {best.number}{in_run}"
