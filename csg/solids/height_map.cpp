#include "csg/solids/height_map.h"

#include <png.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/text/input_bytes.h"
#include "mesh/text/text_scanner.h"

namespace strata::csg {
namespace {

constexpr std::size_t kMostCells = 20'000'000;

struct HeightMap {
  std::size_t columns = 0, rows = 0;
  std::vector<double> heights;  // row by row; the first row is at y = 0
  double floor = 0.0;
  std::string short_rows;  // a sentence about rows with missing numbers, or empty

  double at(std::size_t column, std::size_t row) const { return heights[row * columns + column]; }
};

/// Reads the numbers of one line. @return whether the line holds nothing else
bool read_row(std::string_view line, std::vector<double>& numbers) {
  constexpr std::string_view kEnds = " \t\r,#";
  const char* at = line.data();
  const char* const end = at + line.size();
  for (;;) {
    while (at < end && (*at == ' ' || *at == '\t' || *at == '\r' || *at == ',')) ++at;
    if (at == end || *at == '#') return true;
    const std::string_view rest(at, static_cast<std::size_t>(end - at));
    const std::string_view token = rest.substr(0, rest.find_first_of(kEnds));
    if (*at == '+') ++at;
    double number = 0.0;
    const auto [stop, status] = std::from_chars(at, end, number);
    if (status != std::errc() || !std::isfinite(number) || stop != token.data() + token.size()) {
      return false;
    }
    numbers.push_back(number);
    at = stop;
  }
}

/// Checks the number of cells against the limits. @return kLimit, kCancelled
Result<void> check_cells(const std::string& path, std::size_t cells, const Execution& execution) {
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  // Each cell takes two vertices and four triangles, and its height before that.
  constexpr std::size_t kBytes = 2 * sizeof(glm::dvec3) + 4 * sizeof(glm::uvec3) + 16;
  if (cells > kMostCells) {
    return fail(ErrorCode::kLimit, "{}: {} heights; the limit is {}", path, cells, kMostCells);
  }
  if (execution.memory_limit != 0 && cells * kBytes > execution.memory_limit) {
    return fail(ErrorCode::kLimit, "{}: {} heights need {} bytes, but the memory limit is {}", path,
                cells, cells * kBytes, execution.memory_limit);
  }
  return {};
}

Result<HeightMap> read_numbers(const std::string& path, const Execution& execution) {
  auto bytes = detail::InputBytes::open(path, 0);
  if (!bytes) return tl::unexpected(bytes.error());
  std::vector<double> numbers;
  std::vector<std::size_t> row_ends;
  std::size_t columns = 0, line_number = 0;
  if (detail::is_wide_text(bytes->view())) {
    return fail(ErrorCode::kInput, "{}: {}", path, detail::kWideText);
  }
  for (std::string_view rest = detail::without_byte_order_mark(bytes->view()); !rest.empty();) {
    const std::size_t newline = rest.find('\n');
    const std::string_view line = rest.substr(0, newline);
    rest = newline == std::string_view::npos ? std::string_view() : rest.substr(newline + 1);
    ++line_number;
    const std::size_t before = numbers.size();
    if (!read_row(line, numbers)) {
      // The message does not quote the number: a scene may name any file of the machine.
      return fail(ErrorCode::kInput, "{}:{}: number {} of row {} is not a finite number", path,
                  line_number, numbers.size() - before + 1, row_ends.size() + 1);
    }
    if (numbers.size() == before) continue;
    columns = std::max(columns, numbers.size() - before);
    row_ends.push_back(numbers.size());
    if (auto checked = check_cells(path, columns * row_ends.size(), execution); !checked) {
      return tl::unexpected(checked.error());
    }
  }
  HeightMap map;
  map.columns = columns;
  map.rows = row_ends.size();
  map.heights.resize(columns * map.rows, 0.0);  // missing numbers of short rows are 0
  std::size_t from = 0, short_rows = 0;
  for (std::size_t row = 0; row < map.rows; ++row) {
    std::copy(numbers.begin() + static_cast<std::ptrdiff_t>(from),
              numbers.begin() + static_cast<std::ptrdiff_t>(row_ends[row]),
              map.heights.begin() + static_cast<std::ptrdiff_t>(row * columns));
    if (row_ends[row] - from < columns && short_rows++ == 0) {
      map.short_rows = fmt::format("row {} has {} numbers, the longest {}; missing numbers are 0",
                                   row + 1, row_ends[row] - from, columns);
    }
    from = row_ends[row];
  }
  if (short_rows > 1) map.short_rows += fmt::format(" ({} rows are short)", short_rows);
  double least = 1.0;  // among the numbers that are present
  for (const double number : numbers) least = std::min(least, number);
  map.floor = least - 1.0;
  return map;
}

Result<HeightMap> read_picture(const std::string& path, bool invert, const Execution& execution) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&image, path.c_str())) {
    return fail(ErrorCode::kInput, "{}: {}", path, image.message);
  }
  const std::size_t columns = image.width, rows = image.height;
  if (auto checked = check_cells(path, columns * rows, execution); !checked) {
    png_image_free(&image);
    return tl::unexpected(checked.error());
  }
  image.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> pixels(columns * rows * 4);
  if (!png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr)) {
    return fail(ErrorCode::kInput, "{}: {}", path, image.message);
  }
  HeightMap map;
  map.columns = columns;
  map.rows = rows;
  map.heights.resize(columns * rows);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const std::uint8_t* p = &pixels[((rows - 1 - row) * columns + column) * 4];
      double grey = 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
      if (invert) grey = 255.0 - grey;
      map.heights[row * columns + column] = 100.0 / 255.0 * grey;
      least = std::min(least, map.heights[row * columns + column]);
    }
  }
  map.floor = least - 1.0;
  return map;
}

TriangleSoup make_solid(const HeightMap& map, bool centre) {
  const auto columns = static_cast<std::uint32_t>(map.columns);
  const auto rows = static_cast<std::uint32_t>(map.rows);
  const double left = centre ? -(columns - 1.0) / 2.0 : 0.0;
  const double front = centre ? -(rows - 1.0) / 2.0 : 0.0;
  TriangleSoup mesh;
  mesh.positions.reserve(2 * map.heights.size());
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      mesh.positions.emplace_back(left + i, front + j, map.at(i, j));
    }
  }
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.emplace_back(a, b, c);
  };
  for (std::uint32_t j = 0; j + 1 < rows; ++j) {
    for (std::uint32_t i = 0; i + 1 < columns; ++i) {
      const std::uint32_t a = j * columns + i, b = a + 1, c = b + columns, d = a + columns;
      const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
      const double height =
          (map.at(i, j) + map.at(i + 1, j) + map.at(i, j + 1) + map.at(i + 1, j + 1)) / 4.0;
      mesh.positions.emplace_back(left + i + 0.5, front + j + 0.5, height);
      triangle(a, b, middle);
      triangle(b, c, middle);
      triangle(c, d, middle);
      triangle(d, a, middle);
    }
  }
  // The border is counter-clockwise, seen from above. The floor lies below it.
  std::vector<std::uint32_t> border;
  for (std::uint32_t i = 0; i + 1 < columns; ++i) border.push_back(i);
  for (std::uint32_t j = 0; j + 1 < rows; ++j) border.push_back(j * columns + columns - 1);
  for (std::uint32_t i = columns - 1; i > 0; --i) border.push_back((rows - 1) * columns + i);
  for (std::uint32_t j = rows - 1; j > 0; --j) border.push_back(j * columns);
  const auto floor = static_cast<std::uint32_t>(mesh.positions.size());
  for (const std::uint32_t index : border) {
    const glm::dvec3 p = mesh.positions[index];
    mesh.positions.emplace_back(p.x, p.y, map.floor);
  }
  const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.emplace_back(left + 0.5 * (columns - 1.0), front + 0.5 * (rows - 1.0), map.floor);
  const auto count = static_cast<std::uint32_t>(border.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    triangle(floor + i, floor + next, border[next]);
    triangle(floor + i, border[next], border[i]);
    triangle(middle, floor + next, floor + i);
  }
  return mesh;
}

}  // namespace

Result<TriangleSoup> read_surface(const std::string& path, bool centre, bool invert,
                                  std::string* short_rows, const Execution& execution) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  auto map =
      extension == ".png" ? read_picture(path, invert, execution) : read_numbers(path, execution);
  if (!map) return tl::unexpected(map.error());
  if (map->columns < 2 || map->rows < 2) {
    return fail(ErrorCode::kInput, "{}: {} x {} heights; a surface needs at least 2 x 2", path,
                map->columns, map->rows);
  }
  if (short_rows && !map->short_rows.empty()) {
    *short_rows = fmt::format("{}: {}", path, map->short_rows);
  }
  return make_solid(*map, centre);
}

}  // namespace strata::csg
