// Outlines from SVG 1.1. Fill and stroke follow OpenSCAD: closed shapes are filled whatever their
// paint, open lines become bands of their stroke width.
#include <fmt/core.h>

#include <optional>

#include "csg/outline/formats/outline_import.h"

#ifdef STRATA_HAVE_PUGIXML

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <map>
#include <pugixml.hpp>

#include "csg/outline/formats/svg_path.h"
#include "csg/outline/outline_clip.h"

namespace strata::csg {
namespace {

constexpr double kInch = 25.4;
constexpr double kPixelsPerInch = 96;
constexpr int kDeepest = 200;
constexpr std::size_t kMostElements = 2'000'000;

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

struct Length {
  double number = 0;
  std::string_view unit;
};

std::optional<Length> parse_length(std::string_view text) {
  SvgScanner scan(text);
  Length length;
  if (!scan.number(length.number)) return std::nullopt;
  length.unit = trimmed(text.substr(scan.position()));
  return length;
}

/// A length in pixels, for coordinates inside the drawing.
double pixels(const pugi::xml_node& node, const char* name, double fallback = 0) {
  const auto length = parse_length(node.attribute(name).value());
  if (!length) return fallback;
  if (length->unit == "in") return length->number * kPixelsPerInch;
  if (length->unit == "cm") return length->number * kPixelsPerInch / kInch * 10;
  if (length->unit == "mm") return length->number * kPixelsPerInch / kInch;
  if (length->unit == "pt") return length->number * kPixelsPerInch / 72;
  if (length->unit == "pc") return length->number * kPixelsPerInch / 6;
  return length->number;
}

/// A property: from the `style` attribute, else from the attribute of its name; empty if there is
/// neither.
std::string_view property(const pugi::xml_node& node, std::string_view name) {
  std::string_view style = node.attribute("style").value();
  while (!style.empty()) {
    const std::size_t end = style.find(';');
    const std::string_view rule = style.substr(0, end);
    if (const std::size_t colon = rule.find(':');
        colon != std::string_view::npos && trimmed(rule.substr(0, colon)) == name) {
      return trimmed(rule.substr(colon + 1));
    }
    style.remove_prefix(end == std::string_view::npos ? style.size() : end + 1);
  }
  return trimmed(node.attribute(std::string(name).c_str()).value());
}

/// The `transform` attribute: a list of functions, of which the first is the outermost.
glm::dmat3 parse_transform(std::string_view text) {
  glm::dmat3 result(1);
  while (true) {
    const std::size_t open = text.find('('), close = text.find(')', open);
    if (close == std::string_view::npos) return result;
    std::string_view name = text.substr(0, open);
    while (!name.empty() && (name.front() == ',' || name.front() == ' ')) name.remove_prefix(1);
    name = trimmed(name);
    SvgScanner scan(text.substr(open + 1, close - open - 1));
    std::array<double, 6> a{};
    std::size_t count = 0;
    while (count < a.size() && scan.number(a[count])) ++count;
    text.remove_prefix(close + 1);
    glm::dmat3 m(1);
    if (name == "matrix" && count == 6) {
      m = {{a[0], a[1], 0}, {a[2], a[3], 0}, {a[4], a[5], 1}};
    } else if (name == "translate" && count >= 1) {
      m[2] = {a[0], a[1], 1};
    } else if (name == "scale" && count >= 1) {
      m = {{a[0], 0, 0}, {0, count > 1 ? a[1] : a[0], 0}, {0, 0, 1}};
    } else if (name == "rotate" && count >= 1) {
      const double c = cos_degrees(a[0]), s = sin_degrees(a[0]);
      m = {{c, s, 0}, {-s, c, 0}, {0, 0, 1}};
      const glm::dvec2 pivot(a[1], a[2]);
      m[2] = glm::dvec3(pivot - glm::dvec2(m * glm::dvec3(pivot, 0)), 1);
    } else if (name == "skewX" && count >= 1) {
      m[1].x = sin_degrees(a[0]) / cos_degrees(a[0]);
    } else if (name == "skewY" && count >= 1) {
      m[0].y = sin_degrees(a[0]) / cos_degrees(a[0]);
    }
    result = result * m;
  }
}

/// Maps the drawing's coordinates to millimetres, with y upwards.
glm::dmat3 page_transform(const pugi::xml_node& svg, double dpi) {
  std::array<double, 4> box{};
  SvgScanner scan(svg.attribute("viewBox").value());
  bool has_box = true;
  for (double& value : box) has_box = has_box && scan.number(value);
  has_box = has_box && box[2] > 0 && box[3] > 0;
  const double unit = dpi > 0 && std::isfinite(dpi) ? kInch / dpi : kInch / 72;
  const auto millimetres = [&](const char* name, double view) {
    const auto length = parse_length(svg.attribute(name).value());
    if (!length) return has_box ? view * unit : 0.0;
    const auto& [number, in] = *length;
    if (in.empty()) return number * unit;
    if (in == "px") return number * kInch / kPixelsPerInch;
    if (in == "pt") return number * kInch / 72;
    if (in == "pc") return number * kInch / 6;
    if (in == "in") return number * kInch;
    if (in == "cm") return number * 10;
    if (in == "mm") return number;
    if (in == "%") return has_box ? number / 100 * view * unit : 0.0;
    return has_box ? view : 0.0;
  };
  const double width = millimetres("width", box[2]), height = millimetres("height", box[3]);
  // Without a view box a unit of the drawing is a millimetre, whatever the size of the page.
  glm::dvec2 scale(1), shift(0);
  if (has_box) {
    scale = {width / box[2], height / box[3]};
    std::string_view aspect = trimmed(svg.attribute("preserveAspectRatio").value());
    if (aspect.starts_with("defer")) aspect = trimmed(aspect.substr(5));
    if (!aspect.starts_with("none")) {
      const bool slice = aspect.find("slice") != std::string_view::npos;
      const double both = slice ? std::max(scale.x, scale.y) : std::min(scale.x, scale.y);
      scale = glm::dvec2(both);
      const auto align = [&](std::string_view least, std::string_view most, double room) {
        if (aspect.find(least) != std::string_view::npos) return 0.0;
        return aspect.find(most) != std::string_view::npos ? room : room / 2;
      };
      shift = {align("xMin", "xMax", width - both * box[2]),
               align("YMin", "YMax", height - both * box[3])};
    }
  }
  // OpenSCAD moves the drawing up, not down, by the y at which the box begins. Scenes rely on it.
  return {{scale.x, 0, 0},
          {0, -scale.y, 0},
          {shift.x - scale.x * box[0], height - shift.y - scale.y * box[1], 1}};
}

/// The properties that children inherit from their parent.
struct Style {
  double stroke_width = 1;
  StrokeCap cap = StrokeCap::kButt;
  StrokeJoin join = StrokeJoin::kMiter;
  Fill fill = Fill::kEvenOdd;
};

Style derived(const Style& outer, const pugi::xml_node& node) {
  Style style = outer;
  if (const auto width = parse_length(property(node, "stroke-width"))) {
    constexpr double kThinnest = 0.01;  // thinner strokes are drawn with width 1, as in OpenSCAD
    style.stroke_width = width->number < kThinnest ? 1 : width->number;
  }
  const std::string_view cap = property(node, "stroke-linecap");
  if (cap == "butt") style.cap = StrokeCap::kButt;
  if (cap == "round") style.cap = StrokeCap::kRound;
  if (cap == "square") style.cap = StrokeCap::kSquare;
  const std::string_view join = property(node, "stroke-linejoin");
  if (join == "miter") style.join = StrokeJoin::kMiter;
  if (join == "round") style.join = StrokeJoin::kRound;
  if (join == "bevel") style.join = StrokeJoin::kBevel;
  const std::string_view rule = property(node, "fill-rule");
  if (rule == "nonzero") style.fill = Fill::kNonzero;
  if (rule == "evenodd") style.fill = Fill::kEvenOdd;
  return style;
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& name, const OutlineImport& options,
         const Execution& execution)
      : text_(text),
        name_(name),
        options_(options),
        job_(execution),
        drawing_(options.layer.empty()) {}

  Result<Outline> run() {
    pugi::xml_document document;
    const auto parsed = document.load_buffer(text_.data(), text_.size());
    if (!parsed) {
      if (parsed.status == pugi::status_out_of_memory) throw std::bad_alloc();
      return fail(ErrorCode::kInput, "{}:{}: {}", name_, line_at(parsed.offset),
                  parsed.description());
    }
    const pugi::xml_node svg = document.document_element();
    if (local_name(svg) != "svg") {
      return fail(ErrorCode::kInput, "{}: the root element is <{}>, not <svg>", name_, svg.name());
    }
    if (auto done = index_ids(svg); !done) return tl::unexpected(done.error());
    if (auto done = element(svg, page_transform(svg, options_.dpi), {}, 0, true); !done) {
      return tl::unexpected(done.error());
    }
    if (!found_ && !options_.layer.empty()) {
      return fail(ErrorCode::kInput, "{}: there is no layer or id '{}'", name_, options_.layer);
    }
    Outline outline = unite(shapes_, &job_);
    if (job_.ended()) return tl::unexpected(ended());
    return outline;
  }

 private:
  static std::string_view local_name(const pugi::xml_node& node) {
    std::string_view name = node.name();
    if (const std::size_t colon = name.find(':'); colon != std::string_view::npos) {
      if (name.substr(0, colon) != "svg") return {};  // another XML namespace
      name.remove_prefix(colon + 1);
    }
    return name;
  }

  [[nodiscard]] Error ended() const {
    return {job_.error->code, fmt::format("{}: {}", name_, job_.error->message)};
  }

  std::size_t line_at(std::ptrdiff_t offset) const {
    const auto end = static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0));
    const std::string_view before = text_.substr(0, end);
    return 1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  }

  Result<void> too_deep(const pugi::xml_node& node) const {
    return fail(ErrorCode::kInput,
                "{}:{}: elements are nested more than {} deep, or use themselves", name_,
                line_at(node.offset_debug()), kDeepest);
  }

  Result<void> index_ids(const pugi::xml_node& root) {
    pugi::xml_node node = root;
    // Visits elements in document order without recursion. The nesting depth is checked where
    // elements are drawn.
    while (node) {
      if (const auto id = node.attribute("id")) ids_.try_emplace(id.value(), node);
      if (node.first_child()) {
        node = node.first_child();
        continue;
      }
      while (node && node != root && !node.next_sibling()) node = node.parent();
      node = !node || node == root ? pugi::xml_node() : node.next_sibling();
    }
    return {};
  }

  Result<void> element(const pugi::xml_node& node, const glm::dmat3& outer,
                       const Style& outer_style, int depth, bool root = false) {
    if (node.type() != pugi::node_element) return {};
    if (job_.ended()) return tl::unexpected(ended());
    if (depth > kDeepest) return too_deep(node);
    if (++elements_ > kMostElements) {
      return fail(ErrorCode::kLimit, "{}: more than {} elements are drawn", name_, kMostElements);
    }
    const std::string_view name = local_name(node);
    const bool was_drawing = drawing_;
    if (!options_.layer.empty()) {
      const std::string_view label = node.attribute("inkscape:label").value();
      const bool is_layer =
          std::string_view(node.attribute("inkscape:groupmode").value()) == "layer";
      if (node.attribute("id").value() == options_.layer || (is_layer && label == options_.layer)) {
        drawing_ = found_ = true;
      }
    }
    // An element that is requested by its id is shown even if the file hides it.
    const bool asked_for = drawing_ && !was_drawing;
    Result<void> done;
    if (property(node, "display") != "none" || asked_for) {
      const glm::dmat3 place =
          root ? outer : outer * parse_transform(node.attribute("transform").value());
      const Style style = derived(outer_style, node);
      if (name == "svg" || name == "g" || name == "a" || name == "switch") {
        done = children(node, place, style, depth);
      } else if (name == "use") {
        done = use(node, place, style, depth);
      } else if (drawing_) {
        done = shape(node, name, place, style);
      }
    }
    drawing_ = was_drawing;
    return done;
  }

  Result<void> children(const pugi::xml_node& node, const glm::dmat3& place, const Style& style,
                        int depth) {
    for (const pugi::xml_node& child : node.children()) {
      if (auto done = element(child, place, style, depth + 1); !done) return done;
    }
    return {};
  }

  Result<void> use(const pugi::xml_node& node, const glm::dmat3& place, const Style& style,
                   int depth) {
    std::string_view href = node.attribute("href").value();
    if (href.empty()) href = node.attribute("xlink:href").value();
    if (!href.starts_with('#')) return {};
    const auto target = ids_.find(href.substr(1));
    if (target == ids_.end()) return {};
    glm::dmat3 moved = place;
    moved[2] = place * glm::dvec3(pixels(node, "x"), pixels(node, "y"), 1);
    if (local_name(target->second) == "symbol") {
      return children(target->second, moved, style, depth);
    }
    return element(target->second, moved, style, depth + 1);
  }

  Result<void> shape(const pugi::xml_node& node, std::string_view name, const glm::dmat3& place,
                     const Style& style) {
    std::vector<SvgLine> lines;
    if (name == "rect") {
      lines.push_back(rectangle(node));
    } else if (name == "circle") {
      const double r = pixels(node, "r");
      lines.push_back(ellipse({pixels(node, "cx"), pixels(node, "cy")}, {r, r}));
    } else if (name == "ellipse") {
      lines.push_back(ellipse({pixels(node, "cx"), pixels(node, "cy")},
                              {pixels(node, "rx"), pixels(node, "ry")}));
    } else if (name == "line") {
      lines.push_back(
          {{{pixels(node, "x1"), pixels(node, "y1")}, {pixels(node, "x2"), pixels(node, "y2")}},
           false});
    } else if (name == "polyline" || name == "polygon") {
      SvgLine line{{}, name == "polygon"};
      SvgScanner scan(node.attribute("points").value());
      for (glm::dvec2 p(0); scan.number(p.x) && scan.number(p.y);) line.points.push_back(p);
      lines.push_back(std::move(line));
    } else if (name == "path") {
      std::string error;
      lines = svg_path_lines(node.attribute("d").value(), options_.segments, error);
      if (!error.empty()) {
        return fail(ErrorCode::kInput, "{}:{}: {}", name_, line_at(node.offset_debug()), error);
      }
    }
    Outline filled;
    for (SvgLine& line : lines) {
      // A path whose end lies this close to its start counts as closed.
      constexpr double kCloses = 0.1;
      const bool meets = name == "path" && line.points.size() > 2 &&
                         glm::length(line.points.back() - line.points.front()) <= kCloses;
      if (line.closed || meets) {
        if (line.points.size() > 2) filled.contours.push_back(std::move(line.points));
      } else if (line.points.size() > 1) {
        const int steps = std::max(options_.segments.count(style.stroke_width / 2), 16);
        shapes_.push_back(transform(
            stroke(line.points, false, style.stroke_width, style.cap, style.join, steps, &job_),
            place));
      }
    }
    if (!filled.empty()) shapes_.push_back(transform(clean(filled, style.fill, &job_), place));
    return {};
  }

  SvgLine rectangle(const pugi::xml_node& node) const {
    const glm::dvec2 at(pixels(node, "x"), pixels(node, "y"));
    const glm::dvec2 size(pixels(node, "width"), pixels(node, "height"));
    if (!(size.x > 0) || !(size.y > 0)) return {};
    double rx = pixels(node, "rx", -1), ry = pixels(node, "ry", -1);
    if (rx < 0) rx = std::max(ry, 0.0);
    if (ry < 0) ry = rx;
    rx = std::min(rx, size.x / 2), ry = std::min(ry, size.y / 2);
    const glm::dvec2 to = at + size;
    if (rx == 0 || ry == 0) return {{at, {to.x, at.y}, to, {at.x, to.y}}, true};
    const std::string data = fmt::format(
        "M{0},{1}H{2}A{3},{4} 0 0 1 {5},{6}V{7}A{3},{4} 0 0 1 {2},{8}H{0}A{3},{4} 0 0 1 {9},{7}"
        "V{6}A{3},{4} 0 0 1 {0},{1}z",
        at.x + rx, at.y, to.x - rx, rx, ry, to.x, at.y + ry, to.y - ry, to.y, at.x);
    std::string error;
    auto lines = svg_path_lines(data, options_.segments, error);
    return lines.empty() ? SvgLine{} : std::move(lines[0]);
  }

  SvgLine ellipse(const glm::dvec2& centre, const glm::dvec2& radius) const {
    if (!(radius.x > 0) || !(radius.y > 0)) return {};
    constexpr int kFewest = 40;
    const int count = std::max(options_.segments.count(std::max(radius.x, radius.y)), kFewest);
    SvgLine line{{}, true};
    for (int i = 0; i < count; ++i) {
      const double a = 360.0 * i / count;
      line.points.push_back(centre + radius * glm::dvec2(cos_degrees(a), sin_degrees(a)));
    }
    return line;
  }

  std::string_view text_;
  const std::string& name_;
  const OutlineImport& options_;
  OutlineJob job_;
  std::map<std::string, pugi::xml_node, std::less<>> ids_;
  std::vector<Outline> shapes_;
  std::size_t elements_ = 0;
  bool drawing_ = true;  ///< inside the requested element
  bool found_ = false;
};

}  // namespace

Result<Outline> read_svg(std::string_view text, const std::string& name,
                         const OutlineImport& options, const Execution& execution) {
  return Reader(text, name, options, execution).run();
}

}  // namespace strata::csg

#else

namespace strata::csg {

Result<Outline> read_svg(std::string_view, const std::string& name, const OutlineImport&,
                         const Execution&) {
  return fail(ErrorCode::kInput, "{}: this build has no pugixml to read SVG", name);
}

}  // namespace strata::csg

#endif
