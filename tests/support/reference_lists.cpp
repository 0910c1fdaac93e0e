#include "tests/support/reference_lists.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "raster/tile_bins.h"

namespace strata::testkit {
namespace {

template <class Key>
Key make_key(std::uint32_t depth, bool exit, std::uint32_t triangle) {
  if constexpr (std::is_same_v<Key, DepthItem>) {
    return DepthItem(depth, exit, triangle);
  } else {
    static_cast<void>(triangle);
    return depth << 1 | (exit ? 1u : 0u);
  }
}

std::size_t pixel_count(const RasterTarget& target) {
  return static_cast<std::size_t>(target.width) * static_cast<std::size_t>(target.height);
}

std::size_t pixel_at(const RasterTarget& target, int u, int v) {
  return static_cast<std::size_t>(v) * static_cast<std::size_t>(target.width) +
         static_cast<std::size_t>(u);
}

template <class Emit>
void for_each_crossing(const LatticeMesh& mesh, const RasterTarget& target, Emit&& emit) {
  const AxisFrame frame(target.axis);
  const PixelRect all{0, 0, target.width, target.height};
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& t = mesh.triangles[i];
    TriangleSetup setup;
    if (!setup_triangle(mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z], frame, setup)) {
      continue;
    }
    rasterize_exact(setup, all, target.depth_limit, [&](int u, int v, std::uint32_t depth) {
      emit(u, v, depth, setup.exit, static_cast<std::uint32_t>(i));
    });
  }
}

template <class Key>
Lists<Key> concatenate(std::vector<std::vector<Key>>& pixels) {
  Lists<Key> lists;
  for (auto& list : pixels) {
    lists.keys.insert(lists.keys.end(), list.begin(), list.end());
    lists.offsets.push_back(lists.keys.size());
  }
  return lists;
}

/// Planar or compressed rows -> the list of each pixel of the tile.
template <class Key>
std::vector<Key> read_list(const TileLists<Key>& lists, std::size_t pixel) {
  constexpr int kValueBits = std::is_same_v<Key, DepthKey> ? 24 : 56;  // the age is above them
  const auto* planes = [&] {
    if constexpr (std::is_same_v<Key, DepthKey>) {
      return lists.planes32;
    } else {
      return lists.planes64;
    }
  }();
  std::vector<Key> list;
  if (planes == nullptr) {
    list.assign(lists.keys + lists.offsets[pixel], lists.keys + lists.offsets[pixel + 1]);
    return list;
  }
  const int row = static_cast<int>(pixel / kTileSide);
  if (row < lists.row_begin || row >= lists.row_end) return list;
  for (std::size_t side = 0; side < kSides<Key>; ++side) {
    bool ended = false;
    const auto read = static_cast<std::ptrdiff_t>(list.size());
    for (int age = 1; age <= lists.ages; ++age) {
      const std::size_t plane = static_cast<std::size_t>(age - 1) * kSides<Key> + side;
      const auto record = planes[plane * kTilePixels + pixel];
      if (record == 0) {
        ended = true;
        continue;
      }
      EXPECT_FALSE(ended) << "a gap in the planes of pixel " << pixel;
      EXPECT_EQ(static_cast<int>(record >> kValueBits), age);
      list.push_back(Key(~record & ((std::remove_const_t<decltype(record)>{1} << kValueBits) - 1)));
      if constexpr (kSides<Key> == 2) {
        EXPECT_EQ(list.back() & 1, side);
      }
    }
    EXPECT_TRUE(std::is_sorted(list.begin() + read, list.end()));
  }
  std::sort(list.begin(), list.end());
  return list;
}

template <class Count>
std::size_t count_lists(const Lists<DepthItem>& lists, Count&& wanted) {
  std::size_t n = 0;
  for (std::size_t pixel = 0; pixel + 1 < lists.offsets.size(); ++pixel) {
    n += wanted(lists.list(pixel)) ? 1 : 0;
  }
  return n;
}

void sum_along(Winding& winding, const AxisFrame& frame) {
  const glm::ivec3& dims = winding.dims();
  glm::ivec3 step{};
  step[frame.w] = 1;
  winding.for_each([&](const glm::ivec3& p) {
    if (p[frame.w] + 1 < dims[frame.w]) winding.at(p + step) += winding.at(p);
  });
}

void add_crossing(Winding& winding, const AxisFrame& frame, int u, int v, std::uint32_t depth,
                  bool exit) {
  glm::ivec3 p{};
  p[frame.u] = u, p[frame.v] = v;
  // The first voxel whose centre, at 256 k + 128, lies above the floor of the crossing.
  int k = 0;
  while (k < winding.dims()[frame.w] && k * 256 + 128 <= static_cast<int>(depth)) ++k;
  p[frame.w] = k;
  if (winding.contains(p)) winding.at(p) += exit ? -1 : 1;
}

}  // namespace

RasterTarget target_of(const VoxelGrid& grid, Axis axis) {
  const AxisFrame frame(axis);
  return {axis, grid.dims[frame.u], grid.dims[frame.v],
          static_cast<std::uint32_t>(grid.dims[frame.w]) * kLatticeSteps};
}

template <class Key>
Lists<Key> reference_lists(const LatticeMesh& mesh, const RasterTarget& target) {
  std::vector<std::vector<Key>> pixels(pixel_count(target));
  for_each_crossing(
      mesh, target, [&](int u, int v, std::uint32_t depth, bool exit, std::uint32_t triangle) {
        pixels[pixel_at(target, u, v)].push_back(make_key<Key>(depth, exit, triangle));
      });
  for (auto& list : pixels) std::sort(list.begin(), list.end());
  return concatenate(pixels);
}

template <class Key>
Lists<Key> built_lists(const LatticeMesh& mesh, const RasterTarget& target,
                       const TileStoreOptions& options) {
  BuilderOf<Key> builder(options);
  return built_lists(builder, mesh, target);
}

template <class Builder>
Lists<typename Builder::Key> built_lists(Builder& builder, const LatticeMesh& mesh,
                                         const RasterTarget& target) {
  using Key = typename Builder::Key;
  std::vector<std::vector<Key>> pixels(pixel_count(target));
  const auto bins = bin_triangles(mesh, target);
  EXPECT_TRUE(bins.has_value());
  if (!bins) return {};
  for (int tv = 0; tv < bins->tiles_v; ++tv) {
    for (int tu = 0; tu < bins->tiles_u; ++tu) {
      const auto lists = builder.build(mesh, target, bins->tile(tu, tv), tu, tv);
      EXPECT_TRUE(lists.has_value()) << lists.error().message;
      if (!lists) return {};
      std::uint64_t found = 0;
      for (std::size_t local = 0; local < kTilePixels; ++local) {
        auto list = read_list<Key>(*lists, local);
        found += list.size();
        const int u = tu * kTileSide + static_cast<int>(local % kTileSide);
        const int v = tv * kTileSide + static_cast<int>(local / kTileSide);
        if (u < target.width && v < target.height) {
          pixels[pixel_at(target, u, v)] = std::move(list);
        } else {
          EXPECT_TRUE(list.empty()) << "a fragment outside the image, at " << u << ", " << v;
        }
      }
      EXPECT_EQ(found, lists->fragments) << "tile " << tu << ", " << tv;
    }
  }
  Lists<Key> result = concatenate(pixels);
  result.rebuilt_tiles = builder.rebuilt_tiles();
  return result;
}

Winding reference_winding(const LatticeMesh& mesh, const VoxelGrid& grid, Axis axis) {
  const AxisFrame frame(axis);
  Winding winding(grid.dims);
  for_each_crossing(mesh, target_of(grid, axis),
                    [&](int u, int v, std::uint32_t depth, bool exit, std::uint32_t) {
                      add_crossing(winding, frame, u, v, depth, exit);
                    });
  sum_along(winding, frame);
  return winding;
}

Winding winding_of(const Lists<DepthItem>& lists, const VoxelGrid& grid, Axis axis) {
  const AxisFrame frame(axis);
  Winding winding(grid.dims);
  const int width = grid.dims[frame.u];
  for (int v = 0; v < grid.dims[frame.v]; ++v) {
    for (int u = 0; u < width; ++u) {
      for (const DepthItem item : lists.list(static_cast<std::size_t>(v * width + u))) {
        add_crossing(winding, frame, u, v, item.depth(), item.exit());
      }
    }
  }
  sum_along(winding, frame);
  return winding;
}

std::size_t unbalanced_lists(const Lists<DepthItem>& lists) {
  return count_lists(lists, [](std::span<const DepthItem> list) {
    const auto exits =
        std::count_if(list.begin(), list.end(), [](DepthItem i) { return i.exit(); });
    return static_cast<std::size_t>(exits) * 2 != list.size();
  });
}

std::size_t odd_lists(const Lists<DepthItem>& lists) {
  return count_lists(lists, [](std::span<const DepthItem> list) { return list.size() % 2 != 0; });
}

std::size_t negative_lists(const Lists<DepthItem>& lists) {
  return count_lists(lists, [](std::span<const DepthItem> list) {
    int winding = 0, lowest = 0;
    for (const DepthItem item : list) {
      winding += item.exit() ? -1 : 1;
      lowest = std::min(lowest, winding);
    }
    return lowest < 0;
  });
}

template Lists<DepthItem> reference_lists<DepthItem>(const LatticeMesh&, const RasterTarget&);
template Lists<DepthKey> reference_lists<DepthKey>(const LatticeMesh&, const RasterTarget&);
template Lists<DepthKey> built_lists<DepthKey>(const LatticeMesh&, const RasterTarget&,
                                               const TileStoreOptions&);
template Lists<DepthItem> built_lists<DepthItem>(const LatticeMesh&, const RasterTarget&,
                                                 const TileStoreOptions&);

template Lists<DepthKey> built_lists<KeyTileBuilder>(KeyTileBuilder&, const LatticeMesh&,
                                                     const RasterTarget&);
template Lists<DepthItem> built_lists<ItemTileBuilder>(ItemTileBuilder&, const LatticeMesh&,
                                                       const RasterTarget&);

}  // namespace strata::testkit
