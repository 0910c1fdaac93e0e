"""Solids: operations, places, pictures, sizes, meshes, voxels."""
import numpy as np
import pytest
from conftest import CUBE_VERTICES, cube_triangles, data, tool

import strata
from strata import csg


def test_operations_have_the_volumes_of_sets():
    a, b = csg.cube(2), csg.cube(2).translate(1, 0, 0)
    for solid, volume in ((a | b, 12), (a + b, 12), (a & b, 4), (a - b, 4), (a - a, 0), (csg.union([a, b, b]), 12)):
        assert solid.measure().volume == pytest.approx(volume, abs=1e-9)
    assert csg.union([]).measure().empty and csg.intersection([a, b]).measure().volume == pytest.approx(4)
    assert a.measure().volume == pytest.approx(8)  # operands do not change


@pytest.mark.parametrize(
    "move, low, high",
    [
        (lambda s: s.translate(1, 2, 3), (1, 2, 3), (2, 4, 6)),
        (lambda s: s.translate((1, 2, 3)), (1, 2, 3), (2, 4, 6)),
        (lambda s: s.rotate(90, 0, 0), (0, -3, 0), (1, 0, 2)),
        (lambda s: s.rotate(0, 0, 90), (-2, 0, 0), (0, 1, 3)),
        (lambda s: s.rotate(90, 0, 90), (0, 0, 0), (3, 1, 2)),
        (lambda s: s.scale(2), (0, 0, 0), (2, 4, 6)),
        (lambda s: s.scale(1, -1, 2), (0, -2, 0), (1, 0, 6)),
        (lambda s: s.mirror(1, 0, 0), (-1, 0, 0), (0, 2, 3)),
        (lambda s: s.mirror("z"), (0, 0, -3), (1, 2, 0)),
        (lambda s: s.transform([[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0]]), (5, 0, 0), (6, 2, 3)),
    ],
)
def test_solids_are_moved_as_openscad_moves_them(move, low, high):
    measures = move(csg.cube((1, 2, 3))).measure()
    assert measures.exact and measures.volume == pytest.approx(np.prod(np.subtract(high, low)))
    assert measures.low == pytest.approx(low, abs=1e-6) and measures.high == pytest.approx(high, abs=1e-6)


@pytest.mark.parametrize(
    "solid, text",
    [
        (lambda: csg.cube((1, 2, 3), center=True), "cube(size = [1, 2, 3], center = true);"),
        (lambda: csg.sphere(2, fn=30), "sphere($fn = 30, $fa = 12, $fs = 2, r = 2);"),
        (lambda: csg.sphere(d=7), "sphere($fn = 0, $fa = 12, $fs = 2, r = 3.5);"),
        (lambda: csg.cylinder(5, r1=2, r2=0, fn=7), "cylinder($fn = 7, $fa = 12, $fs = 2, h = 5, r1 = 2, r2 = 0, center = false);"),
        (lambda: csg.cylinder(5, d=3, center=True), "cylinder($fn = 0, $fa = 12, $fs = 2, h = 5, r1 = 1.5, r2 = 1.5, center = true);"),
    ],
)
def test_primitives_are_those_of_the_language(solid, text):
    ours, theirs = solid().measure(), csg.parse(text).measure()
    assert ours.volume == theirs.volume > 0 and ours.low == theirs.low and ours.high == theirs.high


def test_a_scene_has_the_size_that_the_tool_tells():
    plate = csg.load(data("plate.csg"))
    measures = plate.measure()
    assert measures.exact and f"{measures.volume:.6g}"[:5] in tool("csg", data("plate.csg"))
    assert len(plate.names) == 9 and "plate.csg" in plate.names[0]
    rays = plate.measure(resolution=200)
    assert not rays.exact and rays.inertia is None
    assert rays.volume == pytest.approx(measures.volume, abs=rays.volume_error)


def test_the_boundary_is_a_closed_mesh_and_a_file(tmp_path):
    part = csg.cube(10, center=True) - csg.sphere(6, fn=24)
    mesh = part.mesh()
    assert mesh.closed and mesh.volume == pytest.approx(part.measure().volume)
    for name in ("part.3mf", "part.stl", "part.obj", "part.ply", "part.off"):
        part.save(tmp_path / name)
        assert strata.read_mesh(tmp_path / name).volume == pytest.approx(mesh.volume, rel=1e-5)
    with pytest.raises(strata.UsageError, match="must end in"):
        part.save(tmp_path / "part.vdb")


def test_the_mesh_of_a_contour_has_the_voxels_of_the_solid(knot):
    contour = knot.contour(resolution=40)
    assert contour.closed
    like = strata.voxelize(knot, resolution=40)
    assert strata.voxelize(contour, like=like).checksum() == like.checksum()


def test_the_voxels_of_a_tree_are_those_of_the_tool():
    plate = csg.load(data("plate.csg"))
    expected = tool("voxelize", data("plate.csg"), "-r", 100, "--checksum").strip()
    voxels = plate.voxelize(resolution=100)
    assert f"{voxels.checksum():016x}" == expected
    ids = plate.voxelize(resolution=100, ids=True)
    assert ids.checksum() == voxels.checksum() and ids.kind == "ids"
    assert 1 < len(np.unique(ids.numpy())) <= 1 + len(plate.names)


def test_parts_of_a_file_are_solids_and_have_ids(tmp_path):
    lines = [f"v {x} {y} {z}" for x, y, z in CUBE_VERTICES] + [f"v {x + 2} {y} {z}" for x, y, z in CUBE_VERTICES]
    for part in range(2):
        lines += [f"o part{part}"] + [f"f {a + 1 + 8 * part} {b + 1 + 8 * part} {c + 1 + 8 * part}" for a, b, c in cube_triangles()]
    path = tmp_path / "two.obj"
    path.write_text("\n".join(lines))
    assert csg.load(path).names == ("part0", "part1") and len(csg.load(path, parts=False).names) == 1
    expected = tool("voxelize", path, "-r", 12, "--ids", "--checksum").strip()
    voxels = strata.voxelize(path, resolution=12, ids=True)
    assert f"{voxels.checksum():016x}" == expected
    labels = voxels.numpy()
    assert (labels[:4] == 1).all() and (labels[4:8] == 0).all() and (labels[8:] == 2).all()
    assert strata.read_mesh(path, parts=["part1"]).bounds[0, 0] == 2


def test_a_mesh_is_a_solid():
    box = csg.solid((CUBE_VERTICES, cube_triangles()))
    assert (box - csg.cube(0.5)).measure().volume == pytest.approx(1 - 0.125)
    assert (strata.csg.Solid(data("knot.obj")) & csg.cube(100, center=True)).measure().volume == pytest.approx(19.1, abs=0.01)


def test_a_picture_is_the_tools(tmp_path):
    image = pytest.importorskip("PIL.Image", reason="python3-pil is missing")
    tool("csg", data("plate.csg"), "--size", "200,160", "--samples", 4, "-o", tmp_path / "plate.png")
    expected = np.asarray(image.open(tmp_path / "plate.png").convert("RGBA"))
    picture = csg.load(data("plate.csg")).picture((200, 160), samples=4)
    assert picture.shape == (160, 200, 4) and np.array_equal(picture, expected)
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 50


def test_cameras_and_colours_change_the_picture():
    part = csg.cube(10, center=True).colour("#ff0000")
    top = part.picture(64, camera=strata.Camera(rotation=(0, 0, 0), projection="orthographic"), samples=1)
    middle = top[32, 32]
    assert middle[0] > 150 and middle[1] < 90 and middle[3] == 255
    away = part.picture(64, camera=strata.Camera(eye=(0, 0, 500), target=(400, 0, 500)), samples=1)
    assert len(np.unique(away.reshape(-1, 4), axis=0)) == 1 and not np.array_equal(top, away)
    assert part.picture(32, background="transparent")[0, 0, 3] == 0
    assert part.picture(32, background=(0, 0, 1))[0, 0].tolist() == [0, 0, 255, 255]
    assert part._repr_png_().startswith(b"\x89PNG")
    assert not np.array_equal(part.colour(0, 1, 0).picture(32), part.picture(32))


@pytest.mark.parametrize(
    "make, error, sentence",
    [
        (lambda: csg.cube(-1), strata.UsageError, "size must be a number above 0, got -1"),
        (lambda: csg.cube((1, 2)), strata.UsageError, "size must be 3 numbers, got 2"),
        (lambda: csg.cube("a"), TypeError, "size must be a number"),
        (lambda: csg.sphere(float("nan")), strata.UsageError, "r must be finite"),
        (lambda: csg.sphere(1, d=2), strata.UsageError, "r and d must not both be given"),
        (lambda: csg.sphere(1, fn=1e9), strata.LimitError, "triangles is too large"),
        (lambda: csg.sphere(1, fn=-3), strata.UsageError, "fn must be at least 0, got -3"),
        (lambda: csg.cylinder(1, r1=0, r2=0), strata.UsageError, "the larger of r1 and r2"),
        (lambda: csg.cube(1).scale(0), strata.UsageError, "must not flatten"),
        (lambda: csg.cube(1).mirror(0, 0, 0), strata.UsageError, "must not be 0, 0, 0"),
        (lambda: csg.cube(1).transform(np.eye(3)), strata.InputError, r"got \(3, 3\)"),
        (lambda: csg.cube(1).transform(np.full((4, 4), np.nan)), strata.InputError, "must be finite"),
        (lambda: csg.cube(1).transform(np.ones((4, 4))), strata.UsageError, "the last row of matrix"),
        (lambda: csg.cube(1) - 3, TypeError, ""),
        (lambda: csg.union([csg.cube(1), 3, 4]), TypeError, "operands must be solids, got int"),
        (lambda: csg.cube(1).colour("red"), strata.UsageError, "'red'"),
        (lambda: csg.cube(1).colour(2, 0, 0), strata.UsageError, "from 0 to 1"),
        (lambda: csg.cube(1).picture(16, scheme="Pink"), strata.UsageError, "scheme must be one of 'Cornfield'"),
        (lambda: csg.cube(1).picture(16, samples=3), strata.UsageError, "3"),
        (lambda: csg.cube(1).picture((16, 0)), strata.UsageError, "size must be 1 to 65536"),
        (lambda: csg.cube(1).measure(resolution=0), strata.UsageError, "resolution must be 1 to 32768, got 0"),
        (lambda: csg.cube(1).mesh(bits=5), strata.UsageError, "5"),
        (lambda: csg.cube(1).mesh(faces="big"), strata.UsageError, "faces must be one of 'canonical', 'input', got 'big'"),
        (lambda: csg.load("nope.csg"), strata.InputError, "nope.csg: No such file"),
        (lambda: csg.parse("cube("), strata.InputError, "the scene:1:6"),
        (lambda: csg.parse(b"cube();"), TypeError, "text must be a str"),
        (lambda: strata.Camera(fov=180), strata.UsageError, "fov must be between"),
        (lambda: strata.Camera(eye=(0, 0, 0), distance=3), strata.UsageError, "either an eye"),
        (lambda: strata.Camera(projection="fisheye"), strata.UsageError, "'fisheye'"),
    ],
)
def test_what_cannot_be_done_is_an_error(make, error, sentence):
    with pytest.raises(error, match=sentence):
        make()


def test_the_empty_set_has_pictures_and_voxels_of_every_kind():
    nothing = csg.union([])
    assert nothing.picture(8).shape == (8, 8, 4) and len(nothing.mesh().faces) == 0
    grid = strata.Grid((3, 4, 5))
    with pytest.warns(strata.StrataWarning, match="no voxel is solid"):
        assert nothing.voxelize(like=grid).numpy().dtype == np.bool_
        assert nothing.voxelize(like=grid, ids=True).numpy().dtype == np.uint32
        assert nothing.voxelize(like=grid, colours=True).numpy().shape == (3, 4, 5, 4)
    assert nothing.voxelize(like=grid, coverage=True).numpy().dtype == np.float32
    assert len(nothing.depth_lists(like=grid)) == 0
    with pytest.raises(strata.GeometryError):
        nothing.voxelize(resolution=8)


@pytest.mark.parametrize("make", [lambda: csg.cube(1), lambda: csg.cube(1).voxelize(resolution=4)])
def test_a_picture_that_does_not_fit_the_memory_is_refused(make):
    with pytest.raises(strata.LimitError, match="a picture of 65536 x 65536 pixels takes"):
        make().picture(65536)


def test_warnings_of_a_scene_are_pythons():
    with pytest.warns(strata.StrataWarning, match="the scene:1:1"):
        csg.parse('import(file = "missing.stl");')
