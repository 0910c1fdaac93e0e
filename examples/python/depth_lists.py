# %% [markdown]
# # Depth lists: thickness, and transparency of your own

# %%
import numpy as np

import strata

mesh = strata.read_mesh("data/knot.obj")
lists = strata.depth_lists(mesh, resolution=400)
print(lists)

# %% [markdown]
# One sorted list a pixel, in compressed sparse rows. `counts` is the depth complexity, `thickness` the length inside.

# %%
counts, thickness = lists.counts(), lists.thickness()
print("at most", counts.max(), "crossings; thickest", round(float(thickness.max()), 3))
pixel = thickness.argmax()
rows = slice(int(lists.offsets[pixel]), int(lists.offsets[pixel + 1]))
print(lists.depth[rows].round(3), lists.exit[rows])

# %% [markdown]
# A map of the thickness as a picture.

# %%
grey = (255 * (1 - thickness / thickness.max())).astype(np.uint8)[::-1]
picture = np.dstack([grey, grey, grey, np.full_like(grey, 255)])
png = strata.png_of(picture)
print(png[:4], picture.shape)

# %% [markdown]
# Fragments of your own: three transparent discs that lie across each other. The buffer sorts them, whatever their order.

# %%
width = height = 200
y, x = np.mgrid[0:height, 0:width]
buffer = strata.HashBuffer(width, height)
colours = np.array([[230, 60, 60], [60, 180, 75], [50, 100, 220]])
for number, (cx, cy, tilt) in enumerate([(80, 80, 0.002), (120, 80, -0.002), (100, 120, 0.001)]):
    inside = (x - cx) ** 2 + (y - cy) ** 2 < 60**2
    depth = 0.5 + tilt * (x[inside] - 100) + 0.01 * number
    buffer.insert(np.column_stack([x[inside], y[inside]]), depth, number)
sorted_lists = buffer.lists()
print(sorted_lists)

# %% [markdown]
# Blended back to front, half transparent.

# %%
colour = np.full((height * width, 3), 255.0)
begin, end = sorted_lists.offsets[:-1].astype(int), sorted_lists.offsets[1:].astype(int)
for layer in range(sorted_lists.counts().max()):
    there = end - begin > layer  # the layer-th from the back
    fragment = end[there] - 1 - layer
    colour[there] = 0.5 * colour[there] + 0.5 * colours[sorted_lists.payload[fragment]]
image = np.dstack([colour.reshape(height, width, 3), np.full((height, width), 255.0)]).astype(np.uint8)
print(image.shape, image[100, 100].tolist())
