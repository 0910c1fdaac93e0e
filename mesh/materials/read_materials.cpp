#include "strata/mesh/materials/read_materials.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <new>
#include <set>

#include "core/did_you_mean.h"
#include "core/printable.h"
#include "mesh/text/input_bytes.h"
#include "mesh/text/obj_lines.h"
#include "mesh/text/text_scanner.h"

namespace strata {
namespace {

namespace fs = std::filesystem;
using namespace detail;

/// Bytes of a .mtl file that are read: a million materials of a kilobyte.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
/// Files that an OBJ file may name.
constexpr std::size_t kMostFiles = 1000;

/// The rest of a line, without blanks around it.
std::string_view rest_of_line(const char* p, const char* end) {
  p = skip_blanks(p);
  const char* stop = find_line_end(p, end);
  while (stop > p && (is_blank(stop[-1]) || stop[-1] == '\r')) --stop;
  return {p, static_cast<std::size_t>(stop - p)};
}

/// Whether the statement at p begins with a word; p goes behind it.
bool take_word(const char*& p, std::string_view word) {
  if (std::strncmp(p, word.data(), word.size()) != 0 || !ends_token(p[word.size()])) return false;
  p += word.size();
  return true;
}

/// Reads the text of one .mtl file.
class MtlReader {
 public:
  MtlReader(std::string_view text, const std::string& name, std::vector<std::string>* warnings)
      : text_(text), end_(text.data() + text.size()), name_(name), warnings_(warnings) {}

  Result<std::vector<Material>> read() {
    for (const char* p = text_.data(); p < end_; p = next_line(p, end_)) {
      const char* at = skip_blanks(p);
      Result<void> done;
      if (take_word(at, "newmtl")) {
        done = begin(at);
      } else if (take_word(at, "Kd")) {
        done = colour(at);
      } else if (take_word(at, "d")) {
        done = opacity(at, "d", false);
      } else if (take_word(at, "Tr")) {
        done = opacity(at, "Tr", true);
      }
      if (!done) return tl::unexpected(done.error());
    }
    return std::move(materials_);
  }

 private:
  Result<void> begin(const char* at) {
    const std::string_view name = rest_of_line(at, end_);
    if (name.empty()) return fail_at(at, "newmtl has no name");
    materials_.push_back({std::string(name), {}, {}});
    has_d_ = false;
    return {};
  }
  Result<void> colour(const char* at) {
    if (materials_.empty()) return fail_at(at, "Kd stands before the first newmtl");
    const char* p = skip_blanks(at);
    // Spectral curves and XYZ: nobody writes them.
    if (take_word(p, "spectral") || take_word(p, "xyz")) return {};
    glm::vec3 colour(0.0f);
    for (int i = 0; i < 3; ++i) {
      double number = 0.0;
      p = skip_blanks(p);
      const char* next = parse_double(p, number);
      // One number stands for all three.
      if (i > 0 && (*p == '\n' || *p == '\0' || *p == '\r' || *p == '#')) {
        colour[1] = colour[2] = colour[0];
        break;
      }
      if (next == nullptr || !ends_token(*next)) {
        return fail_at(p, "Kd: " + describe(p, end_) + " is not a number");
      }
      auto share = in_range(p, "Kd", number);
      if (!share) return tl::unexpected(share.error());
      colour[i] = *share;
      p = next;
    }
    materials_.back().colour = colour;
    return {};
  }
  Result<void> opacity(const char* at, const char* word, bool is_transparency) {
    if (materials_.empty()) {
      return fail_at(at, fmt::format("{} stands before the first newmtl", word));
    }
    const char* p = skip_blanks(at);
    if (take_word(p, "-halo")) p = skip_blanks(p);
    double number = 0.0;
    const char* next = parse_double(p, number);
    if (next == nullptr || !ends_token(*next)) {
      return fail_at(p, fmt::format("{}: {} is not a number", word, describe(p, end_)));
    }
    const auto share = in_range(p, word, number);
    if (!share) return tl::unexpected(share.error());
    // Where both are given, d counts: some programs write the same number as Tr.
    if (is_transparency && has_d_) return {};
    has_d_ = has_d_ || !is_transparency;
    materials_.back().opacity = is_transparency ? 1.0f - *share : *share;
    return {};
  }
  Result<float> in_range(const char* at, const char* word, double number) {
    if (!std::isfinite(number)) {
      return fail_at(at, fmt::format("{} must be 0 to 1, got {}", word, describe(at, end_)));
    }
    if (number >= 0.0 && number <= 1.0) return static_cast<float>(number);
    if (warnings_ != nullptr && !warned_) {
      warnings_->push_back(fmt::format("{}:{}: {} is {:g}; it counts as {}", name_,
                                       line_of(text_, at), word, number, number < 0.0 ? 0 : 1));
      warned_ = true;
    }
    return number < 0.0 ? 0.0f : 1.0f;
  }
  [[nodiscard]] tl::unexpected<Error> fail_at(const char* at, const std::string& what) const {
    return fail(ErrorCode::kInput, "{}:{}: {}", name_, line_of(text_, at), what);
  }

  std::string_view text_;
  const char* end_;
  const std::string& name_;
  std::vector<std::string>* warnings_;
  std::vector<Material> materials_;
  bool has_d_ = false, warned_ = false;
};

/// The statements of an OBJ file about materials.
class ObjMaterialReader {
 public:
  ObjMaterialReader(const std::string& path, const std::string& root, const Execution& execution)
      : path_(path), root_(root), execution_(execution) {}

  Result<FaceMaterials> read(std::string_view text) {
    if (text.find("usemtl") == std::string_view::npos) return std::move(out_);
    if (text.find('\n') == std::string_view::npos) {
      std::string lines(text);  // an old Macintosh's
      std::replace(lines.begin(), lines.end(), '\r', '\n');
      if (auto done = scan(lines); !done) return tl::unexpected(done.error());
    } else if (auto done = scan(text); !done) {
      return tl::unexpected(done.error());
    }
    std::vector<std::string_view> known;
    for (const auto& [name, number] : numbers_) known.push_back(name);
    for (const std::string& name : unknown_) {
      out_.warnings.push_back(
          fmt::format("{}: there is no material '{}'{}", path_, name, did_you_mean(name, known)));
      if (out_.missing.size() + out_.warnings.size() > 8) break;
    }
    return std::move(out_);
  }

 private:
  /// Counts faces as read_obj.cpp does.
  Result<void> scan(std::string_view text) {
    const char* const end = text.data() + text.size();
    std::uint64_t faces = 0, statements = 0;
    for (const char* p = text.data(); p < end;) {
      if ((++statements & 0xffff) == 0 && execution_.stop.stop_requested()) {
        return fail(ErrorCode::kCancelled, "{}: reading was stopped", path_);
      }
      p = skip_blanks(p);
      const bool short_word = *p != '\0' && (ends_token(p[1]) || p[1] == '\\');
      if (*p == 'f' && (short_word || (p[1] == 'o' && is_blank(p[2])))) {
        ++faces;
        p = skip_statement(p, end);
      } else if ((*p == 'v' || *p == 'l' || *p == 'p') && short_word) {
        p = skip_statement(p, end);
      } else {
        const char* at = p;
        if (take_word(at, "usemtl")) {
          use(rest_of_line(at, end), faces);
        } else if (take_word(at, "mtllib")) {
          if (auto done = open(rest_of_line(at, end)); !done) return done;
        }
        p = next_line(p, end);
      }
    }
    return {};
  }
  void use(std::string_view name, std::uint64_t faces) {
    const auto found = numbers_.find(std::string(name));
    if (found == numbers_.end()) unknown_.insert(printable(name));
    const std::uint32_t material =
        found == numbers_.end() ? FaceMaterials::Group::kNone : found->second;
    if (!out_.groups.empty() && out_.groups.back().first == faces) out_.groups.pop_back();
    out_.groups.push_back({faces, material});
  }
  /// `mtllib a.mtl b.mtl`, or one name with blanks.
  Result<void> open(std::string_view names) {
    std::error_code ignored;
    const fs::path folder = fs::path(path_).parent_path();
    if (fs::is_regular_file(folder / names, ignored)) return read_file(std::string(names));
    while (!names.empty()) {
      const std::string_view name = names.substr(0, names.find_first_of(" \t"));
      names.remove_prefix(std::min(name.size() + 1, names.size()));
      if (name.empty()) continue;
      if (auto done = read_file(std::string(name)); !done) return done;
    }
    return {};
  }
  Result<void> read_file(const std::string& name) {
    const std::string path = (fs::path(path_).parent_path() / name).string();
    if (!had_.insert(path).second) return {};
    if (had_.size() > kMostFiles) {
      return fail(ErrorCode::kLimit, "{}: more than {} .mtl files are named", path_, kMostFiles);
    }
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) {
      out_.missing.push_back(
          fmt::format("{}: the material file {} is not there", path_, printable(path)));
      return {};
    }
    if (!root_.empty() && !lies_below(path, root_)) {
      return fail(ErrorCode::kInput, "{}: the material file {} lies outside of --root {}", path_,
                  printable(path), root_);
    }
    if (fs::file_size(path, ignored) > kMostBytes) {
      return fail(ErrorCode::kLimit, "{}: the file is larger than {} bytes", path, kMostBytes);
    }
    out_.files.push_back(identify_file(path));
    const auto file = InputBytes::open(path, kMostBytes, execution_.stop);
    if (!file) return tl::unexpected(file.error());
    auto materials = parse_mtl(file->view(), path, &out_.warnings);
    if (!materials) return tl::unexpected(materials.error());
    for (Material& material : *materials) {
      // The first of a name counts.
      const auto number = static_cast<std::uint32_t>(out_.materials.size());
      if (!numbers_.emplace(material.name, number).second) continue;
      out_.materials.push_back(std::move(material));
    }
    return {};
  }

  const std::string& path_;
  const std::string& root_;
  const Execution& execution_;
  FaceMaterials out_;
  std::map<std::string, std::uint32_t> numbers_;
  std::set<std::string> unknown_, had_;
};

}  // namespace

std::optional<std::uint32_t> FaceMaterials::of_element(std::uint64_t element) const {
  const auto after =
      std::upper_bound(groups.begin(), groups.end(), element,
                       [](std::uint64_t face, const Group& group) { return face < group.first; });
  if (after == groups.begin() || after[-1].material == Group::kNone) return {};
  return after[-1].material;
}

Result<std::vector<Material>> parse_mtl(std::string_view text, const std::string& name,
                                        std::vector<std::string>* warnings) {
  if (detail::is_wide_text(text)) {
    return fail(ErrorCode::kInput, "{}: {}", name, detail::kWideText);
  }
  text = detail::without_byte_order_mark(text);
  std::string lines(text);  // for the zero byte behind it
  if (lines.find('\n') == std::string::npos) std::replace(lines.begin(), lines.end(), '\r', '\n');
  return MtlReader(lines, name, warnings).read();
}

Result<FaceMaterials> read_obj_materials(const std::string& path, const std::string& root,
                                         const Execution& execution) try {
  const auto file = detail::InputBytes::open(path, execution.memory_limit, execution.stop);
  if (!file) return tl::unexpected(file.error());
  auto read = ObjMaterialReader(path, root, execution).read(file->view());
  if (read && file->changed()) {
    return fail(ErrorCode::kInput, "{}: the file changed while it was read", path);
  }
  return read;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: not enough memory for its materials", path);
}

}  // namespace strata
