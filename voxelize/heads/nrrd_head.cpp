#include "voxelize/heads/nrrd_head.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace strata {
namespace {

/// The file's axes that lie in space, fastest first.
std::vector<std::size_t> axes_in_space(const std::vector<double>& sizes,
                                       const std::vector<double>& directions,
                                       std::string_view kinds) {
  std::vector<std::size_t> axes;
  std::string rest(kinds);
  for (std::size_t a = 0; a < sizes.size(); ++a) {
    const std::size_t begin = std::min(rest.find_first_not_of(' '), rest.size());
    const std::size_t end = std::min(rest.find(' ', begin), rest.size());
    const std::string kind = lower_case(rest.substr(begin, end - begin));
    rest = rest.substr(end);
    const bool domain = kind.empty() || kind == "domain" || kind == "space" || kind == "???";
    const bool there = directions.empty() ? domain : std::isfinite(directions[3 * a]);
    if (there) axes.push_back(a);
  }
  return axes;
}

double unit_of(const NrrdHead& head) {
  std::string_view units = head.get("space units", "units");
  double unit = -1.0;
  while (true) {
    const std::size_t open = units.find('"');
    const std::size_t close = open == std::string_view::npos ? open : units.find('"', open + 1);
    if (close == std::string_view::npos) return std::max(unit, 0.0);
    const std::string_view name = units.substr(open + 1, close - open - 1);
    units.remove_prefix(close + 1);
    if (name.empty()) continue;
    const double one = unit_named(name);
    if (unit >= 0.0 && one != unit) return 0.0;
    unit = one;
  }
}

}  // namespace

Result<NrrdHead> parse_nrrd_head(std::string_view bytes, const std::string& path) {
  NrrdHead head;
  if (!bytes.starts_with("NRRD000")) {
    return fail(ErrorCode::kInput, "{}:1: not an NRRD file: it does not begin with NRRD000", path);
  }
  int number = 0;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = bytes.find('\n', at);
    if (end == std::string_view::npos) break;
    const std::string line = trimmed(bytes.substr(at, end - at));
    at = end + 1;
    if (++number == 1 || line.starts_with('#')) continue;
    head.data = at;
    if (line.empty()) return head;
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) {
      return fail(ErrorCode::kInput, "{}:{}: must be 'field: value'", path, number);
    }
    if (line.compare(colon, 2, ":=") == 0) continue;  // keys of the user
    head.fields.set(lower_case(line.substr(0, colon)),
                    trimmed(std::string_view(line).substr(colon + 1)));
  }
  // A detached head may end with the file.
  if (head.fields.contains("data file") || head.fields.contains("datafile")) return head;
  return fail(ErrorCode::kInput, "{}: the header has no empty line at its end", path);
}

Result<VoxelFileGrid> nrrd_grid(const NrrdHead& head, const std::string& path) {
  const std::vector<double> sizes = numbers_of(head.get("sizes"));
  const std::vector<double> directions = numbers_of(head.get("space directions"));
  if (!directions.empty() && directions.size() != 3 * sizes.size()) {
    return fail(ErrorCode::kInput,
                "{}: space directions '{}' must be 3 numbers for each of {} axes", path,
                head.get("space directions").substr(0, 80), sizes.size());
  }
  const std::vector<std::size_t> in_space = axes_in_space(sizes, directions, head.get("kinds"));
  if (in_space.size() != 3) {
    return fail(ErrorCode::kInput, "{}: {} of its {} axes lie in space; voxels have 3", path,
                in_space.size(), sizes.size());
  }
  const std::vector<double> spacings = numbers_of(head.get("spacings"));
  const std::vector<double> mins = numbers_of(head.get("axis mins", "axismins"));
  const std::vector<double> origin = numbers_of(head.get("space origin"));
  const bool node = head.get("centers", "centerings").find("node") != std::string_view::npos;
  if (!head.get("space origin").empty() && origin.size() != 3) {
    return fail(ErrorCode::kInput, "{}: space origin '{}' must be 3 numbers", path,
                head.get("space origin").substr(0, 60));
  }
  GridAxes axes;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t a = in_space[i];
    const auto axis = static_cast<int>(i);
    axes.sizes[i] = sizes[a];
    if (!directions.empty()) {
      axes.steps[axis] = {directions[3 * a], directions[3 * a + 1], directions[3 * a + 2]};
    } else if (spacings.size() == sizes.size() && std::isfinite(spacings[a])) {
      axes.steps[axis][axis] = std::abs(spacings[a]);
    }
    if (origin.size() == 3) {
      axes.place[axis] = origin[i];
    } else if (mins.size() == sizes.size() && std::isfinite(mins[a])) {
      axes.place[axis] = mins[a] + (node ? 0.0 : 0.5 * axes.steps[axis][axis]);
    }
  }
  auto grid = grid_of_axes(path, axes);
  if (!grid) return grid;
  grid->frame.space = head.get("space");
  grid->frame.unit_metres = unit_of(head);
  return grid;
}

}  // namespace strata
