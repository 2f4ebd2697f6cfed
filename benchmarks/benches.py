"""The calibration of each preset on three benches: the uncertainties that it leaves in springs and modulus.

`python -m benchmarks.benches` writes docs/measurements.md.
"""

from benchmarks.harness import percent, section, write_section
from pipeline import RunOptions, load_design
from pipeline.find.fruit_design import PRESETS
from pipeline.reading.bench_uncertainty import refuse_bench_that_cannot_weigh
from pipeline.sensor import Sensor
from sensor.quantity import STANDARD_GRAVITY, InputError

BENCHES = {
    "kitchen: 1 g, 0.1 mm": {"bench.balance_g": 1.0, "bench.balance_max_g": 2000.0, "bench.dial_mm": 0.1},
    "default: 0.01 g, 0.01 mm": {},
    "laboratory: 1 mg, 1 um": {"bench.balance_g": 0.001, "bench.dial_mm": 0.001},
}
HEADS = ["preset", "bench", "low, high spring", "by", "uncertainty of E, limit", "at", "`reading.uncertainty`"]
HEADS += ["`reading.calibration`"]
INTRODUCTION = """\
`python -m benchmarks.benches` writes this section: each preset with three
[benches](read-a-fruit.md#what-a-bench-leaves), in a kitchen, by default, and in a laboratory. Numbers are standard
uncertainties. The uncertainty of E is given at the modulus where its ratio to the limit is largest. Springs are exactly
as stiff as designed. A kitchen balance weighs up to 2 kg."""
OUTCOMES = {True: "passed", False: "failed", None: "undecided"}


def bench_row(name: str, bench: str) -> list[str]:
    """Return the table row of a preset on a bench, with a cell for each of `HEADS`.

    `name` is the name of the preset, and `bench` is a key of `BENCHES`. If a run would reject the bench, the last cell
    is "refused by a run". Raises ValueError for a preset without `[reading]`.
    """
    design = load_design(name, BENCHES[bench])
    # Sized springs have exactly the designed stiffness, and a sensor with them does not check its bench.
    sensor = Sensor(design=design, options=RunOptions(), springs_as="sized")
    readings = sensor.readings
    if readings is None or readings.calibration is None:
        msg = f"{name}: the preset has no readings, so its calibration is unknown. Add [reading] to the preset."
        raise ValueError(msg)
    calibration = readings.calibration
    worst = readings.worst_uncertainty  # at the modulus where its ratio to the limit is largest
    # All tips of a group have equal springs, so the first tip represents its group.
    low, high = (calibration.stiffness_percent[tips[0]] for tips in design.tips.spring_groups)
    verdicts = [sensor.verdict(f"reading.{key}") for key in ("uncertainty", "calibration")]
    outcomes = ["-" if verdict is None else OUTCOMES[verdict.passed] for verdict in verdicts]
    try:
        refuse_bench_that_cannot_weigh(design)
    except InputError:
        outcomes[-1] = "refused by a run"
    uncertainty = f"{percent(worst.sources.total)}, {percent(worst.uncertainty_limit)}"
    return [name, bench, f"{low:.2g}, {high:.2g} %", calibration.by, uncertainty, f"{worst.E:g} MPa", *outcomes]


def full_scale_text(name: str) -> str:
    """Return the name of a preset and the largest forces on its low and high tips [g], as text."""
    sensor = Sensor(design=load_design(name), options=RunOptions(), springs_as="sized")
    forces = () if sensor.readings is None else sensor.readings.full_scale or ()
    grams = [f"{1e3 * forces[tips[0]] / STANDARD_GRAVITY:.3g}" for tips in sensor.design.tips.spring_groups]
    return f"{name} {' and '.join(grams)}"


def main() -> None:
    """Compute the rows of all presets on all benches, and write and print the section."""
    rows = [bench_row(name, bench) for name in PRESETS for bench in BENCHES]
    scales = f"Largest forces of a low and a high tip, in g: {'; '.join(map(full_scale_text, PRESETS))}."
    write_section("Benches", INTRODUCTION, [section("Presets on three benches", HEADS, rows, [scales])])


if __name__ == "__main__":
    main()
