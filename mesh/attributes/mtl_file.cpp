#include "mesh/attributes/mtl_file.h"

#include <algorithm>
#include <cmath>

#include "mesh/text/obj_lines.h"
#include "mesh/text/text_scanner.h"

namespace strata::detail {
namespace {

/// Reads the text of one .mtl file.
class MtlReader {
 public:
  MtlReader(std::string_view text, const std::string& name, std::vector<std::string>* warnings)
      : text_(text), end_(text.data() + text.size()), name_(name), warnings_(warnings) {}

  Result<std::vector<MtlMaterial>> read() {
    for (const char* p = text_.data(); p < end_; p = next_line(p, end_)) {
      const char* at = skip_blanks(p);
      Result<void> done;
      if (take_statement(at, "newmtl")) {
        done = begin(at);
      } else if (take_statement(at, "Kd")) {
        done = colour(at);
      } else if (take_statement(at, "d")) {
        done = opacity(at, "d", false);
      } else if (take_statement(at, "Tr")) {
        done = opacity(at, "Tr", true);
      } else if (take_statement(at, "map_Kd")) {
        done = picture(at);
      }
      if (!done) return tl::unexpected(done.error());
    }
    return std::move(materials_);
  }

 private:
  Result<void> begin(const char* at) {
    const std::string_view name = rest_of_line(at, end_);
    if (name.empty()) return fail_at(at, "newmtl has no name");
    materials_.emplace_back().surface.name = name;
    has_d_ = false;
    return {};
  }
  Result<void> colour(const char* at) {
    if (materials_.empty()) return fail_at(at, "Kd stands before the first newmtl");
    const char* p = skip_blanks(at);
    // Spectral curves and XYZ: nobody writes them.
    if (take_statement(p, "spectral") || take_statement(p, "xyz")) return {};
    glm::vec4& colour = materials_.back().surface.colour;
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
    materials_.back().surface.coloured = true;
    return {};
  }
  Result<void> opacity(const char* at, const char* word, bool is_transparency) {
    if (materials_.empty()) {
      return fail_at(at, fmt::format("{} stands before the first newmtl", word));
    }
    const char* p = skip_blanks(at);
    if (take_statement(p, "-halo")) p = skip_blanks(p);
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
    materials_.back().surface.colour.a = is_transparency ? 1.0f - *share : *share;
    return {};
  }
  /// `map_Kd [-option values]... file`, where the file's name may hold blanks.
  Result<void> picture(const char* at) {
    if (materials_.empty()) return fail_at(at, "map_Kd stands before the first newmtl");
    MtlMaterial& material = materials_.back();
    for (const char* p = skip_blanks(at); *p == '-'; p = skip_blanks(at)) {
      const std::string_view option(p, static_cast<std::size_t>(skip_token(p) - p));
      p = skip_token(p);
      if (option == "-o") {
        p = pair(p, material.offset);
      } else if (option == "-s") {
        p = pair(p, material.scale);
      } else if (option == "-t") {
        glm::vec2 unused;
        p = pair(p, unused);
      } else if (option == "-mm") {
        p = skip_word(skip_word(p));
      } else if (option == "-clamp") {
        const char* word = skip_blanks(p);
        if (take_statement(word, "on")) material.wrap = TextureWrap::kClamp;
        p = skip_word(p);
      } else if (option == "-blendu" || option == "-blendv" || option == "-cc" ||
                 option == "-boost" || option == "-texres" || option == "-imfchan" ||
                 option == "-bm" || option == "-type") {
        p = skip_word(p);
      } else {
        break;  // a name that begins so
      }
      at = p;
    }
    material.picture = rest_of_line(at, end_);  // empty: some programs write that for none
    return {};
  }
  static const char* skip_word(const char* p) { return skip_token(skip_blanks(p)); }
  /// Reads one to three numbers; the third is of no use to pictures.
  static const char* pair(const char* p, glm::vec2& values) {
    for (int i = 0; i < 3; ++i) {
      double number = 0.0;
      const char* next = parse_double(skip_blanks(p), number);
      if (next == nullptr || !ends_token(*next)) break;
      if (i < 2 && std::isfinite(number)) values[i] = static_cast<float>(number);
      p = next;
    }
    return p;
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
  std::vector<MtlMaterial> materials_;
  bool has_d_ = false, warned_ = false;
};

}  // namespace

Result<std::vector<MtlMaterial>> parse_mtl(std::string_view text, const std::string& name,
                                           std::vector<std::string>* warnings) {
  if (is_wide_text(text)) return fail(ErrorCode::kInput, "{}: {}", name, kWideText);
  text = without_byte_order_mark(text);
  std::string lines(text);  // for the zero byte behind it
  if (lines.find('\n') == std::string::npos) std::replace(lines.begin(), lines.end(), '\r', '\n');
  return MtlReader(lines, name, warnings).read();
}

}  // namespace strata::detail
