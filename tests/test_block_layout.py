"""Blocks of pixels: which runs of slots and which parts hold pixels, recounted pixel by pixel."""

import numpy as np
import pytest

from mpcam.cameras.atlas import atlas
from mpcam.rendering.block_layout import BlockLayout, atlas_layout, image_layout, layered_layout

RUN, PART, BLOCK = 8, 16, 128  # slots


def layouts() -> dict[str, BlockLayout]:
    some = np.flatnonzero(np.random.default_rng(3).uniform(size=45 * 19) < 0.03)
    return {
        "even": image_layout(64, 32),
        "odd": image_layout(45, 19),
        "triangles": atlas_layout(atlas((35, 7, 35, 2))),
        "layers": layered_layout(45, 19, [(some, np.zeros_like(some)), (some[:3], np.arange(3))]),
        "nothing": layered_layout(45, 19, []),
    }


@pytest.mark.parametrize("name", list(layouts()))
def test_runs_and_parts_are_those_that_hold_pixels(name):
    layout = layouts()[name]
    runs, parts = set(), np.zeros(layout.blocks, int)
    for slot in layout.slots[layout.slots >= 0].tolist():
        runs.add(slot // RUN)
        parts[slot // BLOCK] |= 1 << slot % BLOCK // PART
    assert layout.runs.tolist() == (sorted(runs) or [0])
    np.testing.assert_array_equal(layout.parts, parts)


def test_an_image_has_a_run_for_every_eight_pixels_where_blocks_fit():
    assert len(image_layout(64, 32).runs) == 64 * 32 // RUN


@pytest.mark.parametrize("name", ["even", "odd", "layers"])
def test_slots_are_where_their_pixels_are(name):
    """Blocks of 16 x 8, in each eight parts of 4 x 4, row by row: found from the slot, not from the pixel."""
    layout, width = layouts()[name], 64 if name == "even" else 45
    slots = layout.slots[layout.slots >= 0]
    pixel = np.flatnonzero(layout.slots >= 0) % layout.pixels
    block, part, rest = slots // BLOCK, slots % BLOCK // PART, slots % PART
    np.testing.assert_array_equal(layout.x[block] + part % 4 * 4 + rest % 4, pixel % width)
    np.testing.assert_array_equal(layout.y[block] + part // 4 * 4 + rest // 4, pixel // width)
    np.testing.assert_array_equal(layout.face[block], np.flatnonzero(layout.slots >= 0) // layout.pixels)
    assert len(np.unique(slots)) == len(slots)
    assert layout.slots.min() >= -1 and slots.max() < layout.blocks * BLOCK
    if name == "layers":
        assert np.count_nonzero(layout.slots[: layout.pixels] >= 0) > 3
        assert np.count_nonzero(layout.slots[layout.pixels :] >= 0) == 3
        assert (np.diff(layout.group) >= 0).all() and layout.groups == len(np.unique(layout.group))


def test_without_pixels_there_is_one_empty_block():
    layout = layouts()["nothing"]
    assert (layout.blocks, layout.groups, layout.pixels) == (1, 1, 45 * 19)
    assert (layout.slots == -1).all() and len(layout.slots) == 45 * 19


def test_slots_of_camera_triangles_are_where_their_pixels_are():
    known = atlas((35, 7, 35, 2))
    layout, (face, column, row) = atlas_layout(known), known.places
    there = face >= 0
    np.testing.assert_array_equal(layout.slots >= 0, there)
    slots = layout.slots[there]
    block, part, rest = slots // BLOCK, slots % BLOCK // PART, slots % PART
    np.testing.assert_array_equal(layout.face[block], face[there])
    np.testing.assert_array_equal(layout.x[block] + part % 4 * 4 + rest % 4, column[there])
    np.testing.assert_array_equal(layout.y[block] + part // 4 * 4 + rest // 4, row[there])
