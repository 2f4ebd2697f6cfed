"""Hard cases: each ends in a right answer inside its error bar, or in a refusal that names the cause; nothing else."""

import dataclasses
import json
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from rich.console import Console

from pipeline.bench.hard import contact as hard_contact
from pipeline.bench.hard import flexure as hard_flexure
from pipeline.bench.hard import press as hard_press
from pipeline.bench.hard.reference_check import Ending, HardCase, settle
from pipeline.bench.table import Sheet, percent, write_whole

OUT = Path("outputs") / "bench"
WIDTH = 190


def hard(*, as_json: bool, out: Path = OUT, cases: Iterable[HardCase] | None = None) -> int:
    """Settle every case, print the table or JSON, write hard.json and hard.md; return 0, or 1 when one is wrong."""
    endings = []
    for case in every_case() if cases is None else cases:
        endings.append(settle(case))
        print(f"  {endings[-1].verdict:8} {case.group}: {case.what}", file=sys.stderr, flush=True)
    sheet = hard_sheet(endings)
    text = json.dumps({"schema": 1, "cases": list(sheet.records)}, indent=2, allow_nan=False)
    write_whole(out, {"hard.json": text + "\n", "hard.md": sheet.markdown()})
    if as_json:
        print(text)
    else:
        sheet.print_on(Console(width=None if sys.stdout.isatty() else WIDTH))
    return 1 if any(one.verdict == "WRONG" for one in endings) else 0


def every_case() -> Iterator[HardCase]:
    """Yield the cases of contact, press, springs, leaves, meshes and clamps."""
    for group in (hard_contact, hard_press, hard_flexure):
        yield from group.cases()


def hard_sheet(endings: Sequence[Ending]) -> Sheet:
    """Return the table of the endings."""
    rows, records = [], []
    for one in endings:
        claim = one.claim
        numbers = ("-", "-", "-", "-")
        if claim is not None:
            scale = abs(claim.value) or 1.0
            numbers = (
                f"{claim.name} {claim.value:.6g}",
                percent(claim.bar / scale).lstrip("+"),
                f"{claim.reference:.6g}",
                percent((claim.value - claim.reference) / scale),
            )
        rows.append((f"{one.group}: {one.what}", *numbers, one.verdict, one.words))
        records.append(
            {"group": one.group, "what": one.what, "verdict": one.verdict, "words": one.words,
             "claim": None if claim is None else _finite(dataclasses.asdict(claim))}
        )  # fmt: skip
    count = {verdict: sum(one.verdict == verdict for one in endings) for verdict in ("right", "refused", "WRONG")}
    return Sheet(
        name="hard",
        title=f"hard cases: {count['right']} right, {count['refused']} refused, {count['WRONG']} wrong",
        heads=("case", "value", "error bar", "reference", "difference", "verdict", "by, or reason"),
        rows=tuple(rows),
        records=tuple(records),
    )


def _finite(record: dict[str, object]) -> dict[str, object]:
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in record.items()}
