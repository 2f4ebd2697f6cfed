"""What a read-out makes of forces: counts, noise and drift by the formulas of probe and converter."""

import math
from collections import Counter
from dataclasses import replace

import pytest
from emulated_board import wires_of

from cad.fabrication.wiring import count_wires, write_wiring
from sensor.design.design_file import design_as_mapping, design_from_mapping
from sensor.design.processes import PROCESSES
from sensor.design.readout import Readout
from sensor.design.signal_path import SpringToRead, signal_path
from sensor.quantity import InputError

PETG = PROCESSES["fdm-petg"]
SPRINGS = (
    SpringToRead(name="low", K=0.15, deflection=0.8),
    SpringToRead(name="high", K=1.6, deflection=0.7),
)
KINDS = ("low", "high", "low", "high")


def test_probe_gives_counts_noise_and_drift():
    found = signal_path(Readout(tare_K=0.0), SPRINGS, PETG, KINDS)
    assert found.counts_per_N[1] == pytest.approx(1.05 / 1.6 / 3.3 * 2**23)
    assert found.noise_N[1] == pytest.approx(1.6 * math.hypot(0.055e-3, 12e-6 / 1.05))
    assert found.zero_drift_N[1] == pytest.approx(1.6 * 1.4e-3)
    assert found.noises_N[0] == pytest.approx(math.hypot(found.noise_N[0], 1.0 / found.counts_per_N[0] / 12.0**0.5))
    assert found.full_counts == ()  # until the largest forces are known
    full_counts = found.with_full_scale((0.1, 1.0, 0.2, 0.9)).full_counts
    assert [counts / found.counts_per_N[1] for counts in full_counts[1::2]] == pytest.approx([1.0, 0.9])
    assert found.gain_drift_percent == pytest.approx([math.hypot(0.5, 0.15, 0.002)] * 4)
    assert found.modulus_drift_percent == pytest.approx(1.5)
    typed = Readout(noise_um=5.0, sensitivity_mV_per_mm=100.0, bits=16.0, full_scale_mV=500.0)
    other = signal_path(typed, SPRINGS, PETG, KINDS)
    assert other.counts_per_N[1] == pytest.approx(0.1 / 1.6 / 0.5 * 2**15)
    assert other.noise_N[1] == pytest.approx(1.6 * 5e-3, rel=1e-3)
    assert other.saturation_counts == 2**15 - 1
    # a board that waits for each conversion is late by 0.3 ms of 24 ms
    assert Readout(rate_Hz=40.0).largest_time_error_ms == pytest.approx(25.0 * 0.3 / 24.0)


def test_process_without_its_drift_is_refused_beside_a_read_out():
    design = design_from_mapping({"readout": {}, "reading": {}})
    own = replace(PETG, name="mine", E_per_K=None, sources=tuple(row for row in PETG.sources if row[0] != "E_per_K"))
    with pytest.raises(InputError) as error:
        replace(design, printer=own, print=replace(design.print, process="mine"))
    assert error.value.field == "printer.E_per_K"


def test_a_design_with_a_read_out_is_read_back_without_its_noise():
    design = design_from_mapping({"readout": {}, "reading": {}})
    tables = design_as_mapping(design)
    assert design_from_mapping(tables) == design
    assert not {"noise_percent", "noise_N"} & tables["reading"].keys()
    plain = design_as_mapping(design_from_mapping({"reading": {}}))
    assert "readout" not in plain
    assert {"noise_percent", "noise_N"} <= plain["reading"].keys()


CHANNELS = ("low_1", "high_1", "low_2", "high_2")
WIRES = Counter([("OUT", f"AIN{i}") for i in range(4)]) + Counter(
    [(pin, f"GP{2 + i}") for i, pin in enumerate(("SCLK", "DIN", "DOUT", "CS", "DRDY"))]
)


def test_wiring_plan_joins_the_pins_of_every_channel(tmp_path):
    path = tmp_path / "wiring.svg"
    write_wiring(path, CHANNELS, 2, "rp2040")
    joined = Counter(wires_of(path))
    assert joined == WIRES
    # The supply and the ground of four sensors and of the amplifier have no lines, but labels.
    assert count_wires(len(CHANNELS), "rp2040") == joined.total() + 2 * 4 + 2
    assert path.read_text(encoding="utf-8").count('class="capacitor"') == 5
    assert path.read_text(encoding="utf-8").count("high_2, plate 2") == 1
