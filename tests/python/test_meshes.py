"""Meshes: every kind of array and of object becomes a mesh, or an error that names what is wrong."""
import os
import types

import numpy as np
import pytest
from conftest import CUBE_QUADS, CUBE_VERTICES, cube_triangles, data, tool

import strata


def test_a_mesh_file_has_the_counts_that_the_tool_tells(knot):
    info = knot.info()
    assert (info["vertices"], info["triangles"], info["closed"]) == (1680, 3360, True)
    assert "3360" in tool("info", data("knot.obj")).replace(",", "")
    assert knot.bounds[1] == pytest.approx([3.45, 3.2781, 1.45])


def test_arrays_show_the_mesh_and_cannot_be_written_to(knot):
    assert knot.vertices.dtype == np.float64 and knot.faces.dtype == np.uint32
    assert np.shares_memory(knot.vertices, knot.vertices)
    with pytest.raises(ValueError):
        knot.vertices[0, 0] = 1
    vertices = strata.Mesh(CUBE_VERTICES, cube_triangles()).vertices  # the mesh itself is gone
    assert vertices.sum() == CUBE_VERTICES.sum()


@pytest.mark.parametrize(
    "change",
    [
        lambda v, f: (v.astype(np.float32), f.astype(np.int16)),
        lambda v, f: (v.astype(">f8"), f.astype(">i4")),
        lambda v, f: (np.asfortranarray(v), np.asfortranarray(f)),
        lambda v, f: (np.repeat(v, 2, axis=0)[::2], np.repeat(f, 2, axis=1)[:, ::2]),
        lambda v, f: (v.tolist(), f.tolist()),
        lambda v, f: (v, f.astype(np.float64)),
        lambda v, f: (v, f.astype(np.uint64)),
        lambda v, f: (v, CUBE_QUADS),
        lambda v, f: (v, [q if i else [q[0], q[1], q[2]] for i, q in enumerate(CUBE_QUADS)] + [[0, 3, 2]]),
    ],
)
def test_arrays_of_any_layout_and_number_type_are_the_same_mesh(change):
    vertices, faces = change(CUBE_VERTICES, cube_triangles())
    mesh = strata.Mesh(vertices, faces)
    assert mesh.closed and mesh.volume == pytest.approx(1) and len(mesh.faces) == 12


def test_read_only_arrays_are_taken_and_the_callers_arrays_are_copied():
    vertices, faces = CUBE_VERTICES.copy(), cube_triangles()
    vertices.setflags(write=False)
    mesh = strata.Mesh(vertices, faces)
    faces[:] = 0
    assert mesh.closed


@pytest.mark.parametrize(
    "vertices, faces, sentence",
    [
        ([[0, 0, np.nan]], [[0, 0, 0]], r"vertices\[0\] is \(0, 0, nan\)"),
        ([[0, 0, 0], [np.inf, 0, 0]], [[0, 1, 0]], r"vertices\[1\] is \(inf"),
        (np.zeros((4, 2)), [[0, 1, 2]], r"vertices must have the shape \(n, 3\), got \(4, 2\)"),
        (np.zeros(12), [[0, 1, 2]], r"got \(12,\)"),
        (np.zeros((4, 3)), [[0, 1, -1]], r"faces\[0\] refers to vertex -1, there are 4 vertices"),
        (np.zeros((4, 3)), [[0, 1, 2], [1, 2, 4]], r"faces\[1\] refers to vertex 4"),
        (np.zeros((4, 3)), [[0, 1, 2**40]], r"refers to vertex 1099511627776"),
        (np.zeros((4, 3)), np.array([[0, 1, 2**63]], dtype=np.uint64), r"must be below 2\^63"),
        (np.zeros((4, 3)), [[0, 1, 1.5]], r"faces must be whole numbers"),
        (np.zeros((4, 3)), [[0, 1, np.nan]], r"faces must be whole numbers"),
        (np.zeros((4, 3)), [[True, False, True]], r"faces must be whole numbers, got bool"),
        (np.zeros((4, 3)), [[0, 1]], r"faces must have the shape \(n, 3\)"),
        (np.zeros((4, 3)), [0, 1, 2], r"faces must have the shape \(n, 3\)"),
        ([["a", "b", "c"]], [[0, 0, 0]], r"vertices must be numbers"),
        (np.zeros((4, 3), complex), [[0, 1, 2]], r"vertices must be numbers, got complex128"),
        ([[0, 0, 0], [1, 2]], [[0, 1, 0]], r"vertices"),
        (np.zeros((4, 3)), [[0, 1, 2, 3], [0, 1, 9]], r"faces\[1\] refers to vertex 9"),
    ],
)
def test_bad_arrays_are_refused_with_the_place(vertices, faces, sentence):
    with pytest.raises(strata.InputError, match=sentence):
        strata.Mesh(vertices, faces)


def test_empty_arrays_are_a_mesh_that_no_grid_fits():
    mesh = strata.Mesh([], [])
    assert len(mesh.vertices) == 0 and len(mesh.faces) == 0 and mesh.info()["triangles"] == 0
    with pytest.raises(strata.GeometryError):
        strata.voxelize(mesh, resolution=8)


def test_an_open_mesh_and_an_inverted_one_warn_as_the_tool_does():
    with pytest.warns(strata.StrataWarning, match="the mesh is not closed: 3 of"):
        strata.Mesh(CUBE_VERTICES, cube_triangles()[:-1])
    with pytest.warns(strata.StrataWarning, match="inside out"):
        mesh = strata.Mesh(CUBE_VERTICES, cube_triangles()[:, ::-1])
    assert mesh.volume == pytest.approx(1) and mesh.info()["turned_around"]


def test_objects_of_other_packages_are_meshes():
    triangles = cube_triangles()
    objects = {
        "trimesh": types.SimpleNamespace(vertices=CUBE_VERTICES, faces=triangles),
        "open3d": types.SimpleNamespace(vertices=CUBE_VERTICES.tolist(), triangles=triangles.tolist()),
        "open3d tensors": types.SimpleNamespace(
            vertex={"positions": types.SimpleNamespace(numpy=lambda: CUBE_VERTICES)},
            triangle={"indices": types.SimpleNamespace(numpy=lambda: triangles)},
        ),
        "meshio": types.SimpleNamespace(points=CUBE_VERTICES, cells=[types.SimpleNamespace(type="quad", data=CUBE_QUADS)]),
        "pair": (CUBE_VERTICES, triangles),
    }
    for name, given in objects.items():
        mesh = strata.Mesh(given)
        assert mesh.closed and mesh.volume == pytest.approx(1), name
    with pytest.raises(TypeError, match="a mesh must be"):
        strata.Mesh(object())
    tetrahedra = types.SimpleNamespace(points=CUBE_VERTICES, cells=[types.SimpleNamespace(type="tetra", data=[[0, 1, 2, 3]])])
    with pytest.raises(strata.InputError, match="'tetra' are no faces"):
        strata.Mesh(tetrahedra)


def test_a_polydata_of_vtk_is_a_mesh():
    sources = pytest.importorskip("vtkmodules.vtkFiltersSources")
    cube = sources.vtkCubeSource()
    cube.Update()
    mesh = strata.Mesh(cube.GetOutput())
    assert mesh.closed and mesh.volume == pytest.approx(1)


@pytest.mark.parametrize("name", ["cube.obj", "cube.stl", "cube.ply", "cube.off", "cube.3mf"])
def test_a_saved_mesh_is_read_again(tmp_path, name):
    path = tmp_path / name
    strata.Mesh(CUBE_VERTICES, cube_triangles()).save(path)
    assert strata.read_mesh(path).volume == pytest.approx(1)


def test_files_that_cannot_be_read_or_written_are_errors_with_the_tools_sentences(tmp_path):
    with pytest.raises(strata.InputError, match=r"nope\.obj: No such file or directory") as caught:
        strata.read_mesh(tmp_path / "nope.obj")
    assert caught.value.code == 3 and isinstance(caught.value, ValueError)
    bad = tmp_path / "bad.off"
    bad.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n")
    with pytest.raises(strata.InputError, match=r"bad\.off"):
        strata.read_mesh(bad)
    mesh = strata.Mesh(CUBE_VERTICES, cube_triangles())
    with pytest.raises(strata.UsageError):
        mesh.save(tmp_path / "cube.xyzw")
    with pytest.raises(strata.OutputError):
        mesh.save(tmp_path / "missing" / "cube.obj")
    for path in ("", "a\0b"):
        with pytest.raises(strata.InputError, match="a path must not"):
            strata.read_mesh(path)
    with pytest.raises(strata.UsageError, match="strata.csg.load"):
        strata.read_mesh(data("plate.csg"))
    assert os.listdir(tmp_path) == ["bad.off"]


def test_a_file_is_placed_as_the_tool_places_it(tmp_path):
    strata.Mesh(CUBE_VERTICES * (1, 2, 3), cube_triangles()).save(tmp_path / "box.obj")
    placed = strata.read_mesh(tmp_path / "box.obj", unit="mm", up="y", scale=(1, 2, 1), translate=(1, 0, 0))
    assert np.allclose(placed.bounds, [[1, -6, 0], [2, 0, 2]])
    for options in ({"unit": "mile"}, {"up": "x"}, {"scale": 0}, {"translate": (1, 2)}):
        with pytest.raises(strata.Error):
            strata.read_mesh(tmp_path / "box.obj", **options)


@pytest.mark.parametrize("threads", [-1, 4097])
def test_threads_out_of_range_are_refused(threads):
    with pytest.raises(strata.UsageError, match=f"threads must be 0 to 4096, got {threads}"):
        strata.read_mesh(data("knot.obj"), threads=threads)
