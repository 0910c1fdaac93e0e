// Text: fontconfig finds the font, HarfBuzz places the glyphs, FreeType gives their contours.
#include "csg/outline/text.h"

#include <fmt/core.h>

#ifdef STRATA_HAVE_TEXT

#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include <hb-ft.h>
#include <hb.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <new>

#include FT_FREETYPE_H
#include FT_GLYPH_H
#include FT_OUTLINE_H

namespace strata::csg {
namespace {

/// Glyphs are loaded at a size of `kScale` / 64 points at 100 dots per inch and then scaled. An em
/// of `size` 1 has 100 / 72 units, which is OpenSCAD's size 1.
constexpr double kScale = 1e5;
constexpr FT_UInt kDotsPerInch = 100;

/// The font that is used when none is named.
constexpr const char* kDefaultFont = "Liberation Sans";

template <class T, void (*Free)(T*)>
struct Freer {
  void operator()(T* object) const { Free(object); }
};
using Pattern = std::unique_ptr<FcPattern, Freer<FcPattern, FcPatternDestroy>>;
using Buffer = std::unique_ptr<hb_buffer_t, Freer<hb_buffer_t, hb_buffer_destroy>>;
using Font = std::unique_ptr<hb_font_t, Freer<hb_font_t, hb_font_destroy>>;

/// FreeType reports lack of memory by an error code. It becomes std::bad_alloc, which ends the job
/// as everywhere else. @return whether the call succeeded
bool succeeded(FT_Error error) {
  if (FT_ERROR_BASE(error) == FT_Err_Out_Of_Memory) throw std::bad_alloc();
  return error == 0;
}

struct Match {
  FT_Face face = nullptr;
  std::string missing;  ///< the requested family, when the font has another
};

/// Fonts by the name that a scene gives them. A face holds one glyph at a time, so callers take the
/// lock.
class Fonts {
 public:
  Fonts() {
    if (FT_Init_FreeType(&library_) != 0) throw std::bad_alloc();
    config_ = FcInitLoadConfigAndFonts();  // works without a configuration file
    if (config_ == nullptr) {
      FT_Done_FreeType(library_);
      throw std::bad_alloc();
    }
  }
  ~Fonts() {
    for (auto& [name, match] : matches_) {
      if (match.face != nullptr) FT_Done_Face(match.face);
    }
    FT_Done_FreeType(library_);
    FcConfigDestroy(config_);
  }
  Fonts(const Fonts&) = delete;
  Fonts& operator=(const Fonts&) = delete;

  Match find(const std::string& name) {
    if (const auto known = matches_.find(name); known != matches_.end()) return known->second;
    return matches_.emplace(name, look_up(name)).first->second;
  }

  std::mutex lock;

 private:
  Match look_up(const std::string& name) const {
    const Pattern wanted(
        FcNameParse(reinterpret_cast<const FcChar8*>(name.empty() ? kDefaultFont : name.c_str())));
    if (!wanted) return {};
    FcPatternAddBool(wanted.get(), FC_SCALABLE, FcTrue);
    // The requested family is read before the substitution adds replacement families.
    FcChar8* family = nullptr;
    std::string asked;
    if (FcPatternGetString(wanted.get(), FC_FAMILY, 0, &family) == FcResultMatch) {
      asked = reinterpret_cast<const char*>(family);
    }
    FcConfigSubstitute(config_, wanted.get(), FcMatchPattern);
    FcDefaultSubstitute(wanted.get());
    FcResult status = FcResultNoMatch;
    const Pattern found(FcFontMatch(config_, wanted.get(), &status));
    if (status == FcResultOutOfMemory) throw std::bad_alloc();
    FcChar8* file = nullptr;
    if (!found || FcPatternGetString(found.get(), FC_FILE, 0, &file) != FcResultMatch) return {};
    int index = 0;
    FcPatternGetInteger(found.get(), FC_INDEX, 0, &index);
    Match match;
    if (!succeeded(
            FT_New_Face(library_, reinterpret_cast<const char*>(file), index, &match.face))) {
      return {};
    }
    bool same = asked.empty() || is_generic(asked);
    for (int i = 0; FcPatternGetString(found.get(), FC_FAMILY, i, &family) == FcResultMatch; ++i) {
      same =
          same || FcStrCmpIgnoreCase(family, reinterpret_cast<const FcChar8*>(asked.c_str())) == 0;
    }
    if (!same) match.missing = asked;
    if (FT_Select_Charmap(match.face, FT_ENCODING_UNICODE) != 0) {
      FT_Select_Charmap(match.face, FT_ENCODING_MS_SYMBOL);
    }
    return match;
  }

  /// Generic family names. No font has such a name, so any font that fontconfig picks is right.
  static bool is_generic(const std::string& family) {
    const auto* name = reinterpret_cast<const FcChar8*>(family.c_str());
    return std::any_of(std::begin(kGeneric), std::end(kGeneric), [&](const char* generic) {
      return FcStrCmpIgnoreCase(name, reinterpret_cast<const FcChar8*>(generic)) == 0;
    });
  }
  static constexpr const char* kGeneric[] = {"sans",      "sans-serif", "serif",
                                             "monospace", "mono",       "cursive"};

  FT_Library library_ = nullptr;
  FcConfig* config_ = nullptr;  ///< not the process's configuration, which the application may use
  std::map<std::string, Match> matches_;
};

/// Collects the contours of glyphs. A curve becomes `steps` segments.
struct Pen {
  std::vector<std::vector<glm::dvec2>> contours;
  glm::dvec2 origin{0};  ///< position of the glyph, ems
  glm::dvec2 last{0};
  double size = 1;
  int steps = 2;

  void add(const glm::dvec2& p) { contours.back().push_back(size * (origin + p)); }
  static glm::dvec2 point(const FT_Vector* v) {
    return {static_cast<double>(v->x) / kScale, static_cast<double>(v->y) / kScale};
  }
  static Pen& of(void* user) { return *static_cast<Pen*>(user); }

  /// Exceptions must not pass through FreeType, so they become its error code.
  template <class Body>
  static int guarded(const Body& body) {
    try {
      body();
      return 0;
    } catch (const std::bad_alloc&) {
      return FT_Err_Out_Of_Memory;
    }
  }
  static int move(const FT_Vector* to, void* user) {
    return guarded([&] {
      of(user).contours.emplace_back();
      of(user).add(of(user).last = point(to));
    });
  }
  static int line(const FT_Vector* to, void* user) {
    return guarded([&] { of(user).add(of(user).last = point(to)); });
  }
  static int conic(const FT_Vector* control, const FT_Vector* to, void* user) {
    return guarded([&] {
      Pen& pen = of(user);
      const glm::dvec2 a = pen.last, b = point(control), c = point(to);
      for (int i = 1; i <= pen.steps; ++i) {
        const double t = static_cast<double>(i) / pen.steps, s = 1 - t;
        pen.add(s * s * a + 2 * s * t * b + t * t * c);
      }
      pen.last = c;
    });
  }
  static int cubic(const FT_Vector* c1, const FT_Vector* c2, const FT_Vector* to, void* user) {
    return guarded([&] {
      Pen& pen = of(user);
      const glm::dvec2 a = pen.last, b = point(c1), c = point(c2), d = point(to);
      for (int i = 1; i <= pen.steps; ++i) {
        const double t = static_cast<double>(i) / pen.steps, s = 1 - t;
        pen.add(s * s * s * a + 3 * s * s * t * b + 3 * s * t * t * c + t * t * t * d);
      }
      pen.last = d;
    });
  }
};

/// The script of the text if all its letters have the same one.
hb_script_t script_of(const TextOptions& options, hb_buffer_t* buffer) {
  const hb_script_t given = hb_script_from_string(options.script.c_str(), -1);
  if (given != HB_SCRIPT_INVALID && !options.script.empty()) return given;
  unsigned count = 0;
  const hb_glyph_info_t* infos = hb_buffer_get_glyph_infos(buffer, &count);
  hb_script_t script = HB_SCRIPT_INVALID;
  for (unsigned i = 0; i < count; ++i) {
    const hb_script_t s = hb_unicode_script(hb_unicode_funcs_get_default(), infos[i].codepoint);
    if (s == HB_SCRIPT_COMMON || s == HB_SCRIPT_INHERITED || s == HB_SCRIPT_UNKNOWN) continue;
    if (script != HB_SCRIPT_INVALID && s != script) return HB_SCRIPT_INVALID;
    script = s;
  }
  return script;
}

struct Glyph {
  unsigned index = 0;
  glm::dvec2 offset{0}, advance{0};  ///< ems
};

/// The box around all glyphs, and the sum of their advances; ems.
struct Extent {
  double left = std::numeric_limits<double>::infinity(), right = -left;
  double ascent = -left, descent = left;
  glm::dvec2 advance{0};
  [[nodiscard]] bool inked() const { return right >= left; }
};

glm::dvec2 alignment(const TextOptions& options, const Extent& extent, bool horizontal) {
  glm::dvec2 shift(0);
  if (!extent.inked()) return shift;
  const std::string &h = options.halign, &v = options.valign;
  if (horizontal) {
    if (h == "right") shift.x = -extent.advance.x;
    if (h == "center") shift.x = -extent.advance.x / 2;
    if (v == "top") shift.y = -extent.ascent;
    if (v == "center") shift.y = -(extent.ascent + extent.descent) / 2;
    if (v == "bottom") shift.y = -extent.descent;
  } else {
    // HarfBuzz places vertical text downwards from its origin.
    if (h == "right") shift.x = -extent.right;
    if (h == "left") shift.x = -extent.left;
    if (v == "center") shift.y = -extent.advance.y / 2;
    if (v == "bottom") shift.y = -extent.advance.y;
  }
  return shift;
}

/// The direction that the options give, else the direction of the script.
hb_direction_t direction_of(const TextOptions& options, hb_script_t script) {
  hb_direction_t direction = hb_direction_from_string(options.direction.c_str(), -1);
  if (options.direction.empty() || direction == HB_DIRECTION_INVALID) {
    direction = hb_script_get_horizontal_direction(script);
  }
  return direction == HB_DIRECTION_INVALID ? HB_DIRECTION_LTR : direction;
}

/// Fills the buffer with the glyphs of the text and their positions. @return the direction of the
/// text
hb_direction_t shape_text(const TextOptions& options, FT_Face face, hb_buffer_t* buffer) {
  const Font font(hb_ft_font_create(face, nullptr));
  hb_buffer_add_utf8(buffer, options.text.data(), static_cast<int>(options.text.size()), 0,
                     static_cast<int>(options.text.size()));
  const hb_script_t script = script_of(options, buffer);
  const hb_direction_t direction = direction_of(options, script);
  hb_buffer_set_script(buffer, script);
  hb_buffer_set_direction(buffer, direction);
  hb_buffer_set_language(buffer, hb_language_from_string(options.language.c_str(), -1));
  if (face->charmap != nullptr && face->charmap->encoding == FT_ENCODING_MS_SYMBOL) {
    // Symbol fonts have their glyphs in the private use area of Unicode.
    unsigned count = 0;
    hb_glyph_info_t* infos = hb_buffer_get_glyph_infos(buffer, &count);
    for (unsigned i = 0; i < count; ++i) {
      if (infos[i].codepoint < 0x100) infos[i].codepoint += 0xf000;
    }
  }
  hb_shape(font.get(), buffer, nullptr, 0);
  if (font.get() == hb_font_get_empty() || !hb_buffer_allocation_successful(buffer)) {
    throw std::bad_alloc();
  }
  return direction;
}

/// Extends the box of the text by the glyph that `face` has loaded.
void include_glyph(const Glyph& glyph, FT_Face face, Extent& extent) {
  FT_BBox box;
  FT_Outline_Get_CBox(&face->glyph->outline, &box);
  // OpenSCAD measures in whole pixels.
  box.xMin &= ~63, box.yMin &= ~63;
  box.xMax = (box.xMax + 63) & ~63, box.yMax = (box.yMax + 63) & ~63;
  if (box.xMax <= box.xMin || box.yMax <= box.yMin) return;
  const double x = extent.advance.x + glyph.offset.x;
  extent.left = std::min(extent.left, x + static_cast<double>(box.xMin) / kScale);
  extent.right = std::max(extent.right, x + static_cast<double>(box.xMax) / kScale);
  extent.ascent = std::max(extent.ascent, static_cast<double>(box.yMax) / kScale);
  extent.descent = std::min(extent.descent, static_cast<double>(box.yMin) / kScale);
}

Result<Outline> set_text(const TextOptions& options, FT_Face face, OutlineJob* job) {
  const auto ended = [&] { return job && job->ended(); };
  const Buffer buffer(hb_buffer_create());
  const hb_direction_t direction = shape_text(options, face, buffer.get());
  unsigned count = 0;
  const hb_glyph_info_t* infos = hb_buffer_get_glyph_infos(buffer.get(), &count);
  const hb_glyph_position_t* places = hb_buffer_get_glyph_positions(buffer.get(), &count);
  std::vector<Glyph> glyphs;
  Extent extent;
  for (unsigned i = 0; i < count; ++i) {
    if (ended()) return tl::unexpected(*job->error);
    const Glyph glyph{infos[i].codepoint,
                      glm::dvec2(places[i].x_offset, places[i].y_offset) / kScale,
                      glm::dvec2(places[i].x_advance, places[i].y_advance) / kScale};
    if (!succeeded(FT_Load_Glyph(face, glyph.index, FT_LOAD_DEFAULT))) continue;
    if (face->glyph->format != FT_GLYPH_FORMAT_OUTLINE) continue;
    glyphs.push_back(glyph);
    include_glyph(glyph, face, extent);
    extent.advance += glyph.advance * options.spacing;
  }

  FT_Outline_Funcs funcs{};
  funcs.move_to = Pen::move;
  funcs.line_to = Pen::line;
  funcs.conic_to = Pen::conic;
  funcs.cubic_to = Pen::cubic;
  Pen pen;
  pen.size = options.size;
  // Curves of letters are short: each gets an eighth of the segments of a circle of the text's
  // size.
  pen.steps = std::max(options.segments.count(options.size) / 8 + 1, 2);
  glm::dvec2 place = alignment(options, extent, HB_DIRECTION_IS_HORIZONTAL(direction));
  std::size_t points = 0, counted = 0;
  for (const Glyph& glyph : glyphs) {
    if (ended()) return tl::unexpected(*job->error);
    for (; counted < pen.contours.size(); ++counted) points += pen.contours[counted].size();
    constexpr std::size_t kMostPoints = 20'000'000;
    if (points > kMostPoints) {
      return fail(ErrorCode::kLimit,
                  "text: {} letters with curves of {} steps have more than {} points",
                  glyphs.size(), pen.steps, kMostPoints);
    }
    if (succeeded(FT_Load_Glyph(face, glyph.index, FT_LOAD_DEFAULT))) {
      pen.origin = place + glyph.offset;
      succeeded(FT_Outline_Decompose(&face->glyph->outline, &funcs, &pen));
    }
    place += glyph.advance * options.spacing;
  }
  for (auto& contour : pen.contours) {
    if (contour.size() > 1 && contour.back() == contour.front()) contour.pop_back();
  }
  Outline outline = clean({std::move(pen.contours)}, Fill::kNonzero, job);
  if (ended()) return tl::unexpected(*job->error);
  return outline;
}

}  // namespace

Result<Outline> make_text(const TextOptions& options, std::string& missing, OutlineJob* job) {
  missing.clear();
  if (!std::isfinite(options.size) || !std::isfinite(options.spacing)) {
    return fail(ErrorCode::kInput, "text: size {} and spacing {} must be finite", options.size,
                options.spacing);
  }
  constexpr std::size_t kLongest = 1 << 20;
  if (options.text.size() > kLongest) {
    return fail(ErrorCode::kLimit, "text: {} bytes; the limit is {}", options.text.size(),
                kLongest);
  }
  if (options.text.empty() || options.size <= 0) return Outline{};
  static Fonts fonts;
  const std::lock_guard hold(fonts.lock);
  const Match match = fonts.find(options.font);
  if (match.face == nullptr) {
    return fail(ErrorCode::kInput, "text: no font found for '{}'",
                options.font.empty() ? kDefaultFont : options.font);
  }
  missing = match.missing;
  if (!succeeded(FT_Set_Char_Size(match.face, 0, static_cast<FT_F26Dot6>(kScale), kDotsPerInch,
                                  kDotsPerInch))) {
    return fail(ErrorCode::kInput, "text: font '{}' cannot be scaled", options.font);
  }
  return set_text(options, match.face, job);
}

}  // namespace strata::csg

#else

namespace strata::csg {

Result<Outline> make_text(const TextOptions& options, std::string& missing, OutlineJob*) {
  missing = options.font;
  return fail(ErrorCode::kInput, "text: this build has no FreeType, HarfBuzz and fontconfig");
}

}  // namespace strata::csg

#endif
