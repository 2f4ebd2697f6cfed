"""What the fruit answers to both tips: a 2 x 2 compliance with its error and its cost."""

from dataclasses import dataclass

Matrix = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class Compliance:
    """Indentation of tip i per force on tip j, times E [1/mm]; index 1 is the low tip at -x, 2 the high tip at +x.

    `error_percent` bounds s11 - s12 (the number that sizes the springs), `s11_error_percent` bounds s11,
    both relative to the value. `status` is a sentence on how the number was found.
    """

    S: Matrix
    error_percent: float
    s11_error_percent: float
    method: str
    dofs: int
    seconds: float
    status: str

    @property
    def K_m_over_E_mm(self) -> float:
        """Return K_m / E = 1 / (s11 - s12) of the low tip [mm]."""
        return 1.0 / (self.S[0][0] - self._crosstalk)

    @property
    def asymmetry(self) -> float:
        """Return the fruit's stiffness under the high tip over that under the low one [1]; 1 in the middle."""
        return (self.S[0][0] - self._crosstalk) / (self.S[1][1] - self._crosstalk)

    @property
    def _crosstalk(self) -> float:
        return 0.5 * (self.S[0][1] + self.S[1][0])
