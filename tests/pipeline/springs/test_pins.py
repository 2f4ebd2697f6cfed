"""Pins in the fit: what they give is in the stiffness and in its error, and is made good in the aim."""

import numpy as np
import pytest
from refusal import refusal
from stand_ins import PETG, default_housing, housing_stiffness

from cad.parts.pin import pin_compliance
from pipeline.springs.leaf_lengths import add_pin_compliance, targets_without_pins
from sensor.design.parameters import Design
from sensor.design.tips import Tips

MATERIAL = (PETG.E_MPa, PETG.poisson)
TARGETS = (0.906, 20.83)
PINNED = default_housing(Design(tips=Tips(socket="pin")))


def stiffness(K, error=5e-4):
    C = np.array([[1.0 / K[0], 1e-6], [1e-6, 1.0 / K[1]]])
    return housing_stiffness(K, C=C, error=(error, error))


def test_pins_add_their_give_to_the_compliance_and_half_its_span_to_the_error():
    give = pin_compliance(PINNED.pin, *MATERIAL)
    pinned = add_pin_compliance(stiffness(TARGETS), give)
    for K, foot, error in zip(pinned.K, TARGETS, pinned.error, strict=True):
        assert pytest.approx(1.0 / foot + give.value) == 1.0 / K
        assert error == pytest.approx(5e-4 * K / foot + K * give.error)
        soft, hard = 1.0 / (1.0 / K + give.error), 1.0 / (1.0 / K - give.error)
        assert max(1.0 - soft / K, hard / K - 1.0) < error
    assert pinned.C[0, 1] == 1e-6


def test_target_that_pins_alone_cannot_carry_is_refused():
    give = pin_compliance(PINNED.pin, *MATERIAL)
    stiffest = 1.0 / give.value
    assert targets_without_pins((1.0, 0.99 * stiffest), give)[1] > 0.0
    assert refusal(targets_without_pins, (1.0, 1.01 * stiffest), give).field == "flexures.high.stiffness"
