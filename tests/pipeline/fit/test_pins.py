"""Pins and gauges in the fit: what pins give is in the stiffness and in its error, and is made good in the aim."""

import numpy as np
import pytest

from cad.design.parameters import Design, Tips
from cad.design.processes import PROCESSES
from cad.parts.layout import housing_for
from cad.parts.pin_socket import pin_give
from cad.quantity import InputError
from pipeline.fit.pins import feet_targets, with_pins
from solve.housing.stiffness import HousingStiffness

PETG = PROCESSES["fdm-petg"]
MATERIAL = (PETG.E_MPa, PETG.poisson)
PRINTED = housing_for(Design(), PETG, (28.9, 14.8), (0.5, 0.11))
PINNED = housing_for(Design(tips=Tips(socket="pin")), PETG, (28.9, 14.8), (0.5, 0.11))


def stiffness(K, error=0.05):
    return HousingStiffness(
        C=np.array([[1.0 / K[0], 1e-6], [1e-6, 1.0 / K[1]]]), K=K, error_percent=(error, error),
        strain_per_N=(1e-3, 1e-3), strain_error_percent=(1.0, 1.0), tilt_per_N=(0.0, 0.0), dofs=1, seconds=0.0,
        status="",
    )  # fmt: skip


def test_pins_add_their_give_to_the_compliance_and_half_its_span_to_the_error():
    give = pin_give(PINNED, *MATERIAL)
    found = with_pins(stiffness((0.906, 20.83)), PINNED, MATERIAL)
    for K, foot, error in zip(found.K, (0.906, 20.83), found.error_percent, strict=True):
        assert pytest.approx(1.0 / foot + give.compliance) == 1.0 / K
        assert error == pytest.approx(0.05 * K / foot + 100.0 * K * give.error)
        soft, hard = 1.0 / (1.0 / K + give.error), 1.0 / (1.0 / K - give.error)
        assert max(1.0 - soft / K, hard / K - 1.0) < 0.01 * error
    assert found.C[0, 1] == 1e-6
    printed = stiffness((0.906, 20.83))
    assert with_pins(printed, PRINTED, MATERIAL) is printed


def test_feet_are_stiffer_than_the_targets_by_what_the_pins_give():
    targets = (0.906, 20.83)
    feet = feet_targets(PINNED, targets, MATERIAL)
    assert pytest.approx(targets) == with_pins(stiffness(feet), PINNED, MATERIAL).K
    assert feet_targets(PRINTED, targets, MATERIAL) == targets


def test_target_that_pins_alone_cannot_carry_is_refused():
    with pytest.raises(InputError, match=r"flexures\.high\.stiffness = 9000 N/mm: must be less than 5250 N/mm"):
        feet_targets(PINNED, (1.0, 9000.0), MATERIAL)
