"""Voxels: the same as the tool's, as arrays, runs, slices, pictures and files."""
import time

import numpy as np
import pytest
from conftest import CUBE_QUADS, CUBE_VERTICES, cube_triangles, data, tool, torus

import strata


def test_voxels_are_those_of_the_tool(knot):
    voxels = strata.voxelize(knot, resolution=256)
    assert f"{voxels.checksum():016x}" == tool("voxelize", data("knot.obj"), "-r", 256, "--checksum").strip()
    assert strata.voxelize(data("knot.obj"), resolution=256, threads=1).checksum() == voxels.checksum()


@pytest.mark.parametrize(
    "options, words",
    [
        ({"voxel_size": 0.1}, ["--voxel-size", "0.1"]),
        ({"resolution": 50, "padding": 3}, ["-r", "50", "--padding", "3"]),
        ({"resolution": 50, "surface": True, "solid": False}, ["-r", "50", "--surface"]),
        ({"resolution": 50, "surface": True}, ["-r", "50", "--surface", "--solid"]),
        ({"resolution": 50, "surface": True, "solid": False, "surface_kind": 6}, ["-r", "50", "--surface=6"]),
    ],
)
def test_options_mean_what_the_tools_mean(knot, options, words):
    expected = tool("voxelize", data("knot.obj"), *words, "--checksum").strip()
    assert f"{strata.voxelize(knot, **options).checksum():016x}" == expected


def test_an_array_has_the_voxels_that_a_file_has(knot, tmp_path):
    tool("voxelize", data("knot.obj"), "-r", 64, "-o", tmp_path / "knot.npy")
    voxels = strata.voxelize(knot, resolution=64)
    array = voxels.numpy()
    assert array.dtype == np.bool_ and array.shape == voxels.dims
    assert np.array_equal(array, np.load(tmp_path / "knot.npy").astype(bool))
    assert array.sum() == voxels.count > 10000


def test_runs_cover_the_solid_voxels_once(knot_voxels):
    again = np.zeros(knot_voxels.dims, dtype=int)
    runs = knot_voxels.runs()
    for x, y, z, length, label in runs:
        again[x, y, z : z + length] += 1
        assert label == 1
    assert np.array_equal(again == 1, knot_voxels.numpy()) and again.max() == 1 and knot_voxels.axis == "z"


def test_arrays_live_longer_than_their_voxels(knot):
    array = strata.voxelize(knot, resolution=32).numpy()
    runs = strata.voxelize(knot, resolution=32).runs()
    assert array.sum() == runs["length"].sum()
    assert array.base is not None  # it shows memory that the library filled


def test_contains_is_true_in_solid_voxels_alone(knot_voxels):
    array = knot_voxels.numpy()
    rng = np.random.default_rng(7)
    low, high = knot_voxels.bounds
    points = rng.uniform(low - 0.2, high + 0.2, (5000, 3))
    at = np.floor((points - knot_voxels.origin) / knot_voxels.spacing).astype(int)
    inside = ((at >= 0) & (at < array.shape)).all(axis=1)
    expected = np.zeros(len(points), dtype=bool)
    expected[inside] = array[tuple(at[inside].T)]
    assert np.array_equal(knot_voxels.contains(points), expected) and 100 < expected.sum() < 4000
    assert knot_voxels.contains(points[::2]).shape == (2500,) and knot_voxels.contains([]).shape == (0,)
    with pytest.raises(strata.InputError, match=r"points\[1\] is"):
        knot_voxels.contains([[0, 0, 0], [0, np.nan, 0]])


def test_the_affine_leads_to_the_centres(knot_voxels):
    i = np.array(np.nonzero(knot_voxels.numpy()))[:, ::97]
    centres = (knot_voxels.affine @ np.vstack([i, np.ones(i.shape[1])]))[:3].T
    assert knot_voxels.contains(centres).all()


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_slices_are_planes_of_the_array(knot_voxels, axis):
    array = knot_voxels.numpy()
    number = "xyz".index(axis)
    for index in (0, 17, -1):
        plane = knot_voxels.slice(axis, index)
        assert np.array_equal(plane.numpy(), np.take(array, index, axis=number))
    with pytest.raises(strata.UsageError, match="index must be 0 to"):
        knot_voxels.slice(axis, array.shape[number])
    with pytest.raises(strata.UsageError, match="axis must be"):
        knot_voxels.slice("w", 0)


def test_pictures_are_pngs_of_what_is_there(knot_voxels):
    for shown in (knot_voxels, knot_voxels.slice("z", 10)):
        assert shown._repr_png_().startswith(b"\x89PNG")
        picture = shown.picture((120, 80))
        assert picture.shape == (80, 120, 4) and picture.dtype == np.uint8
        assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 1
    with pytest.raises(strata.UsageError, match="size must be 1 to"):
        knot_voxels.picture(0)
    with pytest.raises(strata.UsageError):
        knot_voxels.picture(10, samples=3)


def test_coverage_is_the_filled_fraction_of_each_voxel():
    box = (CUBE_VERTICES * (2.5, 3.25, 1.5) + (0.5, 0, 0), cube_triangles())
    voxels = strata.voxelize(box, like=strata.Grid((4, 4, 3)), coverage=True)
    share = voxels.numpy()
    assert share.dtype == np.float32 and voxels.kind == "fog"
    along = [np.clip(np.minimum(np.arange(n) + 1, high) - np.maximum(np.arange(n), low), 0, 1)
             for n, low, high in ((4, 0.5, 3), (4, 0, 3.25), (3, 0, 1.5))]
    assert np.allclose(share, np.einsum("i,j,k->ijk", *along), atol=1e-6)
    assert np.array_equal(voxels.slice("x", 1).numpy(), share[1])
    assert np.array_equal(voxels.slice("z", 1).numpy(), share[:, :, 1])
    assert voxels.picture(64).shape == (64, 64, 4) and voxels.slice("z", 1).picture(64).shape == (64, 64, 4)
    fine = strata.voxelize(box, like=strata.Grid((4, 4, 3)), coverage=16).numpy()
    assert np.allclose(fine, share, atol=1e-6)


def test_coverage_is_saved_as_a_density(tmp_path, knot):
    voxels = strata.voxelize(knot, resolution=40, coverage=4)
    voxels.save(tmp_path / "fog.nrrd")
    again = strata.read_voxels(tmp_path / "fog.nrrd", integers="values")
    assert np.allclose(again.numpy() / again.numpy().max(), voxels.numpy(), atol=1 / 255)
    assert voxels.numpy().sum() * np.prod(voxels.spacing) == pytest.approx(knot.volume, rel=1e-3)
    with pytest.raises(strata.UsageError, match="coverage must be 1, 2, 4, 8 or 16 rays, got 3"):
        strata.voxelize(knot, resolution=40, coverage=3)
    with pytest.raises(strata.UsageError, match="ids and surface must be False"):
        strata.voxelize(knot, resolution=40, coverage=True, surface=True)


def test_like_gives_the_same_grid(knot_voxels):
    box = strata.voxelize((CUBE_VERTICES, cube_triangles()), like=knot_voxels)
    assert box.dims == knot_voxels.dims and np.array_equal(box.affine, knot_voxels.affine)
    assert 0 < (box.numpy() & knot_voxels.numpy()).sum() < box.count
    again = strata.voxelize((CUBE_VERTICES, cube_triangles()), like=knot_voxels.grid)
    assert again.checksum() == box.checksum()


def test_an_array_becomes_voxels_and_comes_back():
    rng = np.random.default_rng(3)
    mask = rng.random((70, 65, 130)) < 0.4
    for given in (mask, np.asfortranarray(mask), mask[::-1, ::2, 1::3]):
        voxels = strata.Voxels(given, origin=(1, 2, 3), spacing=(0.5, 1, 2))
        assert np.array_equal(voxels.numpy(), given) and voxels.count == given.sum()
        assert voxels.affine[:3, 3] == pytest.approx([1.25, 2.5, 4])
    labels = (mask * rng.integers(0, 5, mask.shape)).astype(np.int16)
    voxels = strata.Voxels(labels)
    assert np.array_equal(voxels.numpy(), labels) and voxels.numpy().dtype == np.uint32
    assert np.array_equal(voxels.numpy(mask=True), labels > 0)
    assert np.array_equal(voxels.slice("y", 3).numpy(), labels[:, 3])


@pytest.mark.parametrize(
    "array, sentence",
    [
        (np.zeros((3, 3)), r"must have the shape \(nx, ny, nz\)"),
        (np.zeros((3, 0, 3), bool), r"each at least 1"),
        (np.zeros((3, 3, 3)), r"must be bool or whole numbers, got float64"),
        (np.full((3, 3, 3), -1), r"labels must be 0 to 2\^32 - 1, got -1"),
    ],
)
def test_arrays_that_are_no_voxels_are_refused(array, sentence):
    with pytest.raises(strata.InputError, match=sentence):
        strata.Voxels(array)


@pytest.mark.parametrize("name", ["k.npy", "k.npz", "k.nrrd", "k.vti", "k.vdb", "k.binvox", "k.zarr/"])
def test_saved_voxels_are_read_again(tmp_path, knot_voxels, name):
    path = f"{tmp_path}/{name}"
    knot_voxels.save(path)
    again = strata.read_voxels(path)
    assert again.count == knot_voxels.count
    middle = np.array(np.nonzero(knot_voxels.numpy())).T[::101]
    points = (knot_voxels.affine[:3, :3] @ middle.T).T + knot_voxels.affine[:3, 3]
    if name not in ("k.npy",):  # .npy does not say where its voxels lie
        assert again.contains(points).all()


def test_labels_are_saved_where_the_format_has_them(tmp_path):
    labels = np.zeros((5, 6, 7), np.uint8)
    labels[1:3, 2:5] = 3
    labels[4] = 200
    strata.Voxels(labels).save(tmp_path / "ids.nrrd")
    assert np.array_equal(strata.read_voxels(tmp_path / "ids.nrrd").numpy(), labels)
    with pytest.raises(strata.UsageError):
        strata.Voxels(labels).save(tmp_path / "ids.binvox")
    with pytest.raises(strata.UsageError, match="the extension must be"):
        strata.Voxels(labels).save(tmp_path / "ids.doc")


def test_vtk_and_openvdb_get_the_same_voxels(knot_voxels):
    pytest.importorskip("vtkmodules.vtkCommonDataModel", reason="python3-vtk9 is missing")
    image = knot_voxels.to_vtk()
    assert image.GetDimensions() == tuple(side + 1 for side in knot_voxels.dims)
    i, j, k = np.array(np.nonzero(knot_voxels.numpy()))[:, 1234]
    assert image.GetCellData().GetScalars().GetTuple1(image.ComputeCellId((int(i), int(j), int(k)))) == 1
    assert image.GetCellData().GetScalars().GetRange() == (0, 1)


def test_openvdb_gets_the_same_voxels(knot_voxels):
    pytest.importorskip("pyopenvdb", reason="python3-openvdb is missing")
    grid = knot_voxels.to_openvdb()
    assert grid.activeVoxelCount() == knot_voxels.count
    assert grid.transform.indexToWorld((3, 4, 5)) == pytest.approx(tuple((knot_voxels.affine @ (3, 4, 5, 1))[:3]))


@pytest.mark.parametrize(
    "options, error, sentence",
    [
        ({}, strata.UsageError, "exactly one of resolution, voxel_size, dims and like must be given, got none"),
        ({"resolution": 4, "voxel_size": 1}, strata.UsageError, "got resolution and voxel_size"),
        ({"resolution": 0}, strata.UsageError, "at least 1 voxel, got 0"),
        ({"resolution": -5}, strata.UsageError, "got -5"),
        ({"resolution": 65537}, strata.LimitError, "65536"),
        ({"resolution": 2**70}, strata.UsageError, "out of range"),
        ({"resolution": 1.5}, TypeError, "must be a whole number"),
        ({"resolution": True}, TypeError, "must be a whole number"),
        ({"voxel_size": 0}, strata.UsageError, "0"),
        ({"voxel_size": float("nan")}, strata.UsageError, "must be finite"),
        ({"voxel_size": (1, 2)}, strata.UsageError, "must be 3 numbers, got 2"),
        ({"voxel_size": 1e-300}, strata.Error, ""),
        ({"dims": (4, 4)}, strata.UsageError, "must be 3 whole numbers"),
        ({"dims": (4, 4, 0)}, strata.Error, ""),
        ({"resolution": 8, "padding": -1}, strata.UsageError, "-1"),
        ({"resolution": 8, "open": "maybe"}, strata.UsageError, "open must be 'vote', 'surface' or 'fail', got 'maybe'"),
        ({"resolution": 8, "surface_kind": 5}, strata.UsageError, "surface_kind must be"),
        ({"resolution": 8, "solid": False}, strata.UsageError, "must not both be False"),
        ({"resolution": 8, "ids": True}, strata.UsageError, "ids"),
        ({"like": 3}, TypeError, "like must be Voxels, a Grid, a path"),
        ({"resolution": 8, "bounds": ((0, 0, 0), (1, 1, 1), (2, 2, 2))}, strata.UsageError, "got 3 rows"),
    ],
)
def test_numbers_out_of_range_are_errors(knot, options, error, sentence):
    with pytest.raises(error, match=sentence):
        strata.voxelize(knot, **options)


def test_an_open_mesh_is_refused_on_request():
    with pytest.warns(strata.StrataWarning):
        mesh = strata.Mesh(CUBE_VERTICES, cube_triangles()[2:])
    with pytest.raises(strata.GeometryError):
        strata.voxelize(mesh, resolution=8, open="fail")
    assert strata.voxelize(mesh, resolution=8).count > 0


def test_a_wall_between_voxel_centres_is_a_warning():
    thin = CUBE_VERTICES * (10, 10, 0.01) + (0, 0, 0.2)
    with pytest.warns(strata.StrataWarning, match="thinner than a voxel"):
        strata.voxelize((thin, cube_triangles()), like=strata.Grid((10, 10, 10)))


def test_a_wall_on_a_turned_grid_is_told_of_where_it_lies_in_the_world():
    thin = CUBE_VERTICES * (0.01, 4, 4) + (-2.8, 1, 1)
    turned = strata.Grid((10, 10, 10), direction=((0, -1, 0), (1, 0, 0), (0, 0, 1)))
    expected = r"1 voxels? thick along y|thick along y, from \(-2\.8, 1, 1\) to \(-2\.79, 5, 5\)"
    for solid in (strata.Mesh(thin, cube_triangles()), strata.csg.solid((thin, cube_triangles()))):
        with pytest.warns(strata.StrataWarning, match=expected):
            strata.voxelize(solid, like=turned)


def test_an_array_that_is_too_large_is_an_error_and_the_set_is_still_there(knot):
    voxels = strata.voxelize(knot, resolution=1024)
    with pytest.raises(strata.LimitError, match="needs"):
        voxels.numpy(memory_limit=10**6)
    assert voxels.slice("z", 200).numpy().any() and isinstance(strata.LimitError("x"), MemoryError)


def test_a_grid_far_from_the_mesh_is_empty_and_says_so(knot):
    with pytest.warns(strata.StrataWarning, match="no voxel is solid"):
        assert strata.voxelize(knot, like=strata.Grid((8, 8, 8), (1e7, 0, 0), 1e-3)).count == 0


def test_voxels_of_a_fine_mesh_are_those_of_vtk_and_come_much_sooner():
    """vtkPolyDataToImageStencil is what pyvista's voxelize_binary_mask calls."""
    pytest.importorskip("vtkmodules.vtkImagingStencil", reason="python3-vtk9 is missing")
    vertices, faces = torus(500, 100)  # 100,000 triangles
    mesh = strata.Mesh(vertices, faces)
    begin = time.perf_counter()
    voxels = strata.voxelize(mesh, resolution=256)
    ours = time.perf_counter() - begin
    begin = time.perf_counter()
    theirs_array = by_vtk(vertices, faces, voxels)
    theirs = time.perf_counter() - begin
    differing = (theirs_array != voxels.numpy()).sum()
    assert differing < 1e-3 * voxels.count, f"{differing} of {voxels.count}"
    assert theirs > 3 * ours  # far more where nothing else runs


def by_vtk(vertices, faces, like):
    """A mask by VTK on the grid of `like`."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkImagingStencil import vtkImageStencilToImage, vtkPolyDataToImageStencil

    points = vtkPoints()
    points.SetData(numpy_to_vtk(vertices, deep=True))
    cells = vtkCellArray()
    packed = np.column_stack([np.full(len(faces), 3), faces]).astype(np.int64).ravel()
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(packed, deep=True))
    polydata = vtkPolyData()
    polydata.SetPoints(points)
    polydata.SetPolys(cells)
    stencil = vtkPolyDataToImageStencil()
    stencil.SetInputData(polydata)
    stencil.SetOutputOrigin(*like.affine[:3, 3])
    stencil.SetOutputSpacing(*like.spacing)
    stencil.SetOutputWholeExtent(0, like.dims[0] - 1, 0, like.dims[1] - 1, 0, like.dims[2] - 1)
    image = vtkImageStencilToImage()
    image.SetInputConnection(stencil.GetOutputPort())
    image.SetInsideValue(1)
    image.SetOutsideValue(0)
    image.Update()
    return vtk_to_numpy(image.GetOutput().GetPointData().GetScalars()).reshape(like.dims, order="F").astype(bool)


def turned(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_a_turned_grid_sees_the_turned_mesh():
    turn = turned(30)
    straight = strata.voxelize((CUBE_VERTICES, cube_triangles()), like=strata.Grid((12, 13, 14), (-0.1, -0.1, -0.1), 0.1))
    affine = straight.affine.copy()
    affine[:3] = turn @ affine[:3]

    class Image:  # such as nibabel's
        shape = (12, 13, 14)

    Image.affine = affine
    moved = strata.voxelize((CUBE_VERTICES @ turn.T, cube_triangles()), like=Image())
    assert np.array_equal(moved.numpy(), straight.numpy()) and np.allclose(moved.affine, affine)
    solid = strata.csg.cube(1).rotate(0, 0, 30).voxelize(like=Image())
    assert np.array_equal(solid.numpy(), straight.numpy())
    inside = (affine @ (5, 5, 5, 1))[:3]
    assert moved.contains([inside, -inside]).tolist() == [True, False]
    again = strata.voxelize((CUBE_VERTICES @ turn.T, cube_triangles()), like=moved)
    assert np.array_equal(again.numpy(), straight.numpy())
    with pytest.raises(strata.UsageError, match="at right angles"):
        strata.Grid((2, 2, 2), direction=((1, 1, 0), (0, 1, 0), (0, 0, 1)))
    with pytest.raises(strata.UsageError, match="along the axes of the world"):
        strata.depth_lists((CUBE_VERTICES, cube_triangles()), like=moved)


def test_the_grid_of_a_file_is_that_of_its_voxels(tmp_path, knot, knot_voxels):
    for name in ("knot.nrrd", "knot.vti"):
        knot_voxels.save(tmp_path / name)
        assert strata.voxelize(knot, like=tmp_path / name).checksum() == knot_voxels.checksum()
    with pytest.raises(strata.InputError):
        strata.voxelize(knot, like=tmp_path / "missing.nrrd")


def test_colours_of_vertices_and_faces_come_to_the_voxels(tmp_path):
    red_below = [[255, 0, 0] if z == 0 else [0, 0, 255] for z in CUBE_VERTICES[:, 2]]
    mesh = strata.Mesh(CUBE_VERTICES, cube_triangles(), vertex_colours=red_below)
    assert mesh.info()["coloured"]
    voxels = strata.voxelize(mesh, resolution=8, colours=True, fill_colour="#00ff00")
    array = voxels.numpy()
    assert array.shape == (8, 8, 8, 4) and array.dtype == np.uint8 and voxels.kind == "colours"
    assert array[3, 3, 0].tolist() == [255, 0, 0, 255] and array[3, 3, 7].tolist() == [0, 0, 255, 255]
    assert array[4, 4, 4].tolist() == [0, 255, 0, 255]
    assert np.array_equal(voxels.slice("z", 7).numpy(), array[:, :, 7])
    assert voxels.picture(64).shape == (64, 64, 4) and voxels._repr_png_()
    faces = strata.Mesh(CUBE_VERTICES, CUBE_QUADS, face_colours=np.eye(6)[:, :3])
    sides = strata.voxelize(faces, resolution=8, colours=True).numpy()
    assert sides[0, 4, 4, :3].tolist() == [255, 0, 0] and sides[7, 4, 4, :3].tolist() == [0, 255, 0]
    voxels.save(tmp_path / "colours.nrrd")
    with pytest.raises(strata.UsageError):
        voxels.save(tmp_path / "colours.binvox")
    with pytest.warns(strata.StrataWarning, match="no colours are given"):
        strata.voxelize((CUBE_VERTICES, cube_triangles()), resolution=4, colours=True)
    with pytest.raises(strata.InputError, match=r"vertex_colours must have the shape \(8, 3\)"):
        strata.Mesh(CUBE_VERTICES, cube_triangles(), vertex_colours=[[0, 0, 0]])
    with pytest.raises(strata.InputError, match=r"face_colours\[0\] must be 0 to 255, got 256"):
        strata.Mesh(CUBE_VERTICES, CUBE_QUADS, face_colours=[[256, 0, 0]] * 6)


def test_voxels_of_a_solid_have_its_colours():
    part = strata.csg.cube(4).colour(1, 0, 0) | strata.csg.cube(4).translate(4, 0, 0).colour("#0000ff80")
    array = part.voxelize(resolution=8, colours=True).numpy()
    assert array.shape == (8, 4, 4, 4)
    assert (array[:4] == (255, 0, 0, 255)).all() and (array[4:] == (0, 0, 255, 128)).all()


def test_distances_are_those_to_the_box():
    box = (CUBE_VERTICES * 4 + 2, cube_triangles())
    grid = strata.Grid((8, 8, 8))
    voxels = strata.voxelize(box, like=grid, sdf=True, band=None)
    distance = voxels.numpy()
    assert distance.dtype == np.float32 and voxels.kind == "distances"
    centres = np.stack(np.meshgrid(*[np.arange(8) + 0.5] * 3, indexing="ij"), axis=-1)
    away = np.abs(centres - 4) - 2
    expected = np.linalg.norm(np.maximum(away, 0), axis=-1) + np.minimum(away.max(axis=-1), 0)
    assert np.allclose(distance, expected, atol=1e-6)
    assert np.array_equal(voxels.numpy(mask=True), distance < 0) and voxels.count == 64
    assert np.array_equal(voxels.slice("y", 2).numpy(), distance[:, 2]) and voxels.slice("y", 2)._repr_png_()
    narrow = strata.voxelize(box, like=grid, sdf=True, band=1).numpy()
    assert np.allclose(narrow, np.clip(expected, -1, 1), atol=1e-6)
    solid = strata.csg.solid(box) | strata.csg.cube(2).translate(3, 3, 3)  # its faces lie inside
    assert np.allclose(solid.voxelize(like=grid, sdf=True, band=None).numpy(), expected, atol=1e-4)
    # Parts of one mesh that overlap: no distance is that to a face within.
    inner = CUBE_VERTICES * 2 + 3
    both = (np.concatenate([box[0], inner]), np.concatenate([box[1], box[1] + len(box[0])]))
    assert np.allclose(strata.voxelize(both, like=grid, sdf=True, band=None).numpy(), expected, atol=1e-4)
    halves = CUBE_VERTICES * (2, 4, 4) + 2
    touching = (np.concatenate([halves, halves + (2, 0, 0)]), np.concatenate([box[1], box[1] + len(halves)]))
    assert np.allclose(strata.voxelize(touching, like=grid, sdf=True, band=None).numpy(), expected, atol=1e-4)
    with pytest.raises(strata.UsageError, match="band must be 0.5 to 1024 voxels, or None, got 0"):
        strata.voxelize(box, like=grid, sdf=True, band=0)
    with pytest.raises(strata.UsageError, match="a voxel holds one of"):
        strata.voxelize(box, like=grid, sdf=True, colours=True)


def test_messages_show_names_that_are_no_utf8(tmp_path):
    (tmp_path / "a.nrrd").write_bytes(b"NRRD0004\ntype: \xca\xfe\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\n0")
    with pytest.raises(strata.InputError, match=r"type '\\xca\\xfe' is not read"):
        strata.read_voxels(tmp_path / "a.nrrd")


@pytest.mark.parametrize("name, band", [("d.vdb", 3), ("d.nrrd", None), ("d.npy", 3)])
def test_distances_are_saved_and_read_again(tmp_path, knot, name, band):
    voxels = strata.voxelize(knot, resolution=40, padding=4, sdf=True, band=band)
    voxels.save(tmp_path / name)
    again = strata.read_voxels(tmp_path / name, threshold=0)
    assert again.kind in ("distances", "values")
    ours, theirs = np.sort(voxels.numpy().ravel()), np.sort(again.numpy().ravel())
    assert ours[0] == theirs[0] and np.array_equal(ours[ours < 0], theirs[theirs < 0])
