"""Depth lists of meshes, and of a user's own fragments: sorted, complete, as the documents say."""
import numpy as np
import pytest
from conftest import CUBE_VERTICES, cube_triangles, data

import strata


def test_the_lists_of_a_box_are_where_its_faces_are():
    lists = strata.depth_lists((CUBE_VERTICES * (4, 4, 2), cube_triangles()), like=strata.Grid((6, 5, 8), (-1, 0, -1)))
    assert lists.shape == (5, 6) and lists.axis == "z"
    counts = lists.counts()
    assert counts[:, 0].sum() == 0 and (counts[:4, 1:5] == 2).all() and counts[4].sum() == 0
    assert np.allclose(lists.depth.reshape(-1, 2), [0, 2], atol=1 / 256)
    assert np.array_equal(lists.exit.reshape(-1, 2), np.tile([False, True], (16, 1)))
    assert lists.thickness()[1, 2] == pytest.approx(2, abs=1e-9) and lists.thickness()[0, 0] == 0
    assert lists.triangle.max() < 12


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_lists_are_sorted_and_their_thickness_is_the_volume(knot, axis):
    lists = strata.depth_lists(knot, axis=axis, resolution=200)
    assert lists.offsets[0] == 0 and lists.offsets[-1] == len(lists) > 10000
    begins = lists.offsets[:-1][lists.counts().reshape(-1) > 0].astype(int)
    falls = np.nonzero(np.diff(lists.items.astype(object)) <= 0)[0] + 1
    assert np.isin(falls, begins).all()  # only where another list begins
    u, v = (a for a in range(3) if a != "xyz".index(axis))
    volume = lists.thickness().sum() * lists.grid.spacing[u] * lists.grid.spacing[v]
    assert volume == pytest.approx(knot.volume, rel=1e-3)
    assert (lists.counts() % 2 == 0).all()


def test_lists_are_the_same_for_any_threads_and_cannot_be_written_to(knot):
    one, all_of_them = (strata.depth_lists(knot, resolution=100, threads=n) for n in (1, 0))
    assert np.array_equal(one.items, all_of_them.items) and np.array_equal(one.offsets, all_of_them.offsets)
    with pytest.raises(ValueError):
        one.items[0] = 1


def test_the_lists_of_a_solid_are_those_of_the_result():
    part = strata.csg.cube(10) - strata.csg.cube((4, 4, 20)).translate(3, 3, -5)
    lists = part.depth_lists(resolution=10)
    assert lists.counts()[5, 5] == 0 and lists.counts()[1, 1] == 2
    assert lists.thickness().sum() == pytest.approx(10 * (100 - 16), rel=1e-3)  # 1/256 voxel less: the top is the grid's


@pytest.mark.parametrize("store", ["hash", "count-scan"])
def test_own_fragments_come_back_sorted(store):
    rng = np.random.default_rng(11)
    pixel, depth = rng.integers(0, 30 * 20, 5000), rng.integers(0, 2**24, 5000)
    depth[::7] = 12345
    payload = rng.integers(0, 2**32, 5000)
    buffer = strata.HashBuffer(30, 20, store=store)
    buffer.insert(pixel[:1000], depth[:1000], payload[:1000])
    buffer.insert(np.column_stack([pixel[1000:] % 30, pixel[1000:] // 30]), depth[1000:], payload[1000:])
    lists = buffer.lists()
    order = np.lexsort((payload, depth, pixel))
    assert np.array_equal(lists.depth, depth[order]) and np.array_equal(lists.payload, payload[order])
    assert np.array_equal(lists.counts().reshape(-1), np.bincount(pixel, minlength=600))
    assert len(buffer) == len(lists) == 5000
    buffer.clear()
    assert len(buffer.lists()) == 0


def test_floats_from_0_to_1_are_depths_and_a_payload_may_be_one_number():
    buffer = strata.HashBuffer(2, 1)
    buffer.insert([1, 1, 0], [1.0, 0.0, 0.5], 9)
    lists = buffer.lists()
    assert lists.depth.tolist() == [int(0.5 * (2**24 - 1)), 0, 2**24 - 1] and lists.payload.tolist() == [9, 9, 9]


def test_more_than_255_layers_need_the_other_store():
    buffer = strata.HashBuffer(3, 3)
    buffer.insert(np.full(256, 4), np.arange(256), 0)
    with pytest.raises(strata.LimitError, match=r"\(1, 1\)"):
        buffer.lists()
    other = strata.HashBuffer(3, 3, store="count-scan")
    other.insert(np.full(256, 4), np.arange(256)[::-1], 0)
    assert other.lists().depth.tolist() == list(range(256))


def test_the_callers_arrays_may_change_after_insert():
    pixel, depth, payload = np.array([0, 1]), np.array([5, 6]), np.array([7, 8])
    buffer = strata.HashBuffer(2, 1)
    buffer.insert(pixel, depth, payload)
    pixel[:], depth[:], payload[:] = 1, 0, 0
    lists = buffer.lists()
    assert lists.depth.tolist() == [5, 6] and lists.payload.tolist() == [7, 8]


@pytest.mark.parametrize(
    "pixel, depth, payload, sentence",
    [
        ([9], [0], [0], r"pixel\[0\] must be 0 to 8, got 9"),
        ([0, -1], [0, 0], [0, 0], r"pixel\[1\] must be 0 to 8, got -1"),
        ([[3, 0]], [0], [0], r"x of pixel\[0\] must be 0 to 2, got 3"),
        ([[0, -1]], [0], [0], r"y of pixel\[0\] must be 0 to 2, got -1"),
        ([0], [2**24], [0], r"depth\[0\] must be 0 to 16777215, got 16777216"),
        ([0], [-1], [0], r"depth\[0\]"),
        ([0], [1.5], [0], r"depth\[0\] is 1.5: floats must be 0 to 1"),
        ([0, 1], [0.5, np.nan], [0, 0], r"depth\[1\] is nan"),
        ([0], [0], [2**32], r"payload\[0\] must be 0 to 4294967295"),
        ([0, 1], [0], [0, 0], "must have one length"),
        ([[0, 1, 2]], [0], [0], r"pixel must have the shape"),
        ([0.5], [0], [0], "pixel must be whole numbers"),
    ],
)
def test_fragments_that_no_list_can_keep_are_named(pixel, depth, payload, sentence):
    buffer = strata.HashBuffer(3, 3)
    with pytest.raises(strata.InputError, match=sentence):
        buffer.insert(pixel, depth, payload)
    assert len(buffer) == 0


@pytest.mark.parametrize("width, height", [(0, 1), (1, -1), (65537, 1)])
def test_a_screen_out_of_range_is_refused(width, height):
    with pytest.raises(strata.UsageError, match="must be 1 to 65536"):
        strata.HashBuffer(width, height)


def test_an_unknown_store_is_refused():
    with pytest.raises(strata.UsageError, match="store must be"):
        strata.HashBuffer(1, 1, store="tree")
    with pytest.raises(strata.UsageError, match="axis must be"):
        strata.depth_lists(data("knot.obj"), resolution=8, axis="t")
