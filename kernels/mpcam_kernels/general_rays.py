"""Rays that need no common center, block by block of pixels: how they are kept, bounded, and held against edges.

A ray passes an edge on the side that a linear function of its direction and moment tells. Over a block both are nearly
linear in the position, so each edge of a triangle is nearly a line there.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import plucker as test
from mpcam_kernels.linear_fit import Channel, linear_fit, position
from mpcam_kernels.plucker import Ray
from mpcam_kernels.ray_cones import EVERYWHERE, Cone, Cones, unit, waist
from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import PIXELS

__all__ = ["Cones", "Rays", "Slopes", "block_bounds", "packed", "test"]


@dataclass(frozen=True)
class Rays:
    """Rays in memory, two rows each: direction and how far the origin lies along it; moment, and 0."""

    rows: Rows

    ROWS = 2

    def at(self, types: Any, number: Any, active: Any = True) -> Ray:
        """Rays by number. The origin is direction x moment, the point nearest to (0, 0, 0), plus its part along."""
        first, second = self.rows.at(types, number, active)
        direction, moment = first.xyz, second.xyz
        return Ray(direction, moment, dr.fma(direction, first.w, dr.cross(direction, moment)))

    def run(self, types: Any, first: Any, count: int) -> list[Ray]:
        """So many rays from a number on."""
        return [self.at(types, first + k) for k in range(count)]

    def origin_and_direction(self, types: Any, number: Any) -> tuple[Any, Any]:
        """The same, as most readers want it; the direction is zero where there is no ray."""
        ray = self.at(types, number)
        return ray.origin, ray.direction


def packed(types: Any, direction: Any, origin: Any) -> list[Any]:
    """The rows in which rays are kept."""
    along = dr.dot(direction, origin)
    return [types.Array4f(*direction, along), types.Array4f(*dr.cross(origin, direction), 0)]


@dataclass(frozen=True)
class Slopes:
    """Directions and moments of blocks as linear functions of the position, and balls around the origins.

    Rows: (d middle, d off), (m middle, m off), (d right, ball x), (m right, ball y), (d down, ball z), (m down, ball
    radius).
    """

    rows: Rows

    ROWS, CHANNELS = 6, 2

    @staticmethod
    def packed(types: Any, channels: list[Channel], ball: tuple[Any, Any]) -> list[Any]:
        """The rows of the channels d and m, and of a ball (center, radius)."""
        d, m = channels
        (x, y, z), radius = ball
        rows = [(d.middle, d.off), (m.middle, m.off), (d.right, x), (m.right, y), (d.down, z), (m.down, radius)]
        return [types.Array4f(*row, last) for row, last in rows]

    def at(self, types: Any, block: Any) -> tuple[list[Channel], tuple[Any, Any]]:
        """Channels and balls by number."""
        d, m, d_right, m_right, d_down, m_down = self.rows.at(types, block)
        channels = [Channel(d.xyz, d_right.xyz, d_down.xyz, d.w), Channel(m.xyz, m_right.xyz, m_down.xyz, m.w)]
        return channels, (types.Array3f(d_right.w, m_right.w, d_down.w), m_down.w)

    def edges(self, types: Any, shape: Any, block: Any) -> tuple[list[tuple[Any, Any, Any, Any]], Any, Any]:
        """Per edge its value in the middle of a block, its slopes to the right and down, and what it may be off.

        And whether rays may start in front of the triangle's plane, seen along the normal, and behind it: in front they
        hit where all edges are positive, behind where all are negative.
        """
        (d, m), (start, radius) = self.at(types, block)
        edges = []
        for across, along in shape.edges:
            slack = (d.off + 1e-6) * dr.norm(across)
            slack += (m.off + 1e-6 * (1.0 + abs(m.middle.x) + abs(m.middle.y) + abs(m.middle.z))) * dr.norm(along)
            pairs = ((d.middle, m.middle), (d.right, m.right), (d.down, m.down))
            edges.append((*(dr.dot(a, across) + dr.dot(b, along) for a, b in pairs), slack))
        n = shape.normal
        away, reach = shape.offset - dr.dot(n, start), dr.norm(n) * (radius + 1e-6) + abs(shape.offset) * 1e-6
        return edges, away + reach >= 0, away - reach <= 0


def block_bounds(types: Any, rays: Any, block: Any) -> tuple[list[Any], list[Any]]:
    """Rows of the cones and of the slopes of blocks by number, from the rays of their pixels."""
    zero, slot = types.UInt(0), block * PIXELS

    def sample(k: Any) -> tuple[list[Any], Any, Any, Any]:
        d, m, o = rays.at(types, slot + k)[:3]
        return [d, m, o], *position(types, k), dr.squared_norm(d) > 0

    def below(k: Any, *_: Any) -> Any:
        return k < PIXELS

    fit = linear_fit(types, sample, PIXELS, 3)
    (d, _, o), (d_line, m_line, _) = fit.means, fit.channels

    def vary(k: Any, against: Any, square: Any) -> Any:
        (dk, _, ok), _, _, valid = sample(k)
        away = dk - d
        against = against + dr.select(valid, dr.dot(ok - o, away), 0)
        return k + 1, against, square + dr.select(valid, dr.squared_norm(away), 0)

    closest = waist(types, fit.count, *dr.while_loop((zero, types.Float(0), types.Float(0)), below, vary)[1:])
    (axis, known), middle = unit(d), o + closest * d

    def widest(k: Any, *most: Any) -> Any:
        (dk, mk, ok), s, t, valid = sample(k)
        values = [
            dr.norm(ok - o),
            dr.norm(ok + closest * dk - middle),
            dr.norm(dk - axis),
            dr.norm(dk - d_line[0] - s * d_line[1] - t * d_line[2]),
            dr.norm(mk - m_line[0] - s * m_line[1] - t * m_line[2]),
        ]
        return k + 1, *(dr.select(valid, dr.maximum(a, b), a) for a, b in zip(most, values, strict=True))

    none = types.Float(-1)
    _, start, reach, spread, d_off, m_off = dr.while_loop((zero, none, none, none, none, none), below, widest)
    cone = Cone(middle, reach, axis, dr.select(known, spread, EVERYWHERE), closest)
    channels = [Channel(*d_line, d_off), Channel(*m_line, m_off)]
    return cone.rows(types), Slopes.packed(types, channels, (o, start))
