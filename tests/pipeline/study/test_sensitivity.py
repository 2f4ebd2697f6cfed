"""Sobol indices of a study are those of its formula."""

import numpy as np
import pytest
from refusal import refusal

from pipeline.study import read_study, run_study
from pipeline.study.sensitivity import sensitivities
from pipeline.study.store import stored_study
from sensor.quantity import InputError

TEXT = """
base = "paper"
how = "sensitivity"
samples = 128
seed = 3
wanted = ["springs.K_h_N_per_m"]
[vary]
"targets.P_max" = { from = 3, to = 8 }
"fruit.E_max_MPa" = { from = 2, to = 5 }
"targets.NL" = { from = 0.02, to = 0.1 }
"""


def product_indices():
    """Return first and total index of K_h = E (1 - 2 NL) / (4 NL) K_m / E, a product of two independent factors.

    With the squared coefficients of variation a and b of the factors the variance is (1 + a)(1 + b) - 1, of which a
    alone makes a, b alone b, and both together a b.
    """
    E, NL = (np.linspace(*ends, 100_001) for ends in ((2.0, 5.0), (0.02, 0.1)))
    factor = (1.0 - 2.0 * NL) / (4.0 * NL)
    a, b = (np.var(values) / np.mean(values) ** 2 for values in (E, factor))
    whole = (1.0 + a) * (1.0 + b) - 1.0
    return {
        "targets.P_max": (0.0, 0.0),
        "fruit.E_max_MPa": (a / whole, (a + a * b) / whole),
        "targets.NL": (b / whole, (b + a * b) / whole),
    }


def test_indices_of_a_product(written, engine, tmp_path):
    study = read_study(written(TEXT))
    assert run_study(study, tmp_path / "out", engine).done == 5 * 128
    with stored_study(tmp_path / "out") as store:
        found = {one.key: one for one in sensitivities(store, study)}
    for key, (first, total) in product_indices().items():
        one = found[key]
        assert one.first_interval[0] <= first <= one.first_interval[1]
        assert one.total_interval[0] <= total <= one.total_interval[1]
        assert one.total == pytest.approx(total, abs=0.1)


def test_one_key_is_refused_before_anything_is_solved(written):
    refused = refusal(read_study, written(**{"samples = 8": 'how = "sensitivity"\nsamples = 8'}))
    assert (refused.field, refused.value) == ("vary", "targets.P_max")


def test_refused_points_leave_no_indices(written, engine, tmp_path):
    study = read_study(written(TEXT, **{"to = 8": "to = 200", "128": "4"}))
    refused = run_study(study, tmp_path / "out", engine).refused
    with stored_study(tmp_path / "out") as store, pytest.raises(InputError) as error:
        sensitivities(store, study)
    assert (error.value.field, error.value.value) == ("sensitivities", refused)
