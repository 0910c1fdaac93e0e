#include "apps/voxelize/voxelize_run.h"

#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <memory>
#include <utility>

#include "apps/commands/choice_words.h"
#include "apps/session/report.h"
#include "apps/strata/library_session.h"
#include "apps/voxelize/colouring.h"
#include "apps/voxelize/distance_surface.h"
#include "strata/csg/input/solid_input.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/solid_lists.h"
#include "strata/voxelize/area/boundary_area.h"
#include "strata/voxelize/checksum.h"
#include "strata/voxelize/distance/signed_distance.h"
#include "voxelize/open/lost_walls.h"

namespace strata::apps {
namespace {

/// Looks for walls that lie between voxel centres.
Result<void> find_walls(VoxelizeOutcome& outcome, const Execution& execution) {
  const csg::SolidInput& input = outcome.input;
  if (!input.closed) return {};
  LostWallOptions options;
  options.rule = input.rule;
  if (!input.has_scene()) options.longest_edge = input.longest_edge;
  if (input.tree) {
    options.filter = &input.tree->unlabelled_filter();
    options.taken_away = [&](std::uint32_t t) { return input.tree->is_subtracted(t); };
  }
  auto found = find_lost_walls(input.soup, outcome.grid, options, execution);
  if (!found) return tl::unexpected(found.error());
  outcome.lost_walls = *std::move(found);
  for (LostWall& wall : outcome.lost_walls.largest) {
    const Bounds box = outcome.frame.world_box({wall.low, wall.high});
    wall.low = box.low, wall.high = box.high;
  }
  return {};
}

/// Tells of walls that lie between voxel centres, or that nothing is solid.
void tell_thin(const VoxelizeCommand& command, const VoxelizeOutcome& outcome, Session& session) {
  const csg::SolidInput& input = outcome.input;
  const std::uint64_t solid = outcome.report.solid_voxels;
  const char* remedy = command.sdf   ? "; smaller voxels keep more of it"
                       : command.ids ? "; --surface, without --ids, keeps all of it"
                                     : "; --surface keeps all of it";
  const LostWalls& lost = outcome.lost_walls;
  if (lost.count > 0) {
    const LostWall& wall = lost.largest.front();
    session.warn(
        "thin",
        fmt::format("{} thinner than a voxel fell between voxel centres; {} {:.3g} voxels "
                    "thick along {}, from {} to {}; the solid holds {}{}",
                    counted(lost.count, "wall"), lost.count == 1 ? "it is" : "the largest is",
                    wall.thickness, word_of(kAxisWords, wall.axis), triple(wall.low),
                    triple(wall.high), counted(solid, "voxel"), remedy));
  } else if (solid == 0) {
    const char* why = !input.closed       ? ""
                      : input.has_scene() ? ": the scene's result is empty, or thinner than a voxel"
                                          : ": the mesh lies outside the grid, or is thinner than "
                                            "a voxel";
    session.warn("empty", fmt::format("no voxel is solid{}{}", why, remedy));
  }
}

void check_columns(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                   Session& session) {
  const VoxelizeReport& report = outcome.report;
  if (!command.solid) return;
  // Parity does not ask which way a closed mesh is crossed.
  const bool both_ways = outcome.input.closed && outcome.input.rule == InsideRule::kParity;
  if (report.unbalanced_columns > 0 && !both_ways) {
    session.warn("unbalanced-columns",
                 fmt::format("{} entered and left unequally often; {}",
                             report.unbalanced_columns == 1
                                 ? std::string("1 column is")
                                 : fmt::format("{} columns are", report.unbalanced_columns),
                             command.open == OpenMode::kVote
                                 ? "caps and winding numbers decided their voxels"
                                 : "their voxels may be wrong"));
  }
  if (report.negative_columns > 0 && outcome.input.closed &&
      outcome.input.rule == InsideRule::kWinding) {
    session.warn("negative-winding",
                 fmt::format("{} columns run through parts that are inside out, which are not "
                             "solid; --rule nonzero fills them",
                             report.negative_columns));
  }
}

std::optional<std::uint64_t> size_of_file(const std::string& path) {
  struct stat status {};
  if (path == "-" || stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(status.st_size);
}

/// Has the solids of a scene labelled, by number or by colour, when the format is to hold that.
void label_solids(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                  VoxelWriterOptions& options, Session& session) {
  if (!outcome.input.tree || command.colours) return;
  const csg::Tree& scene = *outcome.input.scene;
  if (command.ids) {
    // Solids that are taken away have numbers, too, but no voxel has them.
    const std::vector<std::uint32_t> added = csg::added_solids(scene, scene.root());
    options.ids = added.empty() ? 1 : *std::max_element(added.begin(), added.end()) + 1;
    outcome.id_voxels.resize(scene.solids().size(), 0);
    return outcome.input.tree->set_labels(csg::id_labels(scene));
  }
  const bool surface = command.surface || is_surface_alone(command, outcome.input);
  if (command.output.empty() || surface || command.sdf) return;
  const std::size_t most = outcome.format->colours;
  if (most == 0) return;
  const csg::ColourLabels parts =
      csg::colour_labels(scene, scene.root(), csg::plain_solid_colour());
  if (parts.colours.size() > most) {
    return session.warn(
        "colours",
        fmt::format(
            "the scene has {} colours, but a {} file holds {}; it is written without colours",
            parts.colours.size(), outcome.format->name, most));
  }
  for (const glm::vec4& colour : parts.colours) {
    options.colours.emplace_back(glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f);
  }
  if (!parts.colours.empty()) outcome.input.tree->set_labels(parts.labels);
}

void count_ids(const VoxelIntervals& slab, std::vector<std::uint64_t>& voxels) {
  for (int tv = 0; tv < slab.tiles_v(); ++tv) {
    for (int tu = 0; tu < slab.tiles_u(); ++tu) {
      const VoxelIntervals::TileView tile = slab.tile(tu, tv);
      for (std::size_t i = 0; i < tile.labels.size(); ++i) {
        voxels[tile.labels[i] - 1] += static_cast<std::uint64_t>(tile.items[i].length());
      }
    }
  }
}

VoxelizeOptions voxelize_options(const VoxelizeCommand& command, const VoxelizeOutcome& outcome) {
  VoxelizeOptions options;
  options.rule = outcome.input.rule;
  options.axis = outcome.axis;
  options.solid = command.solid;
  options.surface = command.surface;
  options.surface_kind = command.surface_kind;
  options.open = command.open;
  options.closedness = outcome.input.closed ? Closedness::kAssumeClosed : Closedness::kAssumeOpen;
  options.store = command.store;
  options.offsets = command.offsets;
  options.statistics = command.stats || command.json || command.checksum;
  if (!outcome.input.tree) return options;
  options.filter = &outcome.input.tree->filter();
  if (is_surface_alone(command, outcome.input)) options.solid = false, options.surface = true;
  options.closedness = Closedness::kAssumeClosed;  // it makes closed lists of open ones
  options.rule = InsideRule::kWinding;             // the solids' rules are the filter's
  return options;
}

/// Whether walls of a solid may have fallen between voxel centres.
bool may_lose_walls(const VoxelizeCommand& command, const VoxelizeOutcome& outcome) {
  // No wall falls between rays and ends.
  return command.coverage == 0 && !command.surface && !is_surface_alone(command, outcome.input);
}

/// Looks at the voxels that were made, and tells what users should know.
Result<void> check_voxels(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                          const JobPart* part, const Execution& execution, Session& session) {
  if (may_lose_walls(command, outcome) && (part == nullptr || part->finds_walls())) {
    if (auto found = find_walls(outcome, execution); !found) return found;
  }
  if (part == nullptr || part->tells_all()) tell_voxels(command, outcome, session);
  return session.check_strict();
}

/// The work itself: lists, intervals, file.
class VoxelizeRun {
 public:
  VoxelizeRun(const VoxelizeCommand& command, VoxelizeOutcome& outcome, JobPart* part,
              Session& session)
      : command_(command),
        outcome_(outcome),
        part_(part),
        session_(session),
        samples_(fog_samples(command, outcome.input)) {}

  Result<void> run() {
    if (auto done = open(); !done) return done;
    const auto made = command_.sdf ? distances() : voxelize();
    if (auto done = end_pass(made); !done) return done;
    if (auto done = check_voxels(command_, outcome_, part_, quiet_, session_); !done) return done;
    if (auto done = write_shares(); !done) return done;
    if (part_ != nullptr) {
      const auto done = writer_ ? writer_->finish(quiet_) : Result<void>();
      return part_->finish(command_, outcome_, session_, done);
    }
    return writer_ ? finish() : Result<void>();
  }

 private:
  Result<void> open();
  Result<void> open_source();
  Result<VoxelizeReport> pass(const Execution& execution, const SlabSink& sink);
  Result<void> voxelize();
  Result<void> distances();
  Result<void> write_shares();
  Result<void> finish();
  template <class Add>
  Result<void> write(Add&& add);
  Result<void> take(const VoxelIntervals& slab);
  Result<void> take_coloured(const VoxelIntervals& slab);
  void tell(const VoxelizeReport& report);
  Result<void> end_pass(const Result<void>& done);

  const VoxelizeCommand& command_;
  VoxelizeOutcome& outcome_;
  JobPart* part_;  ///< null: this process does all
  Session& session_;
  /// Values are fractions of voxels, which are made apart from what is reported.
  [[nodiscard]] bool shares() const { return samples_ > 1 || command_.coverage != 0; }

  int samples_;  ///< along a voxel's side
  std::unique_ptr<VoxelWriter> writer_;
  std::unique_ptr<csg::Gpu> gpu_;
  std::optional<Colouring> colouring_;
  VoxelizeOptions options_;
  Execution execution_, quiet_;  ///< of the voxels; without progress
  double write_ms_ = 0;
  std::uint64_t solid_voxels_ = 0;
  std::optional<BoundaryArea> boundary_;
  /// Statistics of coloured slabs that may have lost voxels.
  struct Left {
    explicit Left(const VoxelGrid& grid) : checksum(grid) {}
    std::uint64_t voxels = 0, intervals = 0;
    SetChecksum checksum;
  };
  std::optional<Left> left_out_;
};

Result<void> VoxelizeRun::open() {
  const VoxelWriterOptions file = writer_options(command_, outcome_, samples_, session_);
  outcome_.part.file = file;
  if (!command_.output.empty()) {
    auto opened = part_ != nullptr ? part_->open_writer(command_, outcome_, file)
                                   : open_voxel_writer(command_.output, outcome_.format->name,
                                                       outcome_.grid, file);
    if (!opened) return tl::unexpected(opened.error());
    writer_ = *std::move(opened);
  }
  options_ = voxelize_options(command_, outcome_);
  if (part_ != nullptr) options_.statistics = true;
  if (command_.solid) {
    if (auto done = open_source(); !done) return done;
  }
  execution_ = session_.execution("voxelizing", shares() ? 0.2 : 1.0);
  // The mesh is there already; what the format holds is not the voxelizer's.
  const std::uint64_t taken = outcome_.estimate.mesh + outcome_.estimate.output;
  execution_.memory_limit = std::max<std::uint64_t>(
      session_.memory_limit() > taken ? session_.memory_limit() - taken : 0, 1);
  quiet_ = execution_;
  quiet_.progress = {};
  if (command_.stats || command_.json || part_ != nullptr) {
    boundary_.emplace(outcome_.grid, outcome_.axis);
  }
  return {};
}

/// Depth lists by a GPU, if one is to make them.
Result<void> VoxelizeRun::open_source() {
  auto gpu = open_gpu(command_.backend, session_);
  if (!gpu) return tl::unexpected(gpu.error());
  gpu_ = *std::move(gpu);
  if (!gpu_) return {};
  const auto source = gpu_->lists(command_.store, session_.execution("depth lists"));
  if (!source) return tl::unexpected(source.error());
  options_.source = *source;
  return {};
}

template <class Add>
Result<void> VoxelizeRun::write(Add&& add) {
  if (!writer_) return {};
  const double start = session_.milliseconds();
  auto done = add(*writer_);
  write_ms_ += session_.milliseconds() - start;
  return done;
}

Result<void> VoxelizeRun::take(const VoxelIntervals& slab) {
  if (!options_.statistics) solid_voxels_ += slab.solid_voxels();
  if (boundary_) boundary_->add(slab, quiet_);
  if (command_.ids) count_ids(slab, outcome_.id_voxels);
  if (shares()) return {};
  return write([&](VoxelWriter& writer) { return writer.add(slab, quiet_); });
}

Result<void> VoxelizeRun::take_coloured(const VoxelIntervals& slab) {
  const auto coloured = colouring_->colour(slab, quiet_);
  if (!coloured) return tl::unexpected(coloured.error());
  if (command_.json || command_.stats) outcome_.colours->add(*coloured);
  if (!left_out_) return take(*coloured);
  left_out_->voxels += coloured->solid_voxels();
  left_out_->intervals += coloured->interval_count();
  left_out_->checksum.add(*coloured, quiet_);
  return take(*coloured);
}

/// All rows of this process.
Result<VoxelizeReport> VoxelizeRun::pass(const Execution& execution, const SlabSink& sink) {
  if (part_ != nullptr) {
    if (auto begun = part_->begin_pass(outcome_, options_); !begun) {
      return tl::unexpected(begun.error());
    }
  }
  auto report = voxelize_slabs(outcome_.input.soup, outcome_.grid, options_, execution, sink);
  if (report && session_.interrupted()) return fail(ErrorCode::kCancelled, "stopped");
  return report;
}

Result<void> VoxelizeRun::voxelize() {
  VoxelGrid finest = outcome_.grid;
  const int fine = std::max({1, samples_, command_.coverage});
  finest.dims *= fine, finest.voxel_size /= fine;
  if (command_.colours) {
    auto made = Colouring::create(command_, outcome_, quiet_, session_);
    if (!made) return tl::unexpected(made.error());
    colouring_ = *std::move(made);
    if (options_.statistics && colouring_->leaves_out()) left_out_.emplace(outcome_.grid);
  }
  if (auto done = outcome_.input.fit(finest, quiet_); !done) return done;
  const auto take_slab = [this](const VoxelIntervals& slab) {
    return colouring_ ? take_coloured(slab) : take(slab);
  };
  auto report = pass(execution_, take_slab);
  if (!report) return tl::unexpected(report.error());
  if (!options_.statistics) report->solid_voxels = solid_voxels_;
  if (left_out_) {
    report->solid_voxels = left_out_->voxels;
    report->intervals = left_out_->intervals;
    report->checksum = left_out_->checksum.value();
  }
  tell(*report);
  return {};
}

void VoxelizeRun::tell(const VoxelizeReport& report) {
  outcome_.report = report;
  outcome_.measured = true;
  if (boundary_) outcome_.area_estimate = boundary_->estimate();
}

/// After a pass: what the whole job knows.
Result<void> VoxelizeRun::end_pass(const Result<void>& done) {
  if (part_ == nullptr) return done;
  if (done && boundary_) {
    outcome_.part.seams = boundary_->take_seams();
    for (int axis = 0; axis < 3; ++axis) outcome_.part.faces[axis] = boundary_->faces()[axis];
  }
  return part_->end_pass(outcome_, done);
}

/// Of --sdf.
Result<void> VoxelizeRun::distances() {
  if (auto done = outcome_.input.fit(outcome_.grid, quiet_); !done) return done;
  auto surface = distance_surface(command_, outcome_, options_, session_);
  if (!surface) return tl::unexpected(surface.error());
  outcome_.exact_boundary = surface->has_value();
  DistanceOptions options;
  options.band = command_.band;
  options.everywhere = command_.band_all;
  options.solid = options_;
  if (*surface) options.surface = &**surface;
  options.inside = [&](const VoxelIntervals& slab) -> Result<void> {
    if (boundary_) boundary_->add(slab, quiet_);
    return {};
  };
  Execution execution = session_.execution("distances", 1.0);
  execution.memory_limit = execution_.memory_limit;
  const auto report = signed_distance_slabs(
      outcome_.input.soup, outcome_.grid, options, execution,
      [&](const ScalarField& layers, int z) {
        return write([&](VoxelWriter& to) { return to.add_distances(layers, z, quiet_); });
      });
  if (!report) return tl::unexpected(report.error());
  if (session_.interrupted()) return fail(ErrorCode::kCancelled, "stopped");
  outcome_.distances = *report;
  tell(report->solid);
  return {};
}

/// The numbers of the report are of the voxels whose centre is inside; fractions come apart.
Result<void> VoxelizeRun::write_shares() {
  if (!shares() || (!writer_ && command_.coverage == 0)) return {};
  options_.samples = std::max(1, samples_);
  options_.rays = command_.coverage;
  options_.statistics = false;
  Execution fine = session_.execution("sampling", 1.0);
  fine.memory_limit = execution_.memory_limit;
  const auto done = pass(fine, [this](const VoxelIntervals& slab) {
    return write([&](VoxelWriter& to) { return to.add(slab, quiet_); });
  });
  if (done) outcome_.part.filled_steps = done->filled_steps;
  const Result<void> made = done ? Result<void>() : tl::unexpected(done.error());
  if (auto all = part_ != nullptr ? part_->end_pass(outcome_, made) : made; !all) return all;
  if (command_.coverage != 0 && (part_ == nullptr || part_->tells_all())) {
    tell_filled(command_, outcome_, session_);
  }
  return session_.check_strict();
}

Result<void> VoxelizeRun::finish() {
  const double start = session_.milliseconds();
  if (auto done = writer_->finish(quiet_); !done) return done;
  outcome_.output_files = writer_->pieces();
  writer_.reset();
  outcome_.write_ms = write_ms_ + session_.milliseconds() - start;
  if (session_.interrupted()) session_.note("the interrupt came too late: the output is complete");
  outcome_.output_bytes = size_of_file(session_.place_of(command_.output));
  if (outcome_.output_files.empty()) return {};
  outcome_.output_bytes = 0;
  for (const std::string& file : outcome_.output_files) {
    *outcome_.output_bytes += size_of_file(session_.place_of(file)).value_or(0);
  }
  return {};
}

}  // namespace

bool is_surface_alone(const VoxelizeCommand& command, const csg::SolidInput& input) {
  return !command.solid || (!input.closed && command.open == OpenMode::kSurface);
}

int fog_samples(const VoxelizeCommand& command, const csg::SolidInput& input) {
  return command.fog_by_default && is_surface_alone(command, input) ? 1 : command.fog;
}

void tell_voxels(const VoxelizeCommand& command, const VoxelizeOutcome& outcome, Session& session) {
  check_columns(command, outcome, session);
  if (command.coverage != 0) return;
  if (may_lose_walls(command, outcome)) {
    tell_thin(command, outcome, session);
  } else if (outcome.report.solid_voxels == 0) {
    session.warn("empty", "no voxel is solid; the grid may not cover the mesh");
  }
}

void tell_filled(const VoxelizeCommand& command, VoxelizeOutcome& outcome, Session& session) {
  const glm::dvec3 size = outcome.grid.voxel_size;
  outcome.filled_volume = static_cast<double>(outcome.part.filled_steps) /
                          full_coverage(command.coverage) * size.x * size.y * size.z;
  if (outcome.part.filled_steps == 0) {
    session.warn("empty", "no voxel is filled; the grid may not cover the mesh");
  }
}

VoxelWriterOptions writer_options(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                                  int samples, Session& session) {
  VoxelWriterOptions file;
  file.fog = command.coverage != 0 ? full_coverage(command.coverage)
                                   : static_cast<std::uint32_t>(samples * samples * samples);
  file.fog_floats = command.floats || command.fog != 0;
  file.layers = command.layers;
  file.mask = command.mask;
  file.frame = outcome.frame;
  file.sidecar = !command.like.empty();
  if (command.sdf) {
    const double band = band_in_world(outcome.grid, command.band);
    file.band = command.band_all ? INFINITY : static_cast<float>(band);
  }
  file.rgba = command.colours;
  if (!command.solid && samples == 0 && !command.colours) file.name = "surface";
  file.levels = command.levels;
  if (command.name) file.name = *command.name;
  label_solids(command, outcome, file, session);
  return file;
}

Result<void> make_voxel_file(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                             JobPart* part, Session& session) {
  return VoxelizeRun(command, outcome, part, session).run();
}

}  // namespace strata::apps
