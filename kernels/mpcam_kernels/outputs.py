"""What a frame keeps of each pixel: one number that a nearer surface raises; 0 where nothing is.

Tests give the nearness of a hit, the inverse of its depth: positive, and larger for nearer surfaces. Bits of positive
floats order as the floats do.
"""

from typing import Any

import drjit as dr


class HitKeys:
    """Nearness bits << 32 | inverted triangle number: of surfaces at one depth, the lower number wins."""

    name = "hits"
    depth = True

    @staticmethod
    def kind(types: Any) -> Any:
        return types.UInt64

    @staticmethod
    def key(types: Any, nearness: Any, triangle: Any) -> Any:
        return (types.UInt64(dr.reinterpret_array(types.UInt, nearness)) << 32) | types.UInt64(~types.UInt(triangle))

    @staticmethod
    def nearness(types: Any, key: Any) -> Any:
        return dr.reinterpret_array(types.Float, types.UInt(key >> 32))

    @staticmethod
    def triangle(types: Any, key: Any) -> Any:
        """Triangle number; the largest there is where nothing is hit."""
        return ~types.UInt(key)


class Depth:
    """Nearness bits alone."""

    name = "depth"
    depth = True

    @staticmethod
    def kind(types: Any) -> Any:
        return types.UInt

    @staticmethod
    def key(types: Any, nearness: Any, triangle: Any) -> Any:
        return dr.reinterpret_array(types.UInt, nearness)

    @staticmethod
    def nearness(types: Any, key: Any) -> Any:
        return dr.reinterpret_array(types.Float, key)


class Coverage:
    """1 where anything is hit; nothing is compared."""

    name = "coverage"
    depth = False

    @staticmethod
    def kind(types: Any) -> Any:
        return types.UInt


OUTPUTS = {output.name: output for output in (HitKeys, Depth, Coverage)}
