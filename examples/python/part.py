# %% [markdown]
# # A part by Boolean operations: picture, size, mesh

# %%
import strata
from strata import csg

plate = csg.cube((60, 40, 8)).translate(-30, -20, 0)
hole = csg.cylinder(20, d=6, center=True, fn=48)
holes = csg.union(hole.translate(x, y, 0) for x in (-22, 22) for y in (-12, 12))
boss = csg.cylinder(20, r1=12, r2=9, fn=96) - csg.cylinder(50, r=6, center=True, fn=96)
part = (plate - holes - csg.cylinder(50, r=6, center=True, fn=96)).colour("#7f8fa6") | boss.colour("#e1942d")
part

# %% [markdown]
# The picture as an array, from a camera of your own.

# %%
picture = part.picture((640, 480), camera=strata.Camera(rotation=(65, 0, 40)), ground_shadow=True)
print(picture.shape, picture.dtype)

# %% [markdown]
# Sizes are exact, up to the rounding of vertices to a lattice.

# %%
sizes = part.measure()
print(f"volume {sizes.volume:.3f} +- {sizes.volume_error:.3f}, area {sizes.area:.3f}, exact: {sizes.exact}")
print("box", [round(x, 3) for x in sizes.low], [round(x, 3) for x in sizes.high])

# %% [markdown]
# The boundary is a closed mesh, for NumPy or a file.

# %%
mesh = part.mesh()
print(mesh.vertices.shape, mesh.faces.shape, mesh.closed)
part.save("part.3mf")

# %% [markdown]
# Voxels know which solid they belong to.

# %%
ids = part.voxelize(resolution=120, ids=True)
print(ids.dims, ids.kind, sorted(set(ids.runs()["label"].tolist())))
