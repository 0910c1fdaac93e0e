# %% [markdown]
# # A mesh becomes voxels
# Open this file in Jupyter (with jupytext), VS Code or Spyder: `# %%` begins a cell. Run it beside `data/`.

# %%
import numpy as np

import strata

mesh = strata.read_mesh("data/knot.obj")
info = mesh.info()
print(f"{info['triangles']} triangles, {'closed' if info['closed'] else 'open'}, volume {mesh.volume:.3f}")

# %% [markdown]
# A voxel is solid when its centre is inside. The array has one entry for each voxel, `[x, y, z]`.

# %%
voxels = strata.voxelize(mesh, resolution=256)
solid = voxels.numpy()
print(solid.shape, solid.dtype, int(solid.sum()))

# %% [markdown]
# A slice is an array too, and a notebook shows it as a picture.

# %%
plane = voxels.slice("z", 57)
print(plane.numpy().shape, int(plane.numpy().sum()))
plane

# %% [markdown]
# Runs need far less memory than the array, and `contains` asks for points of the world.

# %%
runs = voxels.runs()
print(len(runs), "runs, the longest has", runs["length"].max(), "voxels")
centre = voxels.affine @ (122, 40, 90, 1)
print(voxels.contains([centre[:3], (0, 0, 0)]))

# %% [markdown]
# The same grid for another mesh makes arrays that can be compared.

# %%
corners = np.array([[x, y, z] for x in (-1, 3) for y in (-1, 3) for z in (-1, 1)], dtype=float)
quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
box = strata.voxelize((corners, quads), like=voxels)
print(f"{(box.numpy() & solid).sum() / solid.sum():.1%} of the knot lie in the box")

# %%
voxels.save("knot.nrrd")
print(strata.read_voxels("knot.nrrd"))
