"""A compression test of a fruit that one knows: what a testing machine would write of it, with its faults."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.quantity import Bounds, check_fields, quantity
from cad.theory.hertz import plate_stiffness

Floats = NDArray[np.float64]

_FINE = 4000  # points of the curve that the rows are taken from
_POSITIVE, _SHARE = Bounds(above=0.0, at_most=1e6), Bounds(at_least=0.0, at_most=100.0)
_ANY = Bounds(at_least=-1e6, at_most=1e6)
_LEFT_AFTER_FAILURE = (0.7, 0.77)  # of the force at failure
_DROP_MM = 0.3
_KNOWN = "give what a real test would have"


@dataclass(frozen=True, kw_only=True)
class VirtualTest:
    """A ball between two plates by Hertz's law, and what a machine adds.

    The plate first travels `gap_mm`. Then the skin settles: the ball yields `toe_mm` more than Hertz's, most of it
    before `toe_share` of the force at failure. At `failure_strain` of the height, 2 `radius_mm`, the flesh breaks. The
    load cell shows `offset_N`, `drift_N_per_mm` of the travel, and noise with a standard deviation of `noise_percent`
    of the force at failure.
    """

    E_MPa: float = quantity("MPa", _POSITIVE, remedy=_KNOWN, default=2.0)
    poisson: float = quantity("", Bounds(above=-1.0, below=0.5), remedy=_KNOWN, default=0.3)
    radius_mm: float = quantity("mm", _POSITIVE, remedy=_KNOWN, default=35.0)
    gap_mm: float = quantity("mm", _SHARE, remedy=_KNOWN, default=0.8)
    toe_mm: float = quantity("mm", _SHARE, remedy=_KNOWN, default=0.15)
    toe_share: float = quantity("", Bounds(above=0.0, at_most=1.0), remedy=_KNOWN, default=0.03)
    failure_strain: float = quantity("", Bounds(above=0.0, at_most=0.5), remedy=_KNOWN, default=0.07)
    offset_N: float = quantity("N", _ANY, remedy=_KNOWN, default=0.3)
    drift_N_per_mm: float = quantity("N/mm", _ANY, remedy=_KNOWN, default=0.0)
    noise_percent: float = quantity("%", _SHARE, remedy=_KNOWN, default=1.0)
    rows: int = quantity("", Bounds(at_least=2, at_most=1_000_000), remedy=_KNOWN, default=600)
    seed: int = 1

    def __post_init__(self) -> None:
        """Refuse numbers that no test has."""
        check_fields(self, "virtual test")

    @property
    def first_touch_mm(self) -> float:
        """Return the travel at which Hertz's law begins, the settling of the skin left out [mm]."""
        return self.gap_mm + self.toe_mm

    def curve(self) -> tuple[Floats, Floats]:
        """Return travel [mm] and force [N], shape (rows,) each."""
        stiffness = plate_stiffness(self.radius_mm, 2) * self.E_MPa / (1.0 - self.poisson**2)
        broken = self.failure_strain * 2.0 * self.radius_mm
        strongest = stiffness * broken**1.5
        fine = strongest * np.linspace(0.0, 1.0, _FINE) ** 1.5
        place = self._travel(fine, stiffness, self.toe_share * strongest)
        after = [place[-1] + _DROP_MM, place[-1] + 5.0 * _DROP_MM]
        left = strongest * np.array(_LEFT_AFTER_FAILURE)
        travel = np.linspace(0.0, after[-1], self.rows)
        force = np.interp(travel, np.append(place, after), np.append(fine, left))
        noise = np.random.default_rng(self.seed).normal(0.0, 0.01 * self.noise_percent * strongest, self.rows)
        return travel, force + self.offset_N + self.drift_N_per_mm * travel + noise

    def _travel(self, force: Floats, stiffness: float, settling: float) -> Floats:
        """Return the travel [mm] at forces [N] before the failure."""
        settled = self.toe_mm * (1.0 - np.exp(-force / settling))
        return np.asarray(self.gap_mm + (force / stiffness) ** (2.0 / 3.0) + settled)

    def csv(self) -> str:
        """Return the test as a file of two columns, `travel_mm,force_N`."""
        rows = zip(*self.curve(), strict=True)
        return "travel_mm,force_N\n" + "".join(f"{x:.5f},{F:.5f}\n" for x, F in rows)
