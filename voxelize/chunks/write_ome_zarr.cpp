// OME-Zarr 0.4 (ngff.openmicroscopy.org/0.4): a Zarr 2 group with the arrays 0, 1, ..., each of
// half the resolution of the one before it, axes z, y, x (of colours c, z, y, x), C order, and
// multiscales, which say scale and translation: where the centre of the first voxel lies. The
// format has no place for a direction; an attribute of our own, "direction", says it.

#include <fmt/core.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "voxelize/chunks/half_resolution.h"
#include "voxelize/chunks/zarr_chunks.h"
#include "voxelize/output/folder_output.h"
#include "voxelize/output/grid_text.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

/// The format's word for a unit of length; empty if it has none.
std::string_view ome_unit(double metres) {
  const std::string_view unit = unit_name(metres);
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"mm", "millimeter"}, {"m", "meter"}, {"cm", "centimeter"}, {"um", "micrometer"},
      {"in", "inch"},       {"ft", "foot"}, {"nm", "nanometer"}};
  for (const auto& [name, word] : kWords) {
    if (name == unit) return word;
  }
  return {};
}

std::string json_text(const std::string& text) {
  std::string escaped;
  for (const char letter : one_line(text)) {
    if (letter == '"' || letter == '\\') escaped += '\\';
    escaped += letter;
  }
  return escaped;
}

class OmeZarrWriter final : public SlabWriter {
 public:
  OmeZarrWriter(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
                FolderOutput folder)
      : SlabWriter(path, grid, Axis::kX, false, options.part.has_value()),
        options_(options),
        folder_(std::move(folder)) {
    levels_.push_back({grid, DenseValues(options)});
    VoxelWriterOptions coarse = options;
    for (int level = 1; level < options.levels; ++level) {
      const VoxelGrid before = levels_.back().grid;
      const bool full = coarse.fog > 0xffffffffu / 8;
      if (before.dims == glm::ivec3(1) || full) break;
      coarse.fog *= 8;
      levels_.push_back({HalfResolution::grid_of(before), DenseValues(coarse)});
    }
  }

  Result<void> begin() {
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      const int layers = (levels_[level].grid.dims.z + ZarrChunks::kSide - 1) / ZarrChunks::kSide;
      if (auto made = make_folders(level, 0, options_.part ? 0 : layers); !made) return made;
      levels_[level].chunks.emplace(
          levels_[level].values, ZarrChunks::Order::kZyx,
          [level, colours = colours()](const glm::ivec3& chunk, std::size_t plane) {
            return fmt::format("{}/{}{}/{}/{}", level, colours ? fmt::format("{}/", plane) : "",
                               chunk.z, chunk.y, chunk.x);
          });
    }
    if (levels_.size() > 1) half_.emplace(grid(), rule(), full_label(options_.fog));
    return {};
  }

 private:
  struct Level {
    VoxelGrid grid;
    DenseValues values;
    std::optional<ZarrChunks> chunks{};
  };

  [[nodiscard]] bool colours() const { return options_.rgba; }
  [[nodiscard]] HalfRule rule() const {
    if (options_.fog != 0) return HalfRule::kSum;
    return options_.ids != 0 || colours() ? HalfRule::kMost : HalfRule::kAny;
  }
  [[nodiscard]] std::uint32_t full_label(std::uint32_t fog) const {
    return fog != 0 ? fog : colours() ? 0xffffffff : 1;
  }

  /// All folders of layers of chunks, whether or not there will be a chunk.
  Result<void> make_folders(std::size_t level, int z_begin, int z_end) {
    const glm::ivec3 chunks =
        (levels_[level].grid.dims + ZarrChunks::kSide - 1) / ZarrChunks::kSide;
    std::vector<std::string> folders = {std::to_string(level)};
    for (std::size_t plane = 0; plane < (colours() ? 4 : 1); ++plane) {
      std::string at = std::to_string(level);
      if (colours()) folders.push_back(at += fmt::format("/{}", plane));
      for (int z = z_begin; z < z_end; ++z) {
        folders.push_back(fmt::format("{}/{}", at, z));
        for (int y = 0; y < chunks.y; ++y) folders.push_back(fmt::format("{}/{}/{}", at, z, y));
      }
    }
    for (const std::string& folder : folders) {
      if (auto made = folder_.make_folder(folder); !made) return made;
    }
    return {};
  }

  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override {
    if (half_) half_->add(slab);
    if (options_.part) {
      const int first = slab.v_begin() / ZarrChunks::kSide;
      if (auto made = make_folders(0, first, first + slab.tiles_v()); !made) return made;
    }
    return levels_[0].chunks->write(slab, folder_, execution);
  }

  Result<void> finish_output(const Execution& execution) override {
    if (options_.part && !options_.part->head) return folder_.commit();
    std::uint32_t fog = options_.fog;
    for (std::size_t level = 1; level < levels_.size(); ++level) {
      auto written = levels_[level].chunks->write(half_->set(), folder_, execution);
      if (!written) return written;
      if (level + 1 == levels_.size()) break;
      fog *= 8;
      HalfResolution next(levels_[level].grid, rule(), full_label(fog));
      next.add(half_->set());
      half_ = std::move(next);
    }
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      const std::string text = array_text(levels_[level]);
      auto written = folder_.write(fmt::format("{}/.zarray", level), text.data(), text.size());
      if (!written) return written;
    }
    const std::string group = "{\n  \"zarr_format\": 2\n}\n", attributes = attributes_text();
    for (const auto& [name, text] : {std::pair{".zgroup", &group}, {".zattrs", &attributes}}) {
      if (auto written = folder_.write(name, text->data(), text->size()); !written) return written;
    }
    return folder_.commit();
  }

  [[nodiscard]] static std::string array_text(const Level& level) {
    const DenseValues& values = level.values;
    const bool colours = values.components == 4;
    return fmt::format(
        "{{\n  \"chunks\": [{0}{1}, {1}, {1}],\n"
        "  \"compressor\": {{\"id\": \"zlib\", \"level\": 1}},\n"
        "  \"dimension_separator\": \"/\",\n  \"dtype\": \"{2}\",\n  \"fill_value\": 0,\n"
        "  \"filters\": null,\n  \"order\": \"C\",\n  \"shape\": [{3}{4}, {5}, {6}],\n"
        "  \"zarr_format\": 2\n}}\n",
        colours ? "1, " : "", ZarrChunks::kSide, values.numpy_type(), colours ? "4, " : "",
        level.grid.dims.z, level.grid.dims.y, level.grid.dims.x);
  }

  [[nodiscard]] std::string attributes_text() const {
    const std::string_view word = ome_unit(options_.frame.unit_metres);
    const std::string unit = word.empty() ? "" : fmt::format(", \"unit\": \"{}\"", word);
    std::string axes = colours() ? "{\"name\": \"c\", \"type\": \"channel\"}, " : "";
    for (const char axis : {'z', 'y', 'x'}) {
      axes += fmt::format("{{\"name\": \"{}\", \"type\": \"space\"{}}}{}", axis, unit,
                          axis == 'x' ? "" : ", ");
    }
    std::string sets;
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      const VoxelGrid& g = levels_[level].grid;
      const glm::dvec3 size = g.voxel_size, centre = g.origin + 0.5 * size;
      sets += fmt::format(
          "{}\n        {{\"path\": \"{}\", \"coordinateTransformations\": [\n"
          "          {{\"type\": \"scale\", \"scale\": [{}{}, {}, {}]}},\n"
          "          {{\"type\": \"translation\", \"translation\": [{}{}, {}, {}]}}]}}",
          level == 0 ? "" : ",", level, colours() ? "1, " : "", size.z, size.y, size.x,
          colours() ? "0, " : "", centre.z, centre.y, centre.x);
    }
    std::string turn;
    if (options_.frame.turned()) {
      const glm::dmat3& d = options_.frame.direction;
      turn = fmt::format("  \"direction\": [[{}, {}, {}], [{}, {}, {}], [{}, {}, {}]],\n", d[0][0],
                         d[1][0], d[2][0], d[0][1], d[1][1], d[2][1], d[0][2], d[1][2], d[2][2]);
    }
    return fmt::format(
        "{{\n{}  \"multiscales\": [\n    {{\"version\": \"0.4\", \"name\": \"{}\",\n"
        "      \"axes\": [{}],\n      \"datasets\": [{}]}}]\n}}\n",
        turn, json_text(options_.name), axes, sets);
  }

  VoxelWriterOptions options_;
  FolderOutput folder_;
  std::vector<Level> levels_;
  std::optional<HalfResolution> half_;
};

}  // namespace

VoxelWriterResult open_ome_zarr_writer(const std::string& path, const VoxelGrid& grid,
                                       const VoxelWriterOptions& options) {
  Result<FolderOutput> folder =
      options.part ? FolderOutput::join(options.part->folder) : FolderOutput::create(path);
  if (!folder) return tl::unexpected(folder.error());
  return begun(std::make_unique<OmeZarrWriter>(path, grid, options, std::move(*folder)));
}

}  // namespace strata
