// An .sl1, as PrusaSlicer 2.5 makes it for resin printers: a ZIP of a grey picture a layer,
// NAME00000.png and so on, of config.ini, which the printer reads, and of prusaslicer.ini, by which
// PrusaSlicer reads the pictures back. Pictures are stored, not deflated again.

#include <fmt/chrono.h>
#include <zlib.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <map>
#include <memory>
#include <utility>

#include "voxelize/layers/layer_pictures.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"
#include "voxelize/output/zip_records.h"

namespace strata {
namespace {

// PrusaSlicer's defaults: layers at the first exposure, from that to the others, seconds for the
// tilt after a layer that covers less than half of the display, or more.
constexpr int kFirstLayers = 3, kFadedLayers = 10;
constexpr double kFastTilt = 5, kSlowTilt = 8;

using Settings = std::map<std::string, std::string>;  // in the order of their names

std::string text_of(const Settings& settings) {
  std::string text;
  for (const auto& [name, value] : settings) text += name + " = " + value + "\n";
  return text;
}

std::string number(double value) { return fmt::format("{:.9g}", value); }

double exposures(int layers, const LayerOptions& options) {
  double sum = 0, fading = options.first_exposure;
  const double step = (options.first_exposure - options.exposure) / (kFadedLayers + 1);
  for (int layer = 0; layer < layers; ++layer) {
    if (layer >= kFirstLayers) {
      fading = layer < kFirstLayers + kFadedLayers ? fading - step : options.exposure;
    }
    sum += fading;
  }
  return sum;
}

VoxelWriterOptions greys(VoxelWriterOptions options) {
  if (options.fog == 0) options.fog = 1;  // slabs without labels are full
  return options;
}

class Sl1Writer final : public SlabWriter {
 public:
  Sl1Writer(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
            BlockOutput output)
      : SlabWriter(path, grid, Axis::kX),
        options_(greys(options)),
        pictures_(grid, options_),
        output_(std::move(output)),
        name_(path == "-" ? "strata" : std::filesystem::path(path).stem().string()) {}

 private:
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    const auto layers = static_cast<std::size_t>(slab.v_end() - slab.v_begin());
    const std::size_t before = entries_.size();
    entries_.resize(before + layers);
    std::vector<std::uint64_t> sums(layers);
    scratch_.resize(std::max(scratch_.size(), static_cast<std::size_t>(execution.thread_count())));
    std::uint64_t offset = output_.position();
    Result<void> written =
        output_.append_blocks(execution, layers, [&](std::size_t index, Bytes& out, int worker) {
          Bytes& picture = scratch_[static_cast<std::size_t>(worker)];
          const int layer = slab.v_begin() + static_cast<int>(index);
          sums[index] = pictures_.make(slab, layer, picture);
          ZipEntry& entry = entries_[before + index];
          const std::string head = describe(entry, fmt::format("{}{:05d}.png", name_, layer),
                                            picture.data(), picture.size());
          out.resize(head.size());
          std::copy_n(reinterpret_cast<const std::byte*>(head.data()), head.size(), out.data());
          out.insert(out.end(), picture.begin(), picture.end());
        });
    for (std::size_t index = before; index < entries_.size(); ++index) {
      ZipEntry& entry = entries_[index];
      entry.offset = offset;
      offset += entry.local_head().size() + entry.bytes;
    }
    const double pixels = static_cast<double>(pictures_.size().x) * pictures_.size().y;
    for (const std::uint64_t sum : sums) {
      const double filled = static_cast<double>(sum) / options_.fog;
      filled_ += filled;
      if (filled > pixels / 2) ++slow_;
    }
    return written;
  }

  /// Fills a stored entry in. @return its local head
  static std::string describe(ZipEntry& entry, std::string name, const void* data,
                              std::size_t bytes) {
    entry.name = std::move(name);
    entry.bytes = entry.compressed = bytes;
    entry.crc = static_cast<std::uint32_t>(crc32_z(0, static_cast<const Bytef*>(data), bytes));
    return entry.local_head();
  }

  Result<void> append_text(const char* name, const Settings& settings) {
    const std::string text = text_of(settings);
    ZipEntry& entry = entries_.emplace_back();
    entry.offset = output_.position();
    const std::string head = describe(entry, name, text.data(), text.size());
    return output_.append(head + text);
  }

  Result<void> finish_output(const Execution&) override {
    if (auto written = append_text("config.ini", for_printer()); !written) return written;
    if (auto written = append_text("prusaslicer.ini", for_slicer()); !written) return written;
    const std::string directory = zip_directory(entries_, output_.position());
    if (auto written = output_.append(directory); !written) return written;
    return output_.commit();
  }

  [[nodiscard]] Settings for_printer() const {
    const LayerOptions& layers = options_.layers;
    const int count = dims().z;
    const glm::dvec3 size = grid().voxel_size;
    const double tilts = kFastTilt * (count - slow_) + kSlowTilt * slow_;
    return {{"action", "print"},
            {"expTime", number(layers.exposure)},
            {"expTimeFirst", number(layers.first_exposure)},
            {"expUserProfile", "0"},
            {"fileCreationTimestamp",
             fmt::format("{:%Y-%m-%d at %H:%M:%S UTC}", fmt::gmtime(std::time_t{layers.time}))},
            {"hollow", "0"},
            {"jobDir", name_},
            {"layerHeight", number(size.z)},
            {"materialName", ""},
            {"numFade", std::to_string(kFadedLayers)},
            {"numFast", std::to_string(count - slow_)},
            {"numSlow", std::to_string(slow_)},
            {"printProfile", ""},
            {"printTime", fmt::format("{:.6f}", exposures(count, layers) + tilts)},
            {"printerModel", ""},
            {"printerProfile", ""},
            {"printerVariant", ""},
            {"prusaSlicerVersion", "Strata"},
            {"usedMaterial",  // millilitres
             fmt::format("{:.6f}", filled_ * size.x * size.y * size.z / 1000)}};
  }

  [[nodiscard]] Settings for_slicer() const {
    const LayerOptions& layers = options_.layers;
    const glm::ivec2 pixels = pictures_.size();
    const glm::dvec3 size = grid().voxel_size;
    return {{"display_height", number(pixels.y * size.y)},
            {"display_mirror_x", layers.mirror_left_right ? "1" : "0"},
            {"display_mirror_y", layers.mirror_up_down ? "1" : "0"},
            {"display_orientation", "landscape"},
            {"display_pixels_x", std::to_string(pixels.x)},
            {"display_pixels_y", std::to_string(pixels.y)},
            {"display_width", number(pixels.x * size.x)},
            {"exposure_time", number(layers.exposure)},
            {"faded_layers", std::to_string(kFadedLayers)},
            {"fast_tilt_time", number(kFastTilt)},
            {"gamma_correction", number(layers.gamma)},
            {"initial_exposure_time", number(layers.first_exposure)},
            {"initial_layer_height", number(size.z)},
            {"layer_height", number(size.z)},
            {"printer_technology", "SLA"},
            {"slow_tilt_time", number(kSlowTilt)}};
  }

  VoxelWriterOptions options_;
  LayerPictures pictures_;
  BlockOutput output_;
  std::string name_;
  std::vector<ZipEntry> entries_;
  std::vector<Bytes> scratch_;  // by worker
  double filled_ = 0;           // voxels
  int slow_ = 0;                // layers that cover more than half of the display
};

}  // namespace

VoxelWriterResult open_sl1_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options) {
  const glm::ivec2 display = options.layers.display;
  if (display.x > 0 && (grid.dims.x > display.x || grid.dims.y > display.y)) {
    return fail(ErrorCode::kUsage, "{}: layers of {} x {} pixels do not fit a display of {} x {}",
                path, grid.dims.x, grid.dims.y, display.x, display.y);
  }
  Result<BlockOutput> output = BlockOutput::create(path);
  if (!output) return tl::unexpected(output.error());
  return std::make_unique<Sl1Writer>(path, grid, options, std::move(*output));
}

}  // namespace strata
