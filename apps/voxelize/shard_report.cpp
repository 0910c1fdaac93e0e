#include "apps/voxelize/shard_report.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "apps/commands/choice_words.h"
#include "apps/session/report.h"
#include "apps/voxelize/shard_part.h"
#include "strata/csg/tree.h"
#include "strata/voxelize/checksum.h"
#include "strata/voxelize/grid_fit.h"
#include "voxelize/volume/json_text.h"

namespace strata::apps {
namespace {

constexpr int kShardVersion = 1;

std::string hexadecimal(std::uint64_t number, int digits) {
  return fmt::format("{:0{}x}", number, digits);
}

void write_seams(JsonWriter& json, const std::vector<BoundaryArea::Seam>& seams) {
  json.key("seams").begin_array();
  for (const BoundaryArea::Seam& seam : seams) {
    std::string runs;
    runs.reserve(seam.runs.size() * 12);
    for (const BoundaryArea::Seam::Run& run : seam.runs) {
      runs += fmt::format("{:04x}{:04x}{:04x}", run.u, run.interval.first, run.interval.last);
    }
    json.begin_object();
    json.member("row", seam.v);
    json.member("first", seam.first);
    json.member("runs", runs);
    json.end_object();
  }
  json.end_array();
}

/// What the voxels of the file are.
void write_file(JsonWriter& json, const VoxelWriterOptions& file) {
  json.key("file").begin_object();
  json.member("fog", file.fog);
  json.member("fog_floats", file.fog_floats);
  json.member("mask", file.mask);
  json.member("name", file.name);
  json.member("ids", file.ids);
  json.member("sidecar", file.sidecar);
  json.key("colours").begin_array();
  for (const glm::u8vec4& c : file.colours) {
    json.value(fmt::format("{:02x}{:02x}{:02x}{:02x}", c.x, c.y, c.z, c.w));
  }
  json.end_array();
  json.member("space", file.frame.space);
  json.member("unit_metres", file.frame.unit_metres);
  const LayerOptions& layers = file.layers;
  json.key("layers").begin_object();
  json.member("axis", word_of(kAxisWords, layers.axis));
  json.member("mirror_left_right", layers.mirror_left_right);
  json.member("mirror_up_down", layers.mirror_up_down);
  json.member("gamma", layers.gamma);
  json.key("display").begin_array();
  json.value(layers.display.x), json.value(layers.display.y);
  json.end_array();
  json.member("exposure", layers.exposure);
  json.member("first_exposure", layers.first_exposure);
  json.member("time", layers.time);
  json.end_object();
  json.end_object();
}

/// The members of an object of a report, which must be there.
class Fields {
 public:
  static constexpr double kMostCounted = 9e15;  // sums of all shards stay below 2^64

  /// @param wrong  the first member that is missing or of a wrong kind
  Fields(const JsonValue* object, std::string name, std::string& wrong)
      : object_(object), name_(std::move(name)), wrong_(wrong) {
    if (object_ == nullptr || object_->kind != JsonValue::kObject) refuse("");
  }

  [[nodiscard]] const JsonValue* find(std::string_view name, JsonValue::Kind kind) const {
    const JsonValue* value = object_ == nullptr ? nullptr : object_->find(name);
    if (value != nullptr && value->kind == kind) return value;
    refuse(name);
    return nullptr;
  }
  [[nodiscard]] bool has(std::string_view name) const {
    return object_ != nullptr && object_->find(name) != nullptr;
  }
  [[nodiscard]] bool has_text(std::string_view name) const {
    const JsonValue* value = object_ == nullptr ? nullptr : object_->find(name);
    return value != nullptr && value->kind == JsonValue::kText;
  }
  [[nodiscard]] Fields object(std::string_view name) const {
    return {find(name, JsonValue::kObject), name_of(name), wrong_};
  }
  [[nodiscard]] const std::vector<JsonValue>& list(std::string_view name) const {
    static const std::vector<JsonValue> kNone;
    const JsonValue* value = find(name, JsonValue::kList);
    return value == nullptr ? kNone : value->items;
  }
  [[nodiscard]] Fields item(const JsonValue& value, std::string_view name) const {
    return {&value, name_of(name), wrong_};
  }
  [[nodiscard]] bool flag(std::string_view name) const {
    const JsonValue* value = find(name, JsonValue::kBool);
    return value != nullptr && value->truth;
  }
  [[nodiscard]] std::string text(std::string_view name) const {
    const JsonValue* value = find(name, JsonValue::kText);
    return value == nullptr ? std::string() : value->text;
  }
  /// null, or no member: empty.
  [[nodiscard]] std::string text_or_null(std::string_view name) const {
    const JsonValue* value = object_ == nullptr ? nullptr : object_->find(name);
    return value == nullptr || value->kind == JsonValue::kNull ? std::string() : text(name);
  }
  /// null: NaN.
  [[nodiscard]] double number(std::string_view name) const {
    if (object_ != nullptr) {
      const JsonValue* value = object_->find(name);
      if (value != nullptr && value->kind == JsonValue::kNull) return NAN;
    }
    return number_in(name, std::numeric_limits<double>::lowest(),
                     std::numeric_limits<double>::max());
  }
  [[nodiscard]] double number_in(std::string_view name, double least, double most) const {
    const JsonValue* value = find(name, JsonValue::kNumber);
    if (value == nullptr) return 0.0;
    if (value->number >= least && value->number <= most) return value->number;
    refuse(name);
    return 0.0;
  }
  /// 0 or more; null: 0.
  [[nodiscard]] double length(std::string_view name) const {
    const double value = number(name);
    if (value < 0) refuse(name);
    return value > 0 ? value : 0.0;
  }
  template <class T = std::uint64_t>
  [[nodiscard]] T count(std::string_view name, double most = kMostCounted) const {
    const JsonValue* value = find(name, JsonValue::kNumber);
    return value == nullptr ? T{0} : whole<T>(*value, name, most);
  }
  /// A list of whole numbers; empty if it has not as many.
  template <class T = std::uint64_t>
  [[nodiscard]] std::vector<T> counts(std::string_view name, std::size_t least, std::size_t count,
                                      double most = kMostCounted) const {
    std::vector<T> numbers;
    const std::vector<JsonValue>& items = list(name);
    if (items.size() < least || items.size() > count) return refuse(name), numbers;
    for (const JsonValue& item : items) numbers.push_back(whole<T>(item, name, most));
    return numbers;
  }
  [[nodiscard]] glm::dvec3 vector(std::string_view name) const {
    const auto numbers = object_ == nullptr ? std::nullopt : object_->numbers(name, 3);
    if (!numbers) return refuse(name), glm::dvec3(0);
    for (const double number : *numbers) {
      if (!std::isfinite(number)) refuse(name);
    }
    return {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  }
  [[nodiscard]] std::uint64_t hash(std::string_view name) const {
    const std::string digits = text(name);
    return read_hex(digits, name);
  }
  [[nodiscard]] std::uint64_t read_hex(std::string_view digits, std::string_view name) const {
    std::uint64_t value = 0;
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (error != std::errc() || end != digits.data() + digits.size()) refuse(name);
    return value;
  }
  template <class T, std::size_t n>
  [[nodiscard]] T choice(std::string_view name,
                         const std::pair<std::string_view, T> (&words)[n]) const {
    const std::string word = text(name);
    for (const auto& [known, value] : words) {
      if (known == word) return value;
    }
    refuse(name);
    return words[0].second;
  }
  void refuse(std::string_view name) const {
    if (wrong_.empty()) wrong_ = name_of(name);
  }

 private:
  template <class T>
  [[nodiscard]] T whole(const JsonValue& value, std::string_view name, double most) const {
    const double number = value.number;
    if (value.kind == JsonValue::kNumber && number >= 0 && number <= most &&
        number == std::floor(number)) {
      return static_cast<T>(number);
    }
    refuse(name);
    return 0;
  }
  [[nodiscard]] std::string name_of(std::string_view name) const {
    return name_.empty() || name.empty() ? name_ + std::string(name)
                                         : name_ + "." + std::string(name);
  }
  const JsonValue* object_;
  std::string name_;
  std::string& wrong_;
};

csg::InputFacts read_file_facts(const Fields& in) {
  csg::InputFacts facts;
  facts.path = in.text("path");
  facts.stats.format = in.text("format");
  facts.stats.bytes = in.count("bytes");
  facts.stats.vertices = in.count("vertices");
  facts.stats.triangles = in.count("triangles");
  facts.closed = in.flag("closed");
  facts.unbalanced_edges = in.count("unbalanced_edges");
  return facts;
}

void read_mesh_facts(const Fields& in, csg::InputFacts& facts) {
  facts.stats.faces = in.count("faces");
  facts.stats.out_of_range = in.count("dropped_faces");  // their sum is what is told
  facts.zero_area_faces = in.count("zero_area_faces");
  facts.turned_around = in.flag("turned_around");
  facts.orientation.turned_parts = in.count("turned_parts");
  facts.orientation.turned_triangles = in.count("turned_triangles");
  facts.orientation.double_faces = in.count("double_faces");
  facts.rule = in.choice("rule", kRuleWords);
  facts.area = in.number("area");
  facts.volume = in.number("volume");
  const Fields unit = in.object("unit");
  facts.stats.unit_metres = unit.length("file_metres");
}

void read_input(const Fields& in, csg::SolidInput& input) {
  input.closed = in.flag("closed");
  input.bounds.low = in.object("bounds").vector("low");
  input.bounds.high = in.object("bounds").vector("high");
  input.unit_metres = in.length("unit_metres");
  input.area = in.has("area") ? in.number("area") : NAN;
  if (in.has("volume")) input.volume = in.number("volume");
  for (const JsonValue& value : in.list("files")) {
    const Fields file = in.item(value, "files");
    csg::InputFacts facts = read_file_facts(file);
    facts.is_scene = value.find("faces") == nullptr;
    if (!facts.is_scene) {
      read_mesh_facts(file, facts);
      const JsonValue* unit = value.find("unit");
      const JsonValue* doubt = unit == nullptr ? nullptr : unit->find("doubt");
      if (doubt != nullptr) facts.unit_doubt = doubt->text;
    }
    input.files.push_back(std::move(facts));
  }
}

void read_walls(const Fields& in, LostWalls& walls) {
  walls.count = in.count("count");
  for (const JsonValue& value : in.list("largest")) {
    const Fields fields = in.item(value, "largest");
    LostWall wall;
    wall.axis = fields.choice("axis", kAxisWords).value_or(Axis::kZ);
    wall.thickness = fields.number("thickness");
    wall.low = fields.vector("low");
    wall.high = fields.vector("high");
    walls.largest.push_back(wall);
  }
  if (walls.count > 0 && walls.largest.empty()) in.refuse("largest");
}

void read_grid(const Fields& in, VoxelizeCommand& command, VoxelizeOutcome& outcome) {
  const std::vector<int> dims = in.counts<int>("dims", 3, 3, kMaxGridSide);
  if (dims.empty()) return;
  outcome.grid.dims = {dims[0], dims[1], dims[2]};
  outcome.grid.origin = in.vector("origin");
  outcome.grid.voxel_size = in.vector("voxel_size");
  command.default_size = in.flag("by_default");
  command.like = in.text_or_null("like");
  const std::vector<JsonValue>& rows = in.list("direction");
  if (rows.size() != 3) return in.refuse("direction");
  for (int row = 0; row < 3; ++row) {
    const std::vector<JsonValue>& numbers = rows[static_cast<std::size_t>(row)].items;
    if (numbers.size() != 3) return in.refuse("direction");
    for (int column = 0; column < 3; ++column) {
      const JsonValue& number = numbers[static_cast<std::size_t>(column)];
      // Rows are of length 1.
      if (number.kind != JsonValue::kNumber || !(std::abs(number.number) <= 1 + 1e-6)) {
        return in.refuse("direction");
      }
      outcome.frame.direction[column][row] = number.number;
    }
  }
}

void read_numbers(const Fields& report, VoxelizeCommand& command, VoxelizeOutcome& outcome) {
  VoxelizeReport& found = outcome.report;
  const Fields voxels = report.object("voxels");
  found.solid_voxels = voxels.count("solid");
  found.intervals = voxels.count("intervals");
  const Fields lists = report.object("lists");
  found.crossings = lists.count("crossings");
  found.max_depth_complexity = lists.count("max_depth");
  found.unbalanced_columns = lists.count("unbalanced_columns");
  found.negative_columns = lists.count("negative_columns");
  found.rebuilt_tiles = lists.count("rebuilt_tiles");
  const auto histogram = lists.counts("depth_histogram", 0, found.depth_histogram.size());
  for (std::size_t n = 1; n < histogram.size(); ++n) found.depth_histogram[n] = histogram[n];
  read_walls(report.object("lost_walls"), outcome.lost_walls);
  const Fields shard = report.object("shard");
  command.coverage = shard.count<int>("coverage", kMaxGridSide);
  command.ids = shard.flag("ids");
  outcome.measured = true;
}

/// The solids with voxels, which ascend.
void read_ids(const Fields& report, std::vector<ShardReport::SolidVoxels>& ids) {
  for (const JsonValue& value : report.list("ids")) {
    const Fields fields = report.item(value, "ids");
    const auto solid = fields.count<std::uint32_t>("solid", std::numeric_limits<int>::max());
    if (!ids.empty() && solid <= ids.back().solid) fields.refuse("solid");
    ids.push_back({solid, fields.text("name"), fields.count("voxels")});
  }
}

/// @param outcome  its grid and axis are known
void read_seams(const Fields& in, const VoxelizeOutcome& outcome,
                std::vector<BoundaryArea::Seam>& seams) {
  const AxisFrame frame(outcome.axis);
  const glm::ivec3 dims = outcome.grid.dims;
  for (const JsonValue& value : in.list("seams")) {
    const Fields fields = in.item(value, "seams");
    BoundaryArea::Seam seam{fields.count<int>("row", dims[frame.v] - 1), fields.flag("first"), {}};
    const std::string runs = fields.text("runs");
    if (runs.size() % 12 != 0) return in.refuse("seams");
    std::pair<int, int> least = {0, 0};  // column, and where a run may begin
    for (std::size_t at = 0; at < runs.size(); at += 12) {
      const std::uint64_t run = fields.read_hex(std::string_view(runs).substr(at, 12), "runs");
      const BoundaryArea::Seam::Run read = {
          static_cast<std::uint16_t>(run >> 32),
          {static_cast<std::uint16_t>(run >> 16), static_cast<std::uint16_t>(run)}};
      if (std::pair(int{read.u}, read.interval.begin()) < least || read.u >= dims[frame.u] ||
          read.interval.last < read.interval.first || read.interval.end() > dims[frame.w]) {
        return fields.refuse("runs");
      }
      least = {read.u, read.interval.end()};
      seam.runs.push_back(read);
    }
    seams.push_back(std::move(seam));
  }
}

VoxelWriterOptions read_file(const Fields& in) {
  VoxelWriterOptions file;
  file.fog = in.count<std::uint32_t>("fog", 4e9);
  file.fog_floats = in.flag("fog_floats");
  file.mask = in.flag("mask");
  file.name = in.text("name");
  file.ids = in.count<std::uint32_t>("ids", 4e9);
  file.sidecar = in.flag("sidecar");
  for (const JsonValue& value : in.list("colours")) {
    if (value.text.size() != 8) in.refuse("colours");
    const std::uint64_t rgba = in.read_hex(value.text, "colours");
    file.colours.emplace_back(rgba >> 24 & 0xff, rgba >> 16 & 0xff, rgba >> 8 & 0xff, rgba & 0xff);
  }
  file.frame.space = in.text("space");
  file.frame.unit_metres = in.length("unit_metres");
  const Fields layers = in.object("layers");
  file.layers.axis = layers.choice("axis", kAxisWords).value_or(Axis::kZ);
  file.layers.mirror_left_right = layers.flag("mirror_left_right");
  file.layers.mirror_up_down = layers.flag("mirror_up_down");
  file.layers.gamma = layers.number_in("gamma", 0, kMostGamma);
  const auto display = layers.counts<int>("display", 2, 2, kMaxGridSide);
  if (!display.empty()) file.layers.display = {display[0], display[1]};
  file.layers.exposure = layers.number_in("exposure", 0, kMostExposure);
  file.layers.first_exposure = layers.number_in("first_exposure", 0, kMostExposure);
  file.layers.time = layers.count<std::int64_t>("time", 3e11);
  return file;
}

void read_options(const Fields& in, VoxelizeCommand& command, VoxelizeOutcome& outcome) {
  command.solid = in.flag("solid");
  command.surface = in.has_text("surface");
  if (command.surface) command.surface_kind = in.choice("surface", kSurfaceKindWords);
  command.input.rule = outcome.input.rule = in.choice("rule", kRuleWords);
  command.open = in.choice("open", kOpenModeWords);
  outcome.axis = in.choice("axis", kAxisWords).value_or(Axis::kZ);
  command.store = in.choice("store", kStoreWords);
  command.offsets = in.choice("offsets", kOffsetWords);
}

void read_part(const Fields& in, ShardReport& report) {
  if (in.count("version") != kShardVersion) in.refuse("version");
  Shard shard;
  shard.index = in.count<int>("index", kMostShards);
  shard.count = in.count<int>("count", kMostShards);
  if (shard.index < 1 || shard.index > shard.count) in.refuse("index");
  report.command.shard = shard;
  PartNumbers& part = report.outcome.part;
  part.input_hash = in.hash("input");
  report.outcome.report.checksum_sum = in.hash("checksum_sum");
  if (report.outcome.report.checksum_sum >> 61 != 0) in.refuse("checksum_sum");
  part.filled_steps = in.count("filled_steps");
  const auto faces = in.counts("faces", 3, 3);
  if (faces.empty()) return;
  std::copy(faces.begin(), faces.end(), part.faces);
  report.outcome.input.rule = in.choice("rule", kRuleWords);
  read_seams(in, report.outcome, part.seams);
  report.format = in.text("format");
  if (report.format.empty()) return;
  if (std::ranges::find(voxel_formats(), report.format, &VoxelFormat::name) ==
      voxel_formats().end()) {
    return in.refuse("format");
  }
  part.file = read_file(in.object("file"));
  part.file->frame.direction = report.outcome.frame.direction;
}

}  // namespace

void write_shard(JsonWriter& json, const VoxelizeCommand& command, const VoxelizeOutcome& outcome) {
  const PartNumbers& part = outcome.part;
  json.key("shard").begin_object();
  json.member("version", kShardVersion);
  json.member("index", command.shard->index);
  json.member("count", command.shard->count);
  json.member("input", hexadecimal(part.input_hash, 16));
  json.member("rule", word_of(kRuleWords, outcome.input.rule));
  json.member("ids", command.ids);
  json.member("coverage", command.coverage);
  json.member("checksum_sum", hexadecimal(outcome.report.checksum_sum, 16));
  json.member("filled_steps", part.filled_steps);
  json.key("faces").begin_array();
  for (const std::uint64_t faces : part.faces) json.value(faces);
  json.end_array();
  write_seams(json, part.seams);
  json.member("format", outcome.format ? outcome.format->name : std::string_view());
  if (outcome.format && part.file) write_file(json, *part.file);
  json.end_object();
}

Result<ShardReport> read_shard_report(const std::string& path) {
  std::error_code ignored;
  const bool folder = std::filesystem::is_directory(path, ignored);
  const std::string place = folder ? path + "/" + kShardReport : path;
  if (std::filesystem::exists(place, ignored) &&
      !std::filesystem::is_regular_file(place, ignored)) {
    return fail(ErrorCode::kInput, "{}: it is no regular file", place);
  }
  std::ifstream in(place, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in) {
    return fail(ErrorCode::kInput, "{}: {}", place,
                folder ? "the folder is no shard: it has no such file" : "cannot read the file");
  }
  const auto json = parse_json(text, place);
  if (!json) return tl::unexpected(json.error());
  if (json->find("shard") == nullptr) {
    return fail(ErrorCode::kInput, "{}: it is no report of strata voxelize --shard", place);
  }
  ShardReport report;
  report.path = path;
  std::string wrong;
  const Fields whole(&*json, "", wrong);
  read_grid(whole.object("grid"), report.command, report.outcome);
  if (wrong.empty()) {
    read_input(whole.object("input"), report.outcome.input);
    read_options(whole.object("options"), report.command, report.outcome);
    read_numbers(whole, report.command, report.outcome);
    if (report.command.ids) read_ids(whole, report.ids);
    read_part(whole.object("shard"), report);
    if (!report.format.empty()) {
      report.outcome.output_bytes = whole.object("output").count("bytes");
    }
    for (const JsonValue& value : whole.list("warnings")) {
      const Fields warning = whole.item(value, "warnings");
      report.warnings.push_back({warning.text("code"), warning.text("message")});
    }
  }
  if (!wrong.empty()) {
    return fail(ErrorCode::kInput, "{}: {} is missing, or is not what a shard has", place, wrong);
  }
  if (auto valid = check_grid(report.outcome.grid); !valid) {
    return fail(ErrorCode::kInput, "{}: {}", place, valid.error().message);
  }
  return report;
}

void add_shard(const VoxelizeOutcome& part, VoxelizeOutcome& sum) {
  std::vector<std::uint64_t> numbers;
  visit_sums(part, [&](std::uint64_t number) { numbers.push_back(number); });
  std::size_t next = 0;
  visit_sums(sum, [&](std::uint64_t& number) { number += numbers[next++]; });
  sum.report.max_depth_complexity =
      std::max(sum.report.max_depth_complexity, part.report.max_depth_complexity);
  sum.part.filled_steps += part.part.filled_steps;
  if (part.lost_walls.count > 0) sum.lost_walls = part.lost_walls;
}

Result<void> finish_sum(const std::vector<ShardReport>& shards, std::uint64_t memory_limit,
                        VoxelizeOutcome& sum) {
  SetChecksum checksum(sum.grid);
  BoundaryArea area(sum.grid, sum.axis);
  std::uint64_t solids = 0;
  for (const ShardReport& shard : shards) {
    checksum.add_sum(shard.outcome.report.checksum_sum);
    area.add(shard.outcome.part.faces, shard.outcome.part.seams);
    if (!shard.ids.empty()) solids = std::max(solids, std::uint64_t{shard.ids.back().solid} + 1);
    if (const std::uint64_t bytes = solids * (sizeof(csg::Solid) + sizeof(std::uint64_t));
        bytes > memory_limit) {
      return fail(ErrorCode::kLimit, "{}: {} solids take {} of memory, which may be {}", shard.path,
                  solids, readable_bytes(bytes), readable_bytes(memory_limit));
    }
  }
  sum.report.checksum = checksum.value();
  sum.area_estimate = area.estimate();
  if (!shards.front().command.ids) return {};
  auto names = std::make_shared<csg::Tree>();
  while (names->solids().size() < solids) names->add_solid({});
  sum.id_voxels.assign(solids, 0);
  for (const ShardReport& shard : shards) {
    for (const auto& [solid, name, voxels] : shard.ids) {
      names->solids()[solid].name = name;
      sum.id_voxels[solid] += voxels;
    }
  }
  sum.input.scene = std::move(names);
  return {};
}

std::string difference(const ShardReport& a, const ShardReport& b) {
  if (a.command.shard->count != b.command.shard->count) {
    return fmt::format("it is one of {} shards, not of {}", a.command.shard->count,
                       b.command.shard->count);
  }
  const VoxelizeOutcome &x = a.outcome, &y = b.outcome;
  if (x.part.input_hash != y.part.input_hash) return "it is of another input";
  if (x.grid != y.grid || x.frame.direction != y.frame.direction) {
    return fmt::format("its grid is {} x {} x {} voxels at {}, not {} x {} x {} at {}",
                       x.grid.dims.x, x.grid.dims.y, x.grid.dims.z, triple(x.grid.origin),
                       y.grid.dims.x, y.grid.dims.y, y.grid.dims.z, triple(y.grid.origin));
  }
  if (a.format != b.format) {
    const auto name = [](const std::string& format) {
      return format.empty() ? std::string("a report alone") : "format " + format;
    };
    return fmt::format("it is of {}, not of {}", name(a.format), name(b.format));
  }
  // The report says with which options the voxels were made.
  const auto options = [](const ShardReport& shard) {
    const VoxelizeCommand& c = shard.command;
    std::string text = fmt::format(
        "solid {}, surface {}, --rule {}, --open {}, --axis {}, --coverage {}, --ids {}", c.solid,
        c.surface ? word_of(kSurfaceKindWords, c.surface_kind) : "no",
        word_of(kRuleWords, c.input.rule), word_of(kOpenModeWords, c.open),
        word_of(kAxisWords, shard.outcome.axis), c.coverage, c.ids);
    if (!shard.outcome.part.file) return text;
    JsonWriter json(JsonWriter::Layout::kOneLine);
    json.begin_object();
    write_file(json, *shard.outcome.part.file);
    json.end_object();
    return text + ", " + json.take();
  };
  const std::string mine = options(a), others = options(b);
  if (mine == others) return {};
  return fmt::format("its options are {}, not {}", mine, others);
}

}  // namespace strata::apps
