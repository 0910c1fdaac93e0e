#!/usr/bin/env python3
"""Files of voxels as the programs see them that they are written for.

usage: read_by_others.py WRITE_FILES READER

WRITE_FILES writes a part in all formats, kinds of values and frames (write_files.cpp). READER, a package of Python, reads
those of its formats: order of the axes, spacing, origin, direction and every value have to be right. Ends with 77 if the
package is missing.
"""
import importlib
import json
import os
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("skipped: numpy is missing (python3-numpy)")
    sys.exit(77)

DIMS = (70, 11, 7)
ORIGIN = np.array([-3.5, 20.25, 1.125])
SIZE = np.array([0.5, 0.25, 0.75])
TURN = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, 0.28, -0.96], [0, 0.96, 0.28]])
DIRECTIONS = {"plain": np.eye(3), "turned": TURN, "ras": TURN}
LABELS = {"ids8": 250, "ids16": 60000, "ids32": 90000, "shares": 64, "floats": 64}
TYPES = {"flags": np.uint8, "ids8": np.uint8, "ids16": np.uint16, "ids32": np.uint32, "shares": np.uint8,
         "floats": np.float32}
LPS = np.diag([-1.0, -1.0, 1.0])


def part(kind):
    """The array [x, y, z] of a kind; of colours [x, y, z, 4]."""
    i, j, k = np.indices(DIMS, dtype=np.int64)
    solid = (i >= 2) & (i < 67) & (j >= 1) & ((i < 9) | (j < 4)) & (j < 11) & (k < 6)
    solid &= ~((i >= 4) & (i < 6) & (j >= 5) & (j < 7))
    number = i // 7 + 11 * (j // 2) + 37 * k
    if kind == "flags":
        return solid.astype(np.uint8)
    if kind == "colours":
        packed = np.where(solid, 0x80000000 + (number * 2654435761 % 2**32) % 0x7fffffff, 0)
        return np.stack([(packed >> shift & 255).astype(np.uint8) for shift in (0, 8, 16, 24)], axis=-1)
    label = np.where(solid, 1 + number * 977 % LABELS[kind], 0)
    if kind == "shares":
        return np.floor(255.0 * label / 64 + 0.5).astype(np.uint8)
    if kind == "floats":
        return (label / 64.0).astype(np.float32)
    return label.astype(TYPES[kind])


def affine(frame, world=np.eye(3)):
    """From indices to the centres of voxels."""
    matrix = np.eye(4)
    direction = world @ DIRECTIONS[frame]
    matrix[:3, :3] = direction * SIZE
    matrix[:3, 3] = direction @ (ORIGIN + 0.5 * SIZE)
    return matrix


class Check:
    def __init__(self):
        self.files = 0
        self.faults = []

    def values(self, path, kind, found, scale=1):
        self.files += 1
        expected = part(kind)
        assert expected.any() and not np.array_equal(expected, expected[::-1])
        found = np.asarray(found)
        if found.shape != expected.shape:
            self.faults.append(f"{path}: shape {found.shape}, expected {expected.shape}")
        elif not np.array_equal(found, expected.astype(np.float64) * scale if scale != 1 else expected):
            self.faults.append(f"{path}: {np.count_nonzero(found != expected * scale)} values differ")

    def same(self, path, what, found, expected, tolerance=1e-12):
        found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
        if found.shape != expected.shape or not np.allclose(found, expected, rtol=0, atol=tolerance):
            self.faults.append(f"{path}: {what} is {found.tolist()}, expected {expected.tolist()}")

    def equal(self, path, what, found, expected):
        if found != expected:
            self.faults.append(f"{path}: {what} is {found!r}, expected {expected!r}")


def files(folder, ending, kinds=None):
    """(path, kind, frame) of the files with an ending."""
    for name in sorted(os.listdir(folder)):
        kind, _, rest = name.partition("_")
        for frame in DIRECTIONS:
            if rest == frame + ending and (kinds is None or kind in kinds):
                yield os.path.join(folder, name), kind, frame


def numpy_reads(module, folder, check):
    for path, kind, frame in files(folder, ".npy"):
        array = np.load(path)
        check.values(path, kind, np.moveaxis(array, 0, -1) if kind == "colours" else array)
        if kind != "flags" and kind != "colours":
            check.equal(path, "type", array.dtype, np.dtype(TYPES[kind]))
    for path, kind, frame in files(folder, ".npz"):
        with np.load(path) as file:
            array = file["voxels"]
            check.values(path, kind, np.moveaxis(array, 0, -1) if kind == "colours" else array)
            check.same(path, "origin", file["origin"], ORIGIN)
            check.same(path, "spacing", file["spacing"], SIZE)


def nibabel_reads(nibabel, folder, check):
    for ending in (".nii", ".nii.gz"):
        for path, kind, frame in files(folder, ending):
            image = nibabel.load(path)
            found = np.asanyarray(image.dataobj)
            if kind == "colours":
                found = np.stack([found[channel] for channel in "RGBA"], axis=-1)
            check.values(path, kind, found)
            world = affine(frame)
            check.same(path, "sform", image.get_sform(), world, 1e-6)
            check.same(path, "qform", image.get_qform(), world, 1e-5)
            check.same(path, "zooms", image.header.get_zooms(), SIZE, 1e-7)
            check.equal(path, "unit", image.header.get_xyzt_units()[0], "unknown" if frame == "plain" else "mm")


def tifffile_reads(tifffile, folder, check):
    for ending in (".tif", ".tiff"):
        for path, kind, frame in files(folder, ending):
            with tifffile.TiffFile(path) as file:
                found = file.asarray()
                imagej = file.imagej_metadata
                check.equal(path, "pages", len(file.pages), DIMS[2])
                across = [file.pages[0].tags[tag].value for tag in ("XResolution", "YResolution")]
            axes = (2, 1, 0, 3) if kind == "colours" else (2, 1, 0)
            check.values(path, kind, found.transpose(axes), 255 if kind == "flags" else 1)
            check.same(path, "size of a pixel", [under / over for over, under in across], SIZE[:2], 1e-9)
            check.equal(path, "slices", imagej["slices"], DIMS[2])
            check.same(path, "spacing", imagej["spacing"], SIZE[2])
            origin = [imagej[axis + "origin"] for axis in "xyz"]
            check.same(path, "origin", -np.array(origin) * SIZE, ORIGIN + 0.5 * SIZE, 1e-9)
            check.equal(path, "unit", imagej.get("unit"), None if frame == "plain" else "mm")


def h5py_reads(h5py, folder, check):
    for ending in (".h5", ".hdf5"):
        for path, kind, frame in files(folder, ending):
            with h5py.File(path, "r") as file:
                array = file["voxels"]
                check.values(path, kind, array[:].transpose((2, 1, 0, 3) if kind == "colours" else (2, 1, 0)))
                if kind != "colours":
                    check.equal(path, "type", array.dtype, np.dtype(TYPES[kind]))
                check.same(path, "origin", array.attrs["origin"], ORIGIN)
                check.same(path, "spacing", array.attrs["spacing"], SIZE)
                check.same(path, "direction", array.attrs["direction"], DIRECTIONS[frame])
                check.equal(path, "axes", array.attrs["axes"], "zyxc" if kind == "colours" else "zyx")
                check.equal(path, "unit", array.attrs.get("unit"), None if frame == "plain" else "mm")


def zarr_reads(zarr, folder, check):
    for path, kind, frame in files(folder, ".zarr"):
        array = zarr.open(path, mode="r")
        check.values(path, kind, array[:])
        check.same(path, "origin", array.attrs["origin"], ORIGIN)
        check.same(path, "spacing", array.attrs["voxel_size"], SIZE)


def halved(array, kind):
    """Half the resolution: any of flags, the label most of the solid ones have, the mean of shares."""
    padded = np.pad(array, [(0, side % 2) for side in array.shape[:3]] + [(0, 0)] * (array.ndim - 3))
    nx, ny, nz = (side // 2 for side in padded.shape[:3])
    eight = padded.reshape((nx, 2, ny, 2, nz, 2) + array.shape[3:])
    if kind == "flags":
        return eight.max(axis=(1, 3, 5))
    if kind in ("shares", "floats"):
        return eight.mean(axis=(1, 3, 5))
    packed = eight if kind != "colours" else (eight.astype(np.uint64) << np.array([0, 8, 16, 24], dtype=np.uint64)).sum(-1)
    voxels = packed.transpose(0, 2, 4, 1, 3, 5).reshape(-1, 8)
    result = np.zeros(len(voxels), dtype=packed.dtype)
    for at in np.flatnonzero(voxels.any(axis=1)):
        labels, counts = np.unique(voxels[at][voxels[at] != 0], return_counts=True)
        result[at] = labels[counts.argmax()]
    result = result.reshape(nx, ny, nz)
    if kind != "colours":
        return result
    return np.stack([(result >> np.uint64(shift) & np.uint64(255)).astype(np.uint8) for shift in (0, 8, 16, 24)], axis=-1)


def ome_zarr_reads(zarr, folder, check):
    for path, kind, frame in files(folder, ".ome.zarr"):
        group = zarr.open_group(path, mode="r")
        scales = group.attrs["multiscales"][0]
        check.equal(path, "version", scales["version"], "0.4")
        names = "czyx" if kind == "colours" else "zyx"
        check.equal(path, "axes", "".join(axis["name"] for axis in scales["axes"]), names)
        unit = scales["axes"][-1].get("unit")
        check.equal(path, "unit", unit, None if frame == "plain" else "millimeter")
        check.equal(path, "levels", [level["path"] for level in scales["datasets"]], ["0", "1", "2"])
        expected = part("floats" if kind == "shares" else kind)
        for number, level in enumerate(scales["datasets"]):
            found = np.asarray(group[level["path"]]).transpose((3, 2, 1, 0) if kind == "colours" else (2, 1, 0))
            if number == 0:
                check.values(path, kind, found)
            else:
                expected = halved(expected, kind)
                exact = np.floor(255 * expected + 0.5) if kind == "shares" else expected
                if found.shape != exact.shape or not np.array_equal(found, exact.astype(found.dtype)):
                    check.faults.append(f"{path}: level {number} differs")
            scale, shift = (step[step["type"]][-3:][::-1] for step in level["coordinateTransformations"])
            check.same(path, "scale", scale, SIZE * 2**number)
            check.same(path, "translation", shift, ORIGIN + SIZE * 2**number / 2)
            if frame != "plain":
                check.same(path, "direction", group.attrs["direction"], TURN)


def pillow_reads(image_module, folder, check):
    for path, kind, frame in files(folder, "_slices"):
        with open(os.path.join(path, "slices.json")) as file:
            facts = json.load(file)
        check.same(path, "origin", facts["origin"], ORIGIN)
        check.same(path, "spacing", facts["voxel_size"], SIZE)
        layers = []
        for z in range(DIMS[2]):
            with image_module.open(os.path.join(path, facts["slices"] % z)) as picture:
                layers.append(np.array(picture).astype(np.uint8 if kind == "flags" else np.array(picture).dtype))
        found = np.stack(layers)[:, ::-1]  # the first row is the greatest y
        kind = "shares" if kind == "floats" else kind  # pictures hold bytes
        check.values(path, kind, found.transpose((2, 1, 0, 3) if kind == "colours" else (2, 1, 0)))


def pyopenvdb_reads(openvdb, folder, check):
    openvdb = importlib.import_module("pyopenvdb") if openvdb is None else openvdb
    for path, kind, frame in files(folder, ".vdb", ("flags", "ids8", "ids16", "ids32", "shares", "floats")):
        grid = openvdb.readAll(path)[0][0]
        array = np.zeros(DIMS, dtype=bool if kind == "flags" else np.float32)
        grid.copyToArray(array)
        expected = part("floats") if kind == "shares" else part(kind)
        check.files += 1
        if not np.array_equal(array, expected.astype(array.dtype)):
            check.faults.append(f"{path}: {np.count_nonzero(array != expected)} values differ")
        corners = [grid.transform.indexToWorld(index) for index in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))]
        world = affine(frame) if VDB_TURNS else affine("plain")
        check.same(path, "centre", corners[0], world[:3, 3], 1e-9)
        steps = np.stack([np.subtract(corner, corners[0]) for corner in corners[1:]], axis=1)
        check.same(path, "steps", steps, world[:3, :3], 1e-9)


VDB_TURNS = True


def vtk_array(image, vtk_to_numpy, cells):
    data = image.GetCellData() if cells else image.GetPointData()
    array = vtk_to_numpy(data.GetScalars())
    shape = DIMS if array.ndim == 1 else DIMS + (array.shape[1],)
    axes = (2, 1, 0) if array.ndim == 1 else (2, 1, 0, 3)
    return array.reshape((DIMS[2], DIMS[1], DIMS[0]) + shape[3:]).transpose(axes)


def vtk_reads(_, folder, check):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOImage import vtkMetaImageReader, vtkNIFTIImageReader, vtkNrrdReader
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    def read(reader, path):
        reader.SetFileName(path)
        reader.Update()
        return reader.GetOutput()

    for path, kind, frame in files(folder, ".vti"):
        image = read(vtkXMLImageDataReader(), path)
        check.values(path, kind, vtk_array(image, vtk_to_numpy, True))
        check.same(path, "spacing", image.GetSpacing(), SIZE)
        if frame == "plain":
            check.same(path, "origin", image.GetOrigin(), ORIGIN)
    for ending in (".mha", ".mhd"):
        for path, kind, frame in files(folder, ending):
            image = read(vtkMetaImageReader(), path)
            check.values(path, kind, vtk_array(image, vtk_to_numpy, False))
            check.same(path, "spacing", image.GetSpacing(), SIZE)
            world = affine(frame, LPS if frame == "ras" else np.eye(3))
            check.same(path, "origin", image.GetOrigin(), world[:3, 3], 1e-9)
    for path, kind, frame in files(folder, ".nhdr"):
        if kind == "colours" or frame != "plain":
            continue  # it reads neither
        image = read(vtkNrrdReader(), path)
        check.values(path, kind, vtk_array(image, vtk_to_numpy, False))
        check.same(path, "spacing", image.GetSpacing(), SIZE)
        check.same(path, "origin", image.GetOrigin(), ORIGIN + 0.5 * SIZE)
    for path, kind, frame in files(folder, ".nii"):
        if kind == "colours":
            continue
        reader = vtkNIFTIImageReader()
        image = read(reader, path)
        check.values(path, kind, vtk_array(image, vtk_to_numpy, False))
        matrix = reader.GetSFormMatrix()
        found = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])
        expected = affine(frame)
        expected[:3, :3] /= SIZE
        check.same(path, "sform", found[:3, :3] / np.linalg.norm(found[:3, :3], axis=0), expected[:3, :3], 1e-6)
        check.same(path, "offset", found[:3, 3], expected[:3, 3], 1e-6)


READERS = {"numpy": ("numpy", numpy_reads), "nibabel": ("nibabel", nibabel_reads),
           "tifffile": ("tifffile", tifffile_reads), "h5py": ("h5py", h5py_reads), "zarr": ("zarr", zarr_reads),
           "ome_zarr": ("zarr", ome_zarr_reads), "pillow": ("PIL.Image", pillow_reads),
           "pyopenvdb": ("pyopenvdb", pyopenvdb_reads), "vtk": ("vtkmodules", vtk_reads)}


def main():
    writer, reader = sys.argv[1:]
    package, reads = READERS[reader]
    try:
        module = importlib.import_module(package)
    except ImportError as error:
        print(f"skipped: {error}")
        sys.exit(77)
    check = Check()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([writer, folder], check=True)
        reads(module, folder, check)
    print("\n".join(check.faults))
    print(f"{reader}: {check.files} files, {len(check.faults)} faults")
    sys.exit(1 if check.faults or check.files < 3 else 0)


main()
