// Layers as pictures: PNG slices of any axis, mirrored or not, and .sl1. Pictures are decoded by
// libpng, archives and settings by hand.

#include <gtest/gtest.h>
#include <png.h>
#include <zlib.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "strata/voxelize/formats/voxel_writer.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

constexpr std::uint32_t kFull = 1000;

struct Picture {
  int width = 0, height = 0;
  std::vector<png_byte> grey;
  [[nodiscard]] int at(int column, int row) const {
    return grey[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                static_cast<std::size_t>(column)];
  }
};

/// @param bits that its head must say
Picture decoded(const std::string& file, int bits = 8) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&image, file.data(), file.size()), 0) << image.message;
  image.format = PNG_FORMAT_GRAY;
  Picture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  picture.grey.resize(PNG_IMAGE_SIZE(image));
  EXPECT_NE(png_image_finish_read(&image, nullptr, picture.grey.data(), 0, nullptr), 0);
  EXPECT_EQ(file[24], bits);
  EXPECT_EQ(file[25], 0) << "grey";
  return picture;
}

/// The files of an archive whose members are stored, by its directory.
std::map<std::string, std::string> unzipped(const std::string& zip) {
  const auto number = [&](std::size_t at, int bytes) {
    std::size_t value = 0;
    for (int i = bytes - 1; i >= 0; --i) {
      value = value << 8 | static_cast<unsigned char>(zip.at(at + static_cast<std::size_t>(i)));
    }
    return value;
  };
  const std::size_t end = zip.size() - 22;
  EXPECT_EQ(zip.substr(end, 4), std::string("PK\5\6", 4));
  std::size_t at = number(end + 16, 4);
  EXPECT_EQ(at + number(end + 12, 4), end);
  std::map<std::string, std::string> files;
  for (std::size_t left = number(end + 10, 2); left > 0; --left) {
    EXPECT_EQ(zip.substr(at, 4), std::string("PK\1\2", 4));
    EXPECT_EQ(number(at + 10, 2), 0u) << "stored";
    const std::size_t bytes = number(at + 20, 4), name = number(at + 28, 2);
    const std::size_t head = number(at + 42, 4);
    EXPECT_EQ(zip.substr(head, 4), std::string("PK\3\4", 4));
    const std::string data =
        zip.substr(head + 30 + number(head + 26, 2) + number(head + 28, 2), bytes);
    EXPECT_EQ(number(at + 16, 4), crc32(0, reinterpret_cast<const Bytef*>(data.data()),
                                        static_cast<uInt>(data.size())));
    files[zip.substr(at + 46, name)] = data;
    at += 46 + name + number(at + 30, 2) + number(at + 32, 2);
  }
  return files;
}

std::map<std::string, std::string> settings_of(const std::string& ini) {
  std::map<std::string, std::string> result;
  for (std::size_t at = 0; at < ini.size();) {
    const std::size_t line = ini.find('\n', at), equals = ini.find(" = ", at);
    result[ini.substr(at, equals - at)] = ini.substr(equals + 3, line - equals - 3);
    at = line + 1;
  }
  return result;
}

/// Different along every axis, with greys everywhere.
std::uint32_t label_of(int i, int j, int k) {
  if (i == 0 && j == 0) return kFull;
  if (!random_voxel(i / 3, j / 2, k / 2, 500)) return 0;
  return 1 + static_cast<std::uint32_t>(i * 37 + j * 101 + k * 211) % kFull;
}

VoxelWriterOptions greys() {
  VoxelWriterOptions options;
  options.fog = kFull;
  return options;
}

int grey_of(std::uint32_t label) {
  return static_cast<int>(std::floor(255.0 * label / kFull + 0.5));
}

const VoxelGrid kLayerGrid = make_grid({21, 70, 66}, {1, 2, 3}, {0.05, 0.06, 0.1});

std::string write_set(const TemporaryFolder& folder, const std::string& name,
                      const VoxelWriterOptions& options, Axis axis = Axis::kX, int tiles = 1,
                      int threads = 2) {
  const VoxelIntervals set = labelled(kLayerGrid, axis, label_of);
  const std::string path = folder.file(name);
  auto writer = open_voxel_writer(path, name.ends_with(".sl1") ? "" : "png", set.grid(), options);
  EXPECT_TRUE(writer) << writer.error().message;
  Execution execution;
  execution.threads = threads;
  for (const VoxelIntervals& slab : cut(set, tiles)) {
    EXPECT_TRUE((*writer)->add(slab, execution));
  }
  EXPECT_TRUE((*writer)->finish(execution));
  return path;
}

std::string slice(const std::string& folder, int layer) {
  return testkit::bytes_of(folder + fmt::format("/slice_{:05d}.png", layer));
}

TEST(Slices, OfEveryAxisAndMirrorShowWhatTheirDescriptionSays) {
  const TemporaryFolder folder;
  for (int axis = 0; axis < 3; ++axis) {
    for (int flip = 0; flip < 4; ++flip) {
      VoxelWriterOptions options = greys();
      options.layers.axis = static_cast<Axis>(axis);
      options.layers.mirror_left_right = (flip & 1) != 0;
      options.layers.mirror_up_down = (flip & 2) != 0;
      const std::string path = write_set(folder, fmt::format("{}{}", axis, flip), options,
                                         axis == 0 ? Axis::kY : Axis::kX);
      const int across = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
      const std::string json = testkit::bytes_of(path + "/slices.json");
      const auto says = [&](const std::string& text) {
        EXPECT_NE(json.find(text), std::string::npos) << text << "\n" << json;
      };
      says(fmt::format("\"slice_axis\": \"{}\"", "xyz"[axis]));
      says(fmt::format("\"column_axis\": \"{}\"", "xyz"[across]));
      says(fmt::format("\"row_axis\": \"{}\"", "xyz"[up]));
      says(fmt::format("\"column_order\": \"{}\"", flip & 1 ? "descending" : "ascending"));
      says(fmt::format("\"row_order\": \"{}\"", flip & 2 ? "ascending" : "descending"));
      const glm::ivec3 dims = kLayerGrid.dims;
      int wrong = 0, soft = 0;
      for (int layer = 0; layer < dims[axis]; ++layer) {
        const Picture picture = decoded(slice(path, layer));
        ASSERT_EQ(picture.width, dims[across]);
        ASSERT_EQ(picture.height, dims[up]);
        for (int row = 0; row < picture.height; ++row) {
          for (int column = 0; column < picture.width; ++column) {
            glm::ivec3 voxel(0);
            voxel[axis] = layer;
            voxel[across] = flip & 1 ? picture.width - 1 - column : column;
            voxel[up] = flip & 2 ? row : picture.height - 1 - row;
            const int expected = grey_of(label_of(voxel.x, voxel.y, voxel.z));
            wrong += picture.at(column, row) != expected ? 1 : 0;
            soft += expected > 0 && expected < 255 ? 1 : 0;
          }
        }
      }
      EXPECT_EQ(wrong, 0);
      EXPECT_GT(soft, 10000);
    }
  }
}

TEST(Slices, OfBitsAndIdsAreMirroredToo) {
  const TemporaryFolder folder;
  VoxelWriterOptions plain, ids;
  ids.ids = kFull;
  for (VoxelWriterOptions* options : {&plain, &ids}) {
    const std::string upright = write_set(folder, "upright", *options);
    options->layers.mirror_left_right = true;
    const std::string mirrored = write_set(folder, "mirrored", *options);
    const int bits = options == &plain ? 1 : 16;
    int differ = 0;
    for (int layer = 0; layer < kLayerGrid.dims.z; ++layer) {
      const Picture a = decoded(slice(upright, layer), bits);
      const Picture b = decoded(slice(mirrored, layer), bits);
      for (int row = 0; row < a.height; ++row) {
        for (int column = 0; column < a.width; ++column) {
          ASSERT_EQ(a.at(column, row), b.at(a.width - 1 - column, row));
          differ += a.at(column, row) != b.at(column, row) ? 1 : 0;
        }
      }
    }
    EXPECT_GT(differ, 1000);
    std::filesystem::remove_all(upright);
    std::filesystem::remove_all(mirrored);
  }
}

TEST(Slices, HaveTheGreysOfTheirGamma) {
  const TemporaryFolder folder;
  for (const double gamma : {0.0, 0.5, 1.0, 2.2}) {
    VoxelWriterOptions options = greys();
    options.layers.gamma = gamma;
    const std::string path = write_set(folder, fmt::format("gamma{}", gamma), options);
    for (int layer = 0; layer < kLayerGrid.dims.z; layer += 5) {
      const Picture picture = decoded(slice(path, layer));
      for (int row = 0; row < picture.height; ++row) {
        for (int column = 0; column < picture.width; ++column) {
          const std::uint32_t label = label_of(column, picture.height - 1 - row, layer);
          const double share = label / static_cast<double>(kFull);
          const double grey = gamma == 0 ? (share >= 0.5 ? 255 : 0) : 255 * std::pow(share, gamma);
          ASSERT_NEAR(picture.at(column, row), label == 0 ? 0 : grey, 0.5 + 1e-9) << label;
        }
      }
    }
  }
}

TEST(Sl1, HasAPictureALayerInTheMiddleOfTheDisplayAndBothSettings) {
  const TemporaryFolder folder;
  VoxelWriterOptions options = greys();
  options.layers.display = {100, 131};
  options.layers.exposure = 7.5;
  options.layers.first_exposure = 35;
  options.layers.time = 86400;
  const auto files = unzipped(testkit::bytes_of(write_set(folder, "my part.sl1", options)));
  ASSERT_EQ(files.size(), 68u);
  double filled = 0;
  int wrong = 0;
  for (int layer = 0; layer < 66; ++layer) {
    const Picture picture = decoded(files.at(fmt::format("my part{:05d}.png", layer)));
    ASSERT_EQ(picture.width, 100);
    ASSERT_EQ(picture.height, 131);
    for (int row = 0; row < 131; ++row) {
      for (int column = 0; column < 100; ++column) {
        const int i = column - 39, j = 69 - (row - 30);
        const bool there = i >= 0 && i < 21 && j >= 0 && j < 70;
        const std::uint32_t label = there ? label_of(i, j, layer) : 0;
        wrong += picture.at(column, row) != grey_of(label) ? 1 : 0;
        filled += label / static_cast<double>(kFull);
      }
    }
  }
  EXPECT_EQ(wrong, 0);
  const auto config = settings_of(files.at("config.ini"));
  EXPECT_EQ(config.at("action"), "print");
  EXPECT_EQ(config.at("jobDir"), "my part");
  EXPECT_EQ(config.at("expTime"), "7.5");
  EXPECT_EQ(config.at("expTimeFirst"), "35");
  EXPECT_EQ(config.at("layerHeight"), "0.1");
  EXPECT_EQ(config.at("numFast"), "66");
  EXPECT_EQ(config.at("numSlow"), "0");
  EXPECT_EQ(config.at("fileCreationTimestamp"), "1970-01-02 at 00:00:00 UTC");
  EXPECT_NEAR(std::stod(config.at("usedMaterial")), filled * 0.05 * 0.06 * 0.1 / 1000, 1e-6);
  // Three layers, ten that fade, the others; and a fast tilt each.
  double time = 3 * 35.0 + 53 * 7.5 + 66 * 5;
  for (int i = 1; i <= 10; ++i) time += 35 - i * 27.5 / 11;
  EXPECT_NEAR(std::stod(config.at("printTime")), time, 1e-5);
  const auto slicer = settings_of(files.at("prusaslicer.ini"));
  EXPECT_EQ(slicer.at("display_pixels_x"), "100");
  EXPECT_EQ(slicer.at("display_pixels_y"), "131");
  EXPECT_EQ(slicer.at("display_width"), "5");
  EXPECT_EQ(slicer.at("display_height"), "7.86");
  EXPECT_EQ(slicer.at("display_mirror_x"), "0");
  EXPECT_EQ(slicer.at("display_orientation"), "landscape");
  EXPECT_EQ(slicer.at("layer_height"), "0.1");
  EXPECT_EQ(slicer.at("printer_technology"), "SLA");
}

TEST(Sl1, MirrorsTheWholeDisplay) {
  const TemporaryFolder folder;
  VoxelWriterOptions options = greys();
  options.layers.display = {90, 75};
  const auto upright = unzipped(testkit::bytes_of(write_set(folder, "a.sl1", options)));
  options.layers.mirror_left_right = options.layers.mirror_up_down = true;
  const auto turned = unzipped(testkit::bytes_of(write_set(folder, "b.sl1", options)));
  for (int layer = 0; layer < 66; layer += 13) {
    const Picture a = decoded(upright.at(fmt::format("a{:05d}.png", layer)));
    const Picture b = decoded(turned.at(fmt::format("b{:05d}.png", layer)));
    for (int row = 0; row < 75; ++row) {
      for (int column = 0; column < 90; ++column) {
        ASSERT_EQ(a.at(column, row), b.at(89 - column, 74 - row));
      }
    }
  }
  EXPECT_EQ(settings_of(turned.at("prusaslicer.ini")).at("display_mirror_x"), "1");
  EXPECT_EQ(settings_of(turned.at("prusaslicer.ini")).at("display_mirror_y"), "1");
}

TEST(Sl1, BytesDoNotDependOnThreadsSlabsOrAxis) {
  const TemporaryFolder folder, other, third, fourth;
  const std::string expected =
      testkit::bytes_of(write_set(folder, "a.sl1", greys(), Axis::kX, 2, 1));
  EXPECT_EQ(testkit::bytes_of(write_set(other, "a.sl1", greys(), Axis::kX, 1, 1)), expected);
  EXPECT_EQ(testkit::bytes_of(write_set(third, "a.sl1", greys(), Axis::kX, 1, 7)), expected);
  EXPECT_EQ(testkit::bytes_of(write_set(fourth, "a.sl1", greys(), Axis::kZ, 1, 3)), expected);
}

TEST(Sl1, RefusesADisplayThatIsTooSmall) {
  const TemporaryFolder folder;
  VoxelWriterOptions options = greys();
  options.layers.display = {20, 70};
  const auto writer = open_voxel_writer(folder.file("a.sl1"), "", kLayerGrid, options);
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::kUsage);
  EXPECT_NE(writer.error().message.find("21 x 70"), std::string::npos) << writer.error().message;
  EXPECT_TRUE(folder.is_empty());
}

}  // namespace
}  // namespace strata::testing
