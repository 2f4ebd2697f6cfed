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
        """Return K_m / E = 1 / (s - s12), with s the mean of s11 and s22 [mm]."""
        (s11, s12), (s21, s22) = self.S
        return 1.0 / (0.5 * (s11 + s22) - 0.5 * (s12 + s21))
