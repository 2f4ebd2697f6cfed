"""How far the force ratio drifts over the travel because the edges of real tips are round."""

from cad.design.parameters import Design
from cad.theory.rounded_edge import edge_loss
from cad.theory.two_spring_law import Springs, series_ratio, spring_give
from pipeline.response.scene_press import TRAVELS
from solve.contact.linear_response import travels
from solve.fruit.compliance import FruitCompliance


def edge_losses(design: Design, springs: Springs, K_m: tuple[float, ...], travel: float, radius: float) -> list[float]:
    """Return by how much an edge radius [mm] lowers the fruit's stiffness under each tip [1] at a travel [mm].

    `K_m` [N/mm] is the fruit's stiffness under each sharp tip.
    """
    depths = [travel - spring_give(K, fruit, travel) for K, fruit in zip(springs.stiffnesses, K_m, strict=True)]
    return [edge_loss(depth, design.tips.side_mm, radius) for depth in depths]


def edge_drift(design: Design, contact: FruitCompliance, springs: Springs, radius: float) -> float:
    """Return (max P - min P) / mean P over the travel of tips with an edge radius [mm], the worst of all E [1]."""
    worst = 0.0
    for E in design.fruit.E_MPa:
        K_m = (E * contact.K_m_over_E(0), E * contact.K_m_over_E(-1))
        ratios = []
        for travel in travels(design.press.travel_mm, TRAVELS).tolist():
            losses = edge_losses(design, springs, K_m, travel, radius)
            softer = [fruit * (1.0 - loss) for fruit, loss in zip(K_m, losses, strict=True)]
            ratios.append(series_ratio(*springs.stiffnesses, *softer))
        worst = max(worst, (max(ratios) - min(ratios)) * len(ratios) / sum(ratios))
    return worst
