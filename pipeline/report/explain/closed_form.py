"""Numbers of the default design that closed forms give at once, for want of an output folder."""

from cad.design.parameters import Design
from cad.theory.two_spring_law import force_ratio, hayes_stiffness, nonlinearity, size_springs


def default_numbers() -> dict[str, str]:
    """Return by name what the paper's formula (6) and the two-spring law give for the default design, with its unit."""
    design = Design()
    targets, fruit = design.nominal_targets, design.fruit
    K_m = hayes_stiffness(fruit.E_max_MPa, fruit.poisson, 0.5 * design.tips.side_mm)
    springs = size_springs(targets.P_max, targets.NL, K_m, targets.NL_definition)
    by_hayes = "by the paper's (6)"
    return {
        "E": f"{fruit.E_max_MPa:g} MPa, the firmest fruit of the range",
        "nu": f"{fruit.poisson:g}",
        "K_m": f"{1e3 * K_m:.0f} N/m {by_hayes}",
        **{name: f"{1e3 * K:.5g} N/m {by_hayes}" for name, K in vars(springs).items()},
        "P": f"{force_ratio(springs, K_m):.4g} at the largest modulus",
        "P_max": f"{force_ratio(springs, K_m):.4g}",
        "NL": f"{nonlinearity(springs, K_m, targets.NL_definition):.4g}",
        "x": f"{design.press.travel_mm:g} mm, full travel",
        "spacing": f"{design.tips.spacing_mm:g} mm",
        "tip": f"{design.tips.side_mm:g} mm, its side",
    }
