"""Domes on springs against a sphere by boundary elements in space: cells on the sphere's skin, contact cell by cell.

Nothing is shared with the product. The cells of a patch press and sink along the normal in its middle, and no point of
the skin may lie within the ball of a dome, both as the spheres they are. Cells of one patch act on each other as
Love's rectangles on the tangent plane, cells of different patches as point loads at their distance in space. The
springs give way along the axis of the sensor. Lengths in mm, forces in N, moduli in MPa.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class DomeSensor:
    """Places (tips, 2) of domes of radius `dome`, compliance C (tips, tips) of their springs, fruit R and nu."""

    places: np.ndarray
    dome: float
    C: np.ndarray
    radius: float
    poisson: float


@dataclass(frozen=True)
class Cells:
    """Points on the skin and normals of their patch (cells, 3), tip of each, displacement per force, E = 1."""

    points: np.ndarray
    normals: np.ndarray
    owner: np.ndarray
    influence: np.ndarray


def dome_centres(sensor, travel, tilt_deg):
    """Return the balls' centres (tips, 3) on unloaded springs and the axis (3,): apex of the fruit at 0, z up.

    The sensor turns about the middle of its level plane, which has gone down by `travel` since a level sensor touched.
    """
    radius, dome = sensor.radius, sensor.dome
    along, across = np.tan(np.radians(tilt_deg))
    axis = np.array([along, across, 1.0]) / np.sqrt(1.0 + along**2 + across**2)
    turn = _rotation(np.array([0.0, 0.0, 1.0]), axis)
    middle = sensor.places.mean(axis=0)
    farthest = np.hypot(*sensor.places.T)
    touch = (radius + dome - np.sqrt((radius + dome) ** 2 - farthest**2)).min()
    lever = np.column_stack([sensor.places - middle, np.zeros(len(sensor.places))])
    return np.array([*middle, -touch - travel]) + lever @ turn.T + dome * axis, axis


def _rotation(start, end):
    """Rodrigues: the shortest turn from one unit vector to another."""
    v, c = np.cross(start, end), start @ end
    skew = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + skew + skew @ skew / (1.0 + c)


def skin_cells(sensor, centres, half, count):
    """Return a patch of count x count cells, `half` wide to each side, on the skin nearest to each ball."""
    core = np.array([0.0, 0.0, -sensor.radius])
    line = half * (2.0 * np.arange(count) + 1.0 - count) / count
    u, v = (values.ravel() for values in np.meshgrid(line, line, indexing="ij"))
    love = _love(line, 2.0 * half / count)
    points, normals, blocks = [], [], []
    for centre in centres:
        normal = (centre - core) / np.linalg.norm(centre - core)
        first = np.cross([0.0, 1.0, 0.0], normal)
        first /= np.linalg.norm(first)
        plane = np.outer(u, first) + np.outer(v, np.cross(normal, first))
        height = np.sqrt(sensor.radius**2 - u**2 - v**2)
        points.append(core + plane + np.outer(height, normal))
        normals.append(np.tile(normal, (len(u), 1)))
    owner = np.repeat(np.arange(len(centres)), count**2)
    points, normals = np.concatenate(points), np.concatenate(normals)
    distance = np.linalg.norm(points[:, None] - points, axis=-1)
    same = owner[:, None] == owner
    apart = np.divide(1.0, distance, out=np.zeros_like(distance), where=~same)
    blocks = np.kron(np.eye(len(centres)), love)
    influence = (1.0 - sensor.poisson**2) / np.pi * (apart + blocks)
    return Cells(points, normals, owner, influence)


def _love(line, size):
    """Return the mean of 1 / distance from a square cell to the middle of each cell (cells, cells): Love 1929."""
    step = line[:, None] - line
    edges = [step - 0.5 * size, step + 0.5 * size]
    total = 0.0
    for i, x in enumerate(edges):
        for j, y in enumerate(edges):
            a, b = x[:, None, :, None], y[None, :, None, :]
            r = np.hypot(a, b)
            total = total + (-1.0) ** (i + j) * (a * np.log(b + r) + b * np.log(a + r))
    count = len(line)
    return total.reshape(count**2, count**2) / size**2


def entered(cells, sensor, centres):
    """Return how far each cell must sink along its normal to lie outside its ball; -1 where the ball is not above."""
    seen = cells.points - centres[cells.owner]
    along = (seen * cells.normals).sum(axis=1)
    rest = along**2 - (seen**2).sum(axis=1) + sensor.dome**2
    return np.where(rest > 0.0, along + np.sqrt(np.maximum(rest, 0.0)), -1.0)


def dome_forces(sensor, E, travel, tilt_deg, count=28):
    """Return the forces along the springs (tips,) and the largest miss of complementarity, relative."""
    centres, axis = dome_centres(sensor, travel, tilt_deg)
    relative = 1.0 / (1.0 / sensor.dome + 1.0 / sensor.radius)
    steepest = travel + np.ptp(sensor.places, axis=0).max() * np.tan(np.radians(np.abs(tilt_deg))).sum()
    cells = skin_cells(sensor, centres, 1.1 * np.sqrt(relative * steepest), count)
    spring = (cells.normals @ axis)[:, None] * np.eye(len(centres))[cells.owner]
    matrix = cells.influence / E + spring @ sensor.C @ spring.T
    give = np.zeros(len(centres))
    for _ in range(12):
        reached = entered(cells, sensor, centres + give[:, None] * axis)
        f = complementary(matrix, np.where(reached > -1.0, reached + spring @ give, -1.0))
        moved, give = give, sensor.C @ (spring.T @ f)
        if np.abs(give - moved).max() < 1e-9:
            break
    b = np.where(reached > -1.0, reached + spring @ give, -1.0)
    gap = matrix @ f - b
    miss = max(-gap.min() / b.max(), float(np.abs(f * gap).max() / (f.max() * b.max())), -f.min() / f.max())
    return spring.T @ f, miss


def complementary(matrix, b, tolerance=1e-10):
    """Return f >= 0 with matrix f - b >= 0, one of them 0: conjugate gradients on the touching cells.

    I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206, doi:10.1016/S0043-1648(99)00113-1.
    """
    f = np.where(b > 0.0, b / np.diag(matrix).mean() / 50.0, 0.0)
    direction, before, restart = np.zeros_like(f), 1.0, 0.0
    for _ in range(2000):
        residual = matrix @ f - b
        touching = f > 0.0
        size = float((residual[touching] ** 2).sum())
        if restart == 1.0 and np.sqrt(size / touching.sum()) < tolerance * b.max():
            break
        direction = np.where(touching, residual + restart * size / before * direction, 0.0)
        before = size
        step = float(residual[touching] @ direction[touching]) / float(direction @ (matrix @ direction))
        f = np.maximum(f - step * direction, 0.0)
        entering = (f == 0.0) & (matrix @ f - b < 0.0)
        f[entering] -= step * (matrix @ f - b)[entering]
        restart = 0.0 if entering.any() else 1.0
    return f
