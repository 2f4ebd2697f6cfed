"""How many samples a second of processor time a stream is read at: `python tests/bench/stream.py [SAMPLES]`."""

import io
import sys
import time
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]

from measured_units import MeasuredDesign  # noqa: E402

from pipeline.measure.unit.presses import readings_of  # noqa: E402
from pipeline.measure.unit.signals import Signal, expected_header  # noqa: E402
from solve.contact.poses import Pose  # noqa: E402


def stream_of(measured: MeasuredDesign, samples: int) -> bytes:
    """Return a signal of presses of 500 samples, 500 in the air between them."""
    travel = measured.design.press.travel_mm
    press = measured.forces([Pose(E=1.5, travel=x) for x in np.linspace(0.05 * travel, travel, 20).tolist()])
    lines = [",".join(map(repr, row)) for row in np.repeat(press, 25, axis=0).tolist()]
    air = [",".join(["0.0"] * press.shape[1])] * len(lines)
    rows = (lines + air) * (1 + samples // (2 * len(lines)))
    text = "\n".join(f"{1e-3 * place:.3f},{row}" for place, row in enumerate(rows[:samples]))
    return f"{expected_header(press.shape[1])}\n{text}\n".encode()


def samples_a_second(measured: MeasuredDesign, samples: int, *, every_sample: bool) -> tuple[float, int]:
    """Return samples per second of processor time, and how many readings came out."""
    stream = io.BytesIO(stream_of(measured, samples))
    sensor = measured.measuring()
    started = time.process_time()
    signal = Signal(stream, "-", len(measured.K))
    count = sum(reading.E is not None for reading in readings_of(sensor, signal, every_sample=every_sample))
    return samples / (time.process_time() - started), count


def main(samples: int) -> None:
    """Print the rates of a square and of a pair, with a reading for each press and for each sample."""
    for name in ("mango", "paper"):
        measured = MeasuredDesign(name, assessed=False)
        for every_sample in (False, True):
            rate, count = samples_a_second(measured, samples // (10 if every_sample else 1), every_sample=every_sample)
            kind = "each sample" if every_sample else "each press"
            print(f"{name:6} a reading for {kind:11} {rate:9.0f} samples per CPU second, {count} readings")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
