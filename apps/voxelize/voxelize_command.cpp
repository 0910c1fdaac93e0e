#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <span>
#include <utility>
#include <vector>

#include "apps/commands/choice_words.h"
#include "apps/commands/csg_options.h"
#include "apps/commands/file_uses.h"
#include "apps/session/process_memory.h"
#include "apps/session/session.h"
#include "apps/strata/allocation_failures.h"
#include "apps/strata/library_session.h"
#include "apps/strata/run_commands.h"
#include "apps/voxelize/file_size.h"
#include "apps/voxelize/shard_part.h"
#include "apps/voxelize/voxelize_report.h"
#include "apps/voxelize/voxelize_run.h"
#include "core/printable.h"
#include "strata/csg/input/solid_input.h"
#include "strata/voxelize/formats/voxel_writer.h"
#include "strata/voxelize/readers/read_voxel_grid.h"
#include "voxelize/formats/vox_pieces.h"

namespace strata::apps {
namespace {

std::string format_list() {
  std::string text;
  for (const VoxelFormat& format : voxel_formats()) {
    text += fmt::format("{:<8} {:<8} {}\n", format.name, format.extension, format.description);
  }
  return text;
}

/// The format of the output, if there is one. Refuses what would be found out only after the work.
Result<std::optional<VoxelFormat>> output_format(const VoxelizeCommand& command) {
  if (command.output.empty()) return std::optional<VoxelFormat>();
  if (command.output == "-" && isatty(STDOUT_FILENO) != 0) {
    return fail(ErrorCode::kUsage, "standard output is a terminal, but voxel files are binary");
  }
  const auto format = voxel_format_for(command.output, command.format);
  if (!format) {
    const Error& error = format.error();
    return fail(error.code, "{}{}", error.message,
                command.format.empty() ? other_writer(command.output) : "");
  }
  if (!command.format.empty() && command.output != "-") {
    const auto by_name = voxel_format_for(command.output, "");
    const bool extension = by_name && by_name->extension.size() > 1;  // else it is any folder
    if (extension && by_name->name != format->name) {
      return fail(ErrorCode::kUsage, "-o {}: the name is that of the format {}, but --format is {}",
                  command.output, by_name->name, format->name);
    }
  }
  if ((command.fog != 0 || command.mask) && format->name != "vdb") {
    return fail(ErrorCode::kUsage, "{} needs a .vdb file; format {} cannot store a {}",
                command.mask ? "--mask" : "--fog", format->name,
                command.mask ? "mask" : "fog volume");
  }
  if (command.levels != 1 && !format->levels) {
    VoxelWriterOptions options;
    options.levels = command.levels;
    const auto held = check_values(*format, options);
    return fail(ErrorCode::kUsage, "--levels: {}", held.error().message);
  }
  if (command.name && !format->named) {
    return fail(ErrorCode::kUsage,
                "--name needs a .vdb, .nrrd or .vti file; format {} cannot store a name",
                format->name);
  }
  VoxelWriterOptions values;
  values.ids = command.ids ? 1 : 0;
  values.rgba = command.colours;
  values.band = command.sdf ? 1.0f : 0.0f;
  if (auto held = check_values(*format, values); !held) return tl::unexpected(held.error());
  if (command.band_all && format->name == "vdb") {
    return fail(ErrorCode::kUsage,
                "--band all: a level set in a .vdb has a band; write .npz, .nrrd, .vti or another "
                "format of arrays, or give a number");
  }
  if (command.axis && *command.axis != format->axis && !command.sdf) {
    return fail(ErrorCode::kUsage,
                "--axis {}: format {} needs rays along {}; without --axis the voxels are the same",
                "xyz"[static_cast<int>(*command.axis)], format -> name,
                "xyz"[static_cast<int>(format->axis)]);
  }
  std::optional<VoxelFormat> chosen = *format;
  // Rows of pictures across x run along y.
  if (command.layers.axis == Axis::kX) chosen->axis = Axis::kY;
  return chosen;
}

/// What --open says of meshes that are not closed: refuses, or says who decides where no vote can.
Result<void> check_open(const VoxelizeCommand& command, const csg::SolidInput& input,
                        Session& session) {
  if (input.closed || !command.solid) return {};
  const csg::InputFacts& file =
      *std::find_if(input.files.begin(), input.files.end(),
                    [](const csg::InputFacts& facts) { return !facts.open.empty(); });
  if (command.open == OpenMode::kFail) {
    return fail(ErrorCode::kGeometry, "{} (--open fail)", file.open);
  }
  if (command.ids && command.open == OpenMode::kSurface) {
    return fail(ErrorCode::kUsage,
                "--ids needs solids, but --open surface keeps only the surface: {}", file.open);
  }
  if (command.coverage != 0 && command.open == OpenMode::kSurface) {
    return fail(ErrorCode::kUsage,
                "--coverage needs a solid, but --open surface keeps only the surface: {}",
                file.open);
  }
  if (command.ids && !input.has_scene()) {
    return fail(ErrorCode::kUsage,
                "--ids needs closed meshes: in open ones winding numbers decide, and they do not "
                "tell solids apart; close {}{}, or remove --ids",
                file.open_part.empty()
                    ? std::string()
                    : fmt::format("part '{}' of ", printable(file.open_part, 200)),
                file.path);
  }
  if (input.has_scene() && command.open == OpenMode::kVote) {
    session.warn("open",
                 fmt::format("{}: scenes do not use winding numbers: each ray pairs the faces "
                             "it meets, and a face without a partner becomes a thin sheet",
                             file.path));
  }
  return {};
}

/// Where lengths were given, says which files may be in another unit. With -r units do not matter.
void tell_units(const VoxelizeCommand& command, const csg::SolidInput& input, Session& session) {
  const GridRequest& grid = command.grid;
  if (!grid.voxel_size && !grid.bounds && !grid.origin && command.like.empty()) return;
  for (const csg::InputFacts& file : input.files) {
    if (!file.unit_doubt.empty()) session.tell(fmt::format("{}: {}", file.path, file.unit_doubt));
  }
}

/// Refuses meshes whose sizes doubles cannot hold: memory is estimated by their area.
Result<void> check_size(const csg::SolidInput& input) {
  for (const csg::InputFacts& file : input.files) {
    if (std::isfinite(file.area) && std::isfinite(file.volume)) continue;
    return fail(ErrorCode::kGeometry,
                "{}: the mesh is {:.3g} long, and its area or volume is beyond the range of "
                "double; a small --scale helps",
                file.path, file.bounds.longest_side());
  }
  return {};
}

/// With --like: the grid of a file. Meshes that say their unit are converted to the file's.
Result<void> take_grid(const VoxelizeCommand& command, csg::SceneInput& placed,
                       VoxelizeOutcome& outcome, Session& session) {
  outcome.frame.unit_metres = csg::world_unit(placed);
  if (command.like.empty()) return {};
  const auto file = read_voxel_grid(command.like, session.execution("reading"));
  if (!file) return fail(file.error().code, "--like {}", file.error().message);
  if (outcome.format) {
    if (auto held = check_frame(*outcome.format, file->frame); !held) {
      return fail(held.error().code, "--like {}: {}", command.like, held.error().message);
    }
  }
  const double given = placed.placement.unit_metres, states = file->frame.unit_metres;
  if (given > 0.0 && states > 0.0 && std::abs(given - states) > 1e-9 * given) {
    return fail(ErrorCode::kUsage,
                "--unit {} contradicts --like {}, whose numbers are in {}; leave --unit out",
                csg::unit_symbol(given), command.like, csg::unit_symbol(states));
  }
  if (states > 0.0) placed.placement.unit_metres = states;
  outcome.grid = file->grid;
  outcome.frame = file->frame;
  outcome.frame.unit_metres = csg::world_unit(placed);
  if (outcome.frame.turned()) placed.space_from_world = glm::inverse(outcome.frame.direction);
  return {};
}

/// Refuses .vox files of several pieces that would replace what is read.
/// @param opened  by the scene or the meshes
Result<void> check_pieces(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                          const std::vector<FileIdentity>& opened) {
  if (!outcome.format || outcome.format->name != "vox") return {};
  const VoxPieces pieces(outcome.grid.dims);
  // The writer refuses streams, and more pieces than there may be.
  if (pieces.total() == 1 || pieces.total() > VoxPieces::kMost || is_stream(command.output)) {
    return {};
  }
  if (command.show) {
    return fail(ErrorCode::kUsage,
                "--show shows one file, but {} x {} x {} voxels are {} .vox files; another format "
                "holds them in one",
                outcome.grid.dims.x, outcome.grid.dims.y, outcome.grid.dims.z, pieces.total());
  }
  std::vector<FileUse> written;
  for (int piece = 0; piece < pieces.total(); ++piece) {
    written.push_back({"the piece of -o,", pieces.path(command.output, piece)});
  }
  if (command.json) written.push_back({"--json", *command.json});
  if (auto kept = check_files(inputs_of(command), written); !kept) return kept;
  for (const FileIdentity& file : opened) {
    if (auto kept = check_opened(file, written); !kept) return kept;
  }
  return {};
}

/// The axis the format is written from, or the one with the fewest columns.
Axis choose_axis(const VoxelizeCommand& command, const std::optional<VoxelFormat>& format,
                 const VoxelGrid& grid) {
  if (command.sdf) return Axis::kX;
  if (command.axis) return *command.axis;
  if (format) return format->axis;
  // The longest side has the smallest cross-section.
  if (grid.dims.z >= grid.dims.x && grid.dims.z >= grid.dims.y) return Axis::kZ;
  return grid.dims.y >= grid.dims.x ? Axis::kY : Axis::kX;
}

}  // namespace

Result<void> print_reports(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                           Session& session, std::string_view name) {
  const bool json_on_stdout = command.json == "-";
  const bool file_on_stdout = command.output == "-" && !command.dry_run;
  // All files are there before a reader of standard output goes on.
  if (command.json && !json_on_stdout) {
    const std::string text = voxelize_json(command, outcome, session, name);
    if (auto done = print_report(text, *command.json, false); !done) return done;
  }
  if (auto done = commit_outputs(session); !done) return done;
  if (!command.output.empty() && command.output != "-" && !command.dry_run && !command.stats) {
    session.tell(made_line(command, outcome, session.milliseconds() / 1000));
  }
  if (command.checksum && !command.stats && !command.json && !command.dry_run) {
    const std::string line = fmt::format("{:016x}\n", outcome.report.checksum);
    if (auto done = print_report(line, "-", file_on_stdout); !done) return done;
  }
  if (command.stats || (command.dry_run && !command.json)) {
    const std::string text = voxelize_text(command, outcome, session);
    if (auto done = print_report(text, "-", file_on_stdout || json_on_stdout); !done) return done;
  }
  if (!json_on_stdout) return {};
  return print_report(voxelize_json(command, outcome, session, name), "-", file_on_stdout);
}

namespace {

Result<void> check_samples(const VoxelizeCommand& command, int samples, const VoxelGrid& grid) {
  const int longest = std::max({grid.dims.x, grid.dims.y, grid.dims.z});
  if (command.coverage * longest > kMaxGridSide) {
    return fail(ErrorCode::kLimit,
                "--coverage: {} rays per side on a grid of {} x {} x {} voxels exceed {}; give a "
                "smaller --coverage=N",
                command.coverage, grid.dims.x, grid.dims.y, grid.dims.z, kMaxGridSide);
  }
  if (samples * longest <= kMaxGridSide) return {};
  return fail(ErrorCode::kLimit,
              "--fog: {} samples per side on a grid of {} x {} x {} voxels exceed {}; give a "
              "smaller --fog=N",
              samples, grid.dims.x, grid.dims.y, grid.dims.z, kMaxGridSide);
}

/// What decides how much the job will hold.
MemoryFactors memory_factors(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                             int samples, const Session& session) {
  const csg::SolidInput& input = outcome.input;
  MemoryFactors factors;
  factors.mesh = &input.soup;
  factors.is_tree = input.tree != nullptr;
  factors.area = input.area;
  factors.votes = !input.closed && !input.tree && command.solid && command.open == OpenMode::kVote;
  for (const csg::InputFacts& file : input.files) factors.open_edges += file.unbalanced_edges;
  factors.axis = outcome.axis;
  factors.samples = samples;
  factors.rays = command.coverage;
  factors.solid = command.solid;
  factors.surface = command.surface;
  if (outcome.format) factors.format = outcome.format->name;
  factors.ids = command.ids || command.colours;  // labels
  factors.fog = command.fog != 0 || command.coverage != 0;
  if (command.sdf) factors.band = command.band;
  factors.everywhere = command.band_all;
  factors.threads = session.threads();
  factors.limit = session.memory_limit();
  return factors;
}

/// What colours of a surface of area A take: pictures and their halves, corners of faces, and the
/// 1.5 A voxels, nearly each a run of its own where colours change from point to point.
void add_colours(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                 const Session& session, MemoryEstimate& estimate) {
  const csg::SolidInput& input = outcome.input;
  if (!command.colours || input.tree) return;
  const MeshAttributes& all = input.attributes;
  const bool changing = !all.textures.empty() || !all.vertex_colours.empty() || all.corner_colours;
  double pictures = 0;
  for (const Texture& texture : all.textures) {
    pictures += static_cast<double>(texture.texels.size()) * (4 + 8.0 / 3);
  }
  const double corners = static_cast<double>(all.corners.size()) * 20;
  const glm::dvec3& s = outcome.grid.voxel_size;
  const double runs = (changing ? 1.5 : 0.5) * input.area / std::pow(s.x * s.y * s.z, 2.0 / 3);
  const std::string_view format = outcome.format ? outcome.format->name : "";
  // Measured: bytes that a format holds for a run until the end, and the counts of its palette.
  const double held = format == "vox" ? 12 : format == "vdb" ? (changing ? 14 : 18) : 0;
  const double tables = (format == "vox" ? 7e6 : 0) + 3e6;
  const auto whole = [](double bytes) {
    return static_cast<std::uint64_t>(std::clamp(bytes, 0.0, 1e15));
  };
  estimate.mesh += whole(pictures + corners);
  const double tiles = static_cast<double>(outcome.grid.dims.x) * outcome.grid.dims.y / 4096 + 1;
  double slabs = runs * 9;
  if (const std::uint64_t limit = session.memory_limit(); limit != 0) {
    slabs = std::min(slabs, static_cast<double>(limit) / 8);  // they are cut to fit
  }
  estimate.slabs += whole(slabs + tables * std::min<double>(session.threads(), tiles));
  estimate.output += whole(runs * held);
}

/// Of a file that will not be written.
void estimate_file(const VoxelizeCommand& command, VoxelizeOutcome& outcome, int samples,
                   Session& session) {
  if (!outcome.format) return;
  MemoryFactors factors = memory_factors(command, outcome, samples, session);
  if (is_surface_alone(command, outcome.input)) factors.solid = false, factors.surface = true;
  outcome.file_size =
      file_size(outcome.grid, factors, outcome.input.closed,
                writer_options(command, outcome, samples, session), session.execution("file size"));
}

/// Refuses what will not fit the memory limit.
Result<void> check_memory(const VoxelizeCommand& command, const VoxelizeOutcome& outcome,
                          Session& session) {
  const glm::ivec3 dims = outcome.grid.dims;
  const std::uint64_t bytes = outcome.estimate.total();
  session.note(fmt::format("grid {} x {} x {}, about {} of memory", dims.x, dims.y, dims.z,
                           readable_bytes(expected_memory(outcome))));
  if (session.memory_limit() == 0 || bytes <= session.memory_limit() || command.dry_run) return {};
  return fail(ErrorCode::kLimit,
              "a grid of {} x {} x {} voxels needs about {} for this mesh; the limit is {} "
              "(--memory-limit)",
              dims.x, dims.y, dims.z, readable_bytes(bytes),
              readable_bytes(session.memory_limit()));
}

Result<void> make_voxels(const VoxelizeCommand& command, JobPart* part, Session& session) {
  VoxelizeOutcome outcome;
  auto format = output_format(command);
  if (!format) return tl::unexpected(format.error());
  outcome.format = *std::move(format);

  csg::SceneInput placed = command.input;
  if (auto taken = take_grid(command, placed, outcome, session); !taken) return taken;
  std::vector<FileIdentity> opened;
  csg::InputMessages messages = messages_of(session);
  messages.opened = [&](std::span<const FileIdentity> files) {
    opened.insert(opened.end(), files.begin(), files.end());
    return session.opened(files);
  };
  auto input = csg::load_solids(placed, command.ids, messages, session.execution("reading"));
  if (!input) return tl::unexpected(input.error());
  outcome.input = *std::move(input);
  if (auto valid = check_size(outcome.input); !valid) return valid;
  tell_units(command, outcome.input, session);
  if (auto valid = check_open(command, outcome.input, session); !valid) return valid;
  if (auto strict = session.check_strict(); !strict) return strict;

  if (command.like.empty()) {
    const auto grid =
        fit_input_grid(outcome.input.bounds, command.grid, command.input.files.front());
    if (!grid) return tl::unexpected(grid.error());
    outcome.grid = *grid;
  }
  if (auto kept = check_pieces(command, outcome, opened); !kept) return kept;
  outcome.axis = choose_axis(command, outcome.format, outcome.grid);
  if (part != nullptr) {
    if (auto valid = part->check(command, outcome); !valid) return valid;
  }
  const int samples = fog_samples(command, outcome.input);
  if (const auto valid = check_samples(command, samples, outcome.grid); !valid) return valid;
  outcome.estimate =
      estimate_memory(outcome.grid, memory_factors(command, outcome, samples, session));
  add_colours(command, outcome, session, outcome.estimate);
  outcome.read_peak = peak_memory_bytes();
  if (auto valid = check_memory(command, outcome, session); !valid) return valid;
  if (command.dry_run) {
    estimate_file(command, outcome, samples, session);
    if (session.interrupted()) return fail(ErrorCode::kCancelled, "stopped");
  } else {
    VoxelizeCommand with_place = command;
    with_place.input = std::move(placed);  // distances read it again
    if (auto done = make_voxel_file(with_place, outcome, part, session); !done) return done;
  }
  session.end_progress();
  return part == nullptr || part->reports() ? print_reports(command, outcome, session)
                                            : Result<void>();
}

}  // namespace

Result<void> run_voxelize_part(const VoxelizeCommand& command, JobPart& part, Session& session) {
  return make_voxels(command, &part, session);
}

Result<void> run_voxelize(const VoxelizeCommand& command, Session& session) {
  if (command.list_formats) return print_report(format_list(), "-", false);
  if (command.shard) {
    ShardPart part(*command.shard);
    return run_voxelize_part(command, part, session);
  }
  if (!command.show) return make_voxels(command, nullptr, session);
  if (auto shown = check_view_program("--show"); !shown) return shown;
  if (auto done = make_voxels(command, nullptr, session); !done) return done;
  // The window has its own limits; this process's wall would be inherited.
  rlimit memory{};
  if (getrlimit(RLIMIT_DATA, &memory) == 0) {
    memory.rlim_cur = memory.rlim_max;
    setrlimit(RLIMIT_DATA, &memory);
  }
  std::string path = command.output;
  char* arguments[] = {path.data(), nullptr};
  return fail(static_cast<ErrorCode>(run_view_program(arguments)), "{} is complete, but not shown",
              command.output);
}

}  // namespace strata::apps
