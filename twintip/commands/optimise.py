"""`pipeline optimise`: the best design for a study file, proved by a run."""

from argparse import Namespace
from pathlib import Path

from pipeline.find.optimise import Place, is_base, places, prove, refuse_occupied, search, value_of_run
from pipeline.find.proved_candidate import Proof
from pipeline.study.engines import chosen_engine
from pipeline.study.store import stored_study
from pipeline.study.study_file import Study, read_study
from pipeline.study.study_page import BEST, write_page
from sensor.quantity import validation_error
from twintip.commands.console import FAILED, PASSED, Answer
from twintip.commands.progress import showing_progress


def run(arguments: Namespace) -> Answer:
    """Search for the best design, and prove it by a whole run of the pipeline.

    The exit code is 0 if all verdicts of that run pass, else 1. A study with a front (the best design at each value of
    one key) has one best design for each value, and the code is 0 if each of them passes.
    """
    study = read_study(arguments.file)
    if study.how != "search":
        hint = "leave samples and points out"
        raise validation_error("how", study.how, "", "search, with [optimise] in the file", hint)
    folder = arguments.out or Path("outputs") / study.name
    refuse_occupied(study, folder, force=arguments.force)
    with showing_progress("solves candidates") as work:
        with chosen_engine(arguments.processes, arguments.scheduler) as engine:
            candidates = search(study, folder, engine, work.count)
        proofs = {
            place: prove(study, candidates, place, force=arguments.force, progress=work)
            for place in places(study, folder)
        }
    solved = [candidate.number for candidate in candidates if candidate.verdicts is not None]
    proved = {proof.candidate.number: place.design for place, proof in proofs.items() if proof and proof.passed}
    best = list(proved) if study.front and proved else solved[:BEST]
    with stored_study(folder) as store:
        page = write_page(store, study, best, proved, force=arguments.force)
        messages = store.messages()
    possible = sum(candidate.passes for candidate in candidates)
    counts = {"candidates": len(candidates), "possible": possible, "messages": messages}
    lines = [f"{len(candidates)} candidates, {possible} of them pass the verdicts that the file names"]
    lines += [f"  {count} x {message}" for message, count in messages.items()]
    if solved or proved:
        for place, proof in proofs.items():
            lines += _best_design_lines(study, place, proof)
    else:
        lines.append("no candidate has results: change what the messages name, under [vary], [set] or in the base")
    return Answer(
        code=PASSED if len(proved) == len(proofs) else FAILED,
        data={**counts, **_best_design_data(study, proofs)},
        text="\n".join([*lines, str(page)]),
    )


def _best_design_data(study: Study, proofs: dict[Place, Proof | None]) -> dict[str, object]:
    """Return the best design and whether its run passed, as data for `--json`; of a front, those at each value."""
    answers: list[dict[str, object]] = []
    for place, proof in proofs.items():
        answer: dict[str, object] = {"at": place.value} if study.front else {}
        answer |= {"design": None, "passed": None}
        if proof is not None:
            best = proof.candidate
            answer |= {"design": str(place.design) if proof.passed else None, "passed": proof.passed}
            answer |= {"value": best.number_found, "settings": dict(best.changes)}
        answers.append(answer)
    return {"front": answers} if study.front else answers[0]


def _best_design_lines(study: Study, place: Place, proof: Proof | None) -> list[str]:
    """Return lines on the best design: its objective, the keys that it changes, and whether its whole run passed.

    Of a front, `place` is the value of its key at which this design is the best. `proof` is None if no candidate
    passed the search.
    """
    front_value = f" at {study.goal.front_key} = {place.value}" if study.front else ""
    if proof is None:
        return [f"no candidate passes{front_value}: widen the spans under [vary], or name fewer verdicts"]
    best = proof.candidate
    objective = best.number_found
    if objective is None and not proof.passed:
        last = "the base design" if is_base(study, best) else f"point {best.number}"
        outcome = "is rejected as wrong input" if proof.result is None else "does not pass its run"
        advice = "correct the base design, or widen the spans under [vary]"
        return [f"no candidate passes{front_value}, and {last} {outcome}: {advice}"]
    title = "best" if proof.passed else "the last design that was run, because none passes all verdicts"
    run_objective = value_of_run(study, proof)
    in_search = "no number in the search" if objective is None else f"{objective:.4g}"
    in_run = "" if run_objective is None else f", {run_objective:.4g} in its run"
    lines = [f"{title}{front_value}: {study.goal.minimise} {in_search} at point {best.number}{in_run}"]
    for key, value in best.changes.items():
        lines.append(f"  {key} = {value if isinstance(value, str | list) else f'{value:.6g}'}")
    if is_base(study, best):
        lines.append(f"no candidate improves on the base design{front_value}")
    lines.append(f"its run {'passes' if proof.passed else 'does not pass'} all verdicts")
    return [*lines, str(place.design if proof.passed else place.run)]
