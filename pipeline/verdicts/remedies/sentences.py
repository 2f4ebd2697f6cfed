"""The remedy of each verdict that did not pass, in a sentence with its computed number."""

import shlex
from collections.abc import Sequence
from dataclasses import replace

from cad.design.parameters import Design
from cad.verdict import Verdict
from pipeline.options import RunOptions
from pipeline.result import SensorResult
from pipeline.verdicts.remedies.changes import Changes, flags, in_digits, value_of
from pipeline.verdicts.remedies.own import own_remedy
from pipeline.verdicts.remedies.search import Search, nearest_passing, tried
from pipeline.verdicts.remedies.trial import Trials

BUDGET = 600  # hundredths of a processor second that a run may look for a remedy
_SHOWN = 3  # keys of a sentence, and alternatives


def with_remedies(result: SensorResult) -> tuple[Verdict, ...]:
    """Return the verdicts of a run, those that did not pass with what would make the whole design pass.

    A verdict that its own numbers can mend, like one that a smaller `--tol` decides, says that instead.
    """
    design, options = result.design, result.options
    wrong = [verdict for verdict in result.verdicts if verdict.passed is not True]
    if not wrong:
        return result.verdicts
    own = {verdict.name: own_remedy(verdict, design, result.springs, options) for verdict in wrong}
    open_, common = [name for name, remedy in own.items() if remedy is None], ""
    if open_:
        trials = Trials(BUDGET, result.press.ahead)
        trials.remember(design, result.contact)
        common = common_remedy(design, open_, trials, options)
    return tuple(
        verdict if verdict.passed is True else replace(verdict, remedy=own[verdict.name] or common)
        for verdict in result.verdicts
    )


def common_remedy(design: Design, wrong: Sequence[str], trials: Trials, options: RunOptions) -> str:
    """Return in a sentence what would make a design pass in which verdicts of these names do not."""
    itself = tried(design, {}, trials)
    if itself is None or not itself.trial.passes:
        return sentence(design, nearest_passing(design, wrong, trials))
    if options.fruit_stiffness == "hayes":
        return "passes with --fruit-stiffness contact, which sizes the springs for the true contact"
    return f"none found: with ideal springs all passes, and no key is known to mend {' and '.join(wrong[:_SHOWN])}"


def sentence(design: Design, search: Search) -> str:
    """Return what a search has found, in a sentence, that of a line with what is wrong with it."""
    head = "a line has no housing; " if design.tips.layout == "line" else ""
    if not search.passing:
        return head + _none(search)
    fewest = len(search.passing[0].changes)
    those = [one.changes for one in search.passing if len(one.changes) == fewest][:_SHOWN]
    alternatives = " or ".join(in_words(design, changes) for changes in those)
    return f"{head}passes with {alternatives}: {shlex.join(flags(those[0]))}"


def in_words(design: Design, changes: Changes) -> str:
    """Return changes in words, a number that alone is changed as the bound that it is."""
    alone = len(changes) == 1
    return " and ".join(_key_in_words(design, key, changes, alone=alone) for key in changes)


def _key_in_words(design: Design, key: str, changes: Changes, *, alone: bool) -> str:
    before, after = value_of(design, key), changes[key]
    if after is None:
        return f"{key} unset"
    if not isinstance(after, float):
        return f"{key} {after}"
    if not alone or not isinstance(before, float) or before * after <= 0.0:
        return f"{key} {after:.4g}"
    return f"{key} {'at most' if after < before else 'at least'} {after:.4g}"


def _none(search: Search) -> str:
    """Return that nothing tried passes, which keys that was, and what comes nearest."""
    if search.count == 0:
        return "none found: no key of the design is known to help, or every other value of it is refused"
    said = f"none found: of {search.count} designs with other {', '.join(search.keys)} none passes"
    if search.least is None:
        return said
    worst = search.least.trial.wrong[0]
    changes = in_digits(search.least.changes)
    value = "no value" if worst.value is None else f"{worst.value:.3g}"
    return f"{said}; nearest: {changes}, where {worst.name} still is {value} against {worst.limit}"
