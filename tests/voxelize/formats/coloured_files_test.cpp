// Files of coloured voxels that are no dense arrays: .vox palettes, points, Minecraft's schematics.

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

#include "strata/voxelize/formats/voxel_writer.h"
#include "tests/voxelize/formats/voxel_readers.h"
#include "tests/voxelize/voxel_samples.h"
#include "voxelize/output/palette.h"

namespace strata::testing {
namespace {

std::uint32_t packed(int red, int green, int blue, int alpha = 255) {
  return static_cast<std::uint32_t>(red | green << 8 | blue << 16) |
         static_cast<std::uint32_t>(alpha) << 24;
}

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const VoxelIntervals& set, const std::string& path, VoxelWriterOptions options = {}) {
  const auto done = write_voxels(set, path, options);
  ASSERT_TRUE(done) << done.error().message;
}
VoxelWriterOptions colours() {
  VoxelWriterOptions options;
  options.rgba = true;
  return options;
}

// An L of voxels: nothing about it is the same along two axes.
std::uint32_t l_shape(int i, int j, int k) {
  if (j == 1 && k == 2) return packed(10 * i + 5, 20, 30);
  if (i == 0 && k == 2) return packed(1, 2 + j, 200);
  return i == 0 && j == 1 ? packed(90, 91, 92 + k, 128) : 0;
}
VoxelGrid l_grid() { return make_grid({5, 4, 3}, {10.0, -3.0, 0.5}, {0.5, 0.25, 2.0}); }

TEST(PlyPoints, AreTheCentresWithTheirColours) {
  const TemporaryFolder folder;
  const std::string path = folder.file("l.ply");
  write(labelled(l_grid(), Axis::kZ, l_shape), path, colours());
  const std::string file = bytes_of(path);
  const std::size_t end = file.find("end_header\n");
  ASSERT_NE(end, std::string::npos);
  std::istringstream head(file.substr(0, end));
  std::string line, properties;
  std::size_t count = 0;
  while (std::getline(head, line)) {
    if (line.starts_with("element vertex ")) count = std::stoul(line.substr(15));
    if (line.starts_with("property ")) properties += line.substr(9) + "; ";
  }
  EXPECT_EQ(properties,
            "float x; float y; float z; uchar red; uchar green; uchar blue; uchar alpha; ");
  std::map<std::tuple<int, int, int>, std::uint32_t> found;
  ASSERT_EQ(file.size(), end + 11 + count * 16);
  for (std::size_t i = 0; i < count; ++i) {
    float at[3];
    std::uint32_t colour;
    std::memcpy(at, file.data() + end + 11 + 16 * i, 12);
    std::memcpy(&colour, file.data() + end + 11 + 16 * i + 12, 4);
    const glm::dvec3 voxel =
        (glm::dvec3(at[0], at[1], at[2]) - l_grid().origin) / l_grid().voxel_size - 0.5;
    found[{static_cast<int>(std::lround(voxel.x)), static_cast<int>(std::lround(voxel.y)),
           static_cast<int>(std::lround(voxel.z))}] = colour;
    EXPECT_NEAR(voxel.x, std::round(voxel.x), 1e-6);
  }
  std::size_t solid = 0;
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 4; ++j) {
      for (int k = 0; k < 3; ++k) {
        if (l_shape(i, j, k) == 0) continue;
        ++solid;
        EXPECT_EQ((found[{i, j, k}]), l_shape(i, j, k)) << i << j << k;
      }
    }
  }
  EXPECT_EQ(found.size(), solid);
  EXPECT_EQ(count, solid);
}

TEST(PlyPoints, AreDoublesWhereFloatsAreTooCoarse) {
  const TemporaryFolder folder;
  VoxelGrid grid = l_grid();
  grid.origin.x = 4.0e6;
  VoxelWriterOptions ids;
  ids.ids = 7;
  write(labelled(grid, Axis::kX, [](int i, int j, int k) { return i + j + k == 3 ? 7u : 0u; }),
        folder.file("far.ply"), ids);
  const std::string file = bytes_of(folder.file("far.ply"));
  EXPECT_NE(file.find("property double x\n"), std::string::npos);
  EXPECT_NE(file.find("property int id\n"), std::string::npos);
  double x;
  std::int32_t id;
  const char* first = file.data() + file.find("end_header\n") + 11;
  std::memcpy(&x, first, sizeof x);
  std::memcpy(&id, first + 24, sizeof id);
  EXPECT_EQ(x, 4.0e6 + 3.5 * 0.5);  // (3, 0, 0) is the first by z, then y
  EXPECT_EQ(id, 7);
}

TEST(XyzPoints, AreLines) {
  const TemporaryFolder folder;
  const VoxelGrid grid = l_grid();
  write(labelled(grid, Axis::kZ,
                 [](int i, int j, int k) {
                   return k == 1 && j == 0 && i > 2 ? packed(i, 50, 255) : 0u;
                 }),
        folder.file("a.xyz"), colours());
  EXPECT_EQ(bytes_of(folder.file("a.xyz")),
            "11.75 -2.875 3.5 3 50 255\n12.25 -2.875 3.5 4 50 255\n");
  write(labelled(grid, Axis::kX, [](int i, int j, int k) { return i + j + k == 0 ? 1u : 0u; }),
        folder.file("b.xyz"));
  EXPECT_EQ(bytes_of(folder.file("b.xyz")), "10.25 -2.875 1.5\n");
}

/// A reader of NBT: all numbers, arrays and texts by their path.
class Nbt {
 public:
  explicit Nbt(const std::string& bytes) : bytes_(bytes) {
    EXPECT_EQ(take(1), 10u);
    const std::string name = text();
    compound(name);
    EXPECT_EQ(at_, bytes.size());
  }
  std::map<std::string, std::int64_t> numbers;
  std::map<std::string, std::string> arrays;

 private:
  std::uint64_t take(int count) {
    std::uint64_t value = 0;
    for (; count > 0; --count) value = value << 8 | static_cast<unsigned char>(bytes_.at(at_++));
    return value;
  }
  std::string text() {
    const std::size_t length = take(2);
    at_ += length;
    return bytes_.substr(at_ - length, length);
  }
  void compound(const std::string& path) {
    while (true) {
      const auto tag = take(1);
      if (tag == 0) return;
      const std::string name = text(), inner = path + "/" + name;
      if (tag == 2) {
        numbers[inner] = static_cast<std::int64_t>(take(2));
      } else if (tag == 3) {
        numbers[inner] = static_cast<std::int64_t>(take(4));
      } else if (tag == 7) {
        const std::size_t length = take(4);
        arrays[inner] = bytes_.substr(at_, length);
        at_ += length;
      } else if (tag == 11) {
        for (std::uint64_t n = take(4); n > 0; --n) take(4);
      } else if (tag == 9) {
        take(1);
        ASSERT_EQ(take(4), 0u) << "only empty lists are expected";
      } else if (tag == 10) {
        compound(inner);
      } else {
        FAIL() << "tag " << tag;
      }
    }
  }
  std::string bytes_;
  std::size_t at_ = 0;
};

std::string unzipped(const std::string& path) {
  const gzFile file = gzopen(path.c_str(), "rb");
  std::string result(1 << 24, '\0');
  const int size = gzread(file, result.data(), static_cast<unsigned>(result.size()));
  EXPECT_EQ(gzclose(file), Z_OK) << "checksum or length";
  EXPECT_GE(size, 0);
  result.resize(static_cast<std::size_t>(std::max(size, 0)));
  return result;
}

/// The block at (x, y, z) of Minecraft's axes.
std::string block_at(const Nbt& nbt, int x, int y, int z) {
  const auto width = nbt.numbers.at("Schematic/Width"), length = nbt.numbers.at("Schematic/Length");
  const auto index = static_cast<std::size_t>((y * length + z) * width + x);
  const int block = static_cast<unsigned char>(nbt.arrays.at("Schematic/BlockData").at(index));
  for (const auto& [name, value] : nbt.numbers) {
    if (name.starts_with("Schematic/Palette/") && value == block) return name.substr(18);
  }
  return "?";
}

TEST(Schem, HasZUpAndTheBlocksOfTheColours) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.schem");
  const auto label = [](int i, int j, int k) {
    if (i == 0 && j == 0 && k == 0) return packed(142, 30, 33);    // red concrete
    if (i == 69 && j == 0 && k == 0) return packed(46, 47, 140);   // blue concrete
    if (i == 0 && j == 65 && k == 0) return packed(248, 200, 40);  // yellow wool
    if (i == 0 && j == 0 && k == 66) return packed(9, 9, 14);      // black concrete
    return 0u;
  };
  write(labelled(make_grid({70, 66, 67}), Axis::kZ, label), path, colours());
  const Nbt nbt(unzipped(path));
  EXPECT_EQ(nbt.numbers.at("Schematic/Version"), 2);
  EXPECT_EQ(nbt.numbers.at("Schematic/Width"), 70);
  EXPECT_EQ(nbt.numbers.at("Schematic/Height"), 67);
  EXPECT_EQ(nbt.numbers.at("Schematic/Length"), 66);
  const std::string& data = nbt.arrays.at("Schematic/BlockData");
  ASSERT_EQ(data.size(), 70u * 66 * 67);
  EXPECT_EQ(block_at(nbt, 0, 0, 65), "minecraft:red_concrete");
  EXPECT_EQ(block_at(nbt, 69, 0, 65), "minecraft:blue_concrete");
  EXPECT_EQ(block_at(nbt, 0, 0, 0), "minecraft:yellow_wool");
  EXPECT_EQ(block_at(nbt, 0, 66, 65), "minecraft:black_concrete");
  EXPECT_EQ(block_at(nbt, 1, 1, 1), "minecraft:air");
  EXPECT_EQ(std::count(data.begin(), data.end(), '\0'), 70 * 66 * 67 - 4);
  std::int64_t most = 0;
  for (const auto& [name, value] : nbt.numbers) {
    if (name.starts_with("Schematic/Palette/")) most = std::max(most, value);
  }
  EXPECT_EQ(nbt.numbers.at("Schematic/PaletteMax"), most + 1);
  EXPECT_LT(most, 128) << "indices are one byte each";
}

TEST(Schem, WithoutColoursIsOfStone) {
  const TemporaryFolder folder;
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const std::string path = folder.file(sample.name + ".schem");
    write(intervals_of(sample, Axis::kX), path);
    const Nbt nbt(unzipped(path));
    const std::string& data = nbt.arrays.at("Schematic/BlockData");
    const glm::ivec3 d = sample.grid.dims;
    ASSERT_EQ(data.size(), static_cast<std::size_t>(d.x * d.y * d.z));
    int wrong = 0;
    for (int k = 0; k < d.z; ++k) {
      for (int j = 0; j < d.y; ++j) {
        for (int i = 0; i < d.x; ++i) {
          const auto index = static_cast<std::size_t>((k * d.y + d.y - 1 - j) * d.x + i);
          wrong += (data[index] != 0) != sample.solid(i, j, k);
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }
}

/// The palette of a .vox file, and the colour of each voxel of a file of one model.
struct VoxColours {
  std::set<std::uint32_t> used;
  std::map<std::tuple<int, int, int>, std::uint32_t> voxels;
};
VoxColours vox_colours(const std::string& path) {
  const std::string file = bytes_of(path);
  VoxColours result;
  const std::size_t palette = file.find("RGBA") + 12, voxels = file.find("XYZI") + 12;
  std::uint32_t count;
  std::memcpy(&count, file.data() + voxels, 4);
  for (std::size_t i = 0; i < count; ++i) {
    unsigned char v[4];
    std::memcpy(v, file.data() + voxels + 4 + 4 * i, 4);
    std::uint32_t colour;
    std::memcpy(&colour, file.data() + palette + 4 * (v[3] - std::size_t{1}), 4);
    EXPECT_NE(v[3], 0);
    result.voxels[{v[0], v[1], v[2]}] = colour;
    result.used.insert(colour);
  }
  return result;
}

TEST(VoxPalette, OfUpTo255ColoursIsExact) {
  const TemporaryFolder folder;
  const auto label = [](int i, int j, int k) {
    return k == 3 && i < 15 ? packed(17 * i, 15 * j, 9, 1 + i) : 0u;  // 255
  };
  write(labelled(make_grid({70, 17, 5}), Axis::kZ, label), folder.file("a.vox"), colours());
  const VoxColours found = vox_colours(folder.file("a.vox"));
  EXPECT_EQ(found.used.size(), 255u);
  for (const auto& [at, colour] : found.voxels) {
    const auto [i, j, k] = at;
    ASSERT_EQ(colour, label(i, j, k));
  }
}

TEST(VoxPalette, IsCommonToAllPieces) {
  const TemporaryFolder folder;
  const auto label = [](int i, int, int) { return packed(i / 1792 * 200, 10, 5); };
  write(labelled(make_grid({2001, 1, 1}), Axis::kZ, label), folder.file("a.vox"), colours());
  const auto palette = [&](const char* name) {
    const std::string file = bytes_of(folder.file(name));
    return file.substr(file.find("RGBA"), 1036);
  };
  EXPECT_EQ(palette("a_0_0_0.vox"), palette("a_1_0_0.vox"));
  EXPECT_EQ(vox_colours(folder.file("a_0_0_0.vox")).used, std::set{packed(0, 10, 5)});
  EXPECT_EQ(vox_colours(folder.file("a_1_0_0.vox")).used, std::set{packed(200, 10, 5)});
}

TEST(VoxPalette, OfManyColoursIsNear) {
  const TemporaryFolder folder;
  const auto label = [](int i, int j, int k) {
    return k == 0 ? packed(2 * i, 2 * j, (i * j / 64) & 255) : 0u;
  };
  const VoxelIntervals set = labelled(make_grid({128, 128, 2}), Axis::kZ, label);
  write(set, folder.file("a.vox"), colours());
  const VoxColours found = vox_colours(folder.file("a.vox"));
  EXPECT_GT(found.used.size(), 200u);
  EXPECT_LE(found.used.size(), 255u);
  double sum = 0, most = 0;
  for (const auto& [at, colour] : found.voxels) {
    const auto [i, j, k] = at;
    const std::uint32_t wanted = label(i, j, k);
    double far = 0;
    for (int c = 0; c < 24; c += 8) {
      const double away = static_cast<double>(colour >> c & 255) - (wanted >> c & 255);
      far += away * away;
    }
    sum += std::sqrt(far);
    most = std::max(most, std::sqrt(far));
  }
  // A surface in the cube: 255 cells of it are some 16 wide.
  EXPECT_LT(sum / 16384, 12.0);
  EXPECT_LT(most, 60.0);
}

TEST(ColourCounts, DoNotDependOnTheOrder) {
  ColourCounts a, b, both;
  for (int i = 0; i < 3000; ++i) {
    std::uint32_t colour = packed(i * 7 % 256, i * 13 % 256, i * 31 % 256);
    if (i % 5 == 0) colour = (colour & 0xffffffu) | 0x40000000u;
    const Interval run{7, static_cast<std::uint16_t>(7 + i)};
    both.add({&colour, 1}, {&run, 1});
    (i % 3 == 0 ? a : b).add({&colour, 1}, {&run, 1});
  }
  b.add(std::move(a));
  Execution two;
  two.threads = 2;
  const Palette one = both.palette(255, {}), other = b.palette(255, two);
  EXPECT_EQ(one.colours(), other.colours());
  for (int i = 0; i < 3000; ++i) {
    const std::uint32_t colour = packed(i * 7 % 256, i * 13 % 256, i * 31 % 256);
    ASSERT_EQ(one.index_of(colour), other.index_of(colour));
  }
}

}  // namespace
}  // namespace strata::testing
