#include "transparency/media/media_table.h"

#include <algorithm>
#include <cmath>

#include "core/printable.h"

namespace strata::transparency {
namespace {

constexpr const char* kChannels[] = {"red", "green", "blue"};

/// "what: the red part of its extinction must be 0 to 1, got 2".
Result<void> check_part(std::string_view what, std::string_view which, const glm::vec3& value,
                        double most) {
  for (int c = 0; c < 3; ++c) {
    if (value[c] >= 0.0f && static_cast<double>(value[c]) <= most) continue;
    return fail(ErrorCode::kUsage, "{}: the {} part of the {} must be 0 to {}, got {}", what,
                kChannels[c], which, most, value[c]);
  }
  return {};
}

Result<void> check_medium(std::string_view what, const glm::vec3& extinction,
                          const glm::vec3& albedo) {
  if (auto good = check_part(what, "extinction", extinction, kMostExtinction); !good) return good;
  return check_part(what, "albedo", albedo, 1.0);
}

bool within(const glm::dvec3& v) {
  return std::abs(v.x) <= kFarthest && std::abs(v.y) <= kFarthest && std::abs(v.z) <= kFarthest;
}

Result<void> check_particle(const Particle& p, std::size_t index) {
  if (!within(p.centre)) {
    return fail(ErrorCode::kUsage, "particle {}: the centre must be {} to {}, got {}, {}, {}",
                index, -kFarthest, kFarthest, p.centre.x, p.centre.y, p.centre.z);
  }
  if (!(p.radius > 0.0 && p.radius <= kFarthest)) {
    return fail(ErrorCode::kUsage, "particle {}: the radius must be above 0 and at most {}, got {}",
                index, kFarthest, p.radius);
  }
  // Names are made for those that are wrong alone: there are many particles.
  if (check_medium("", p.extinction, p.albedo)) return {};
  return check_medium(fmt::format("particle {}", index), p.extinction, p.albedo);
}

Result<void> check_light(const MediaLight& light) {
  const std::string_view what = light.point ? "place" : "direction";
  if (!within(light.at)) {
    return fail(ErrorCode::kUsage, "the light's {} must be {} to {}, got {}, {}, {}", what,
                -kFarthest, kFarthest, light.at.x, light.at.y, light.at.z);
  }
  if (!light.point && light.at == glm::dvec3(0.0)) {
    return fail(ErrorCode::kUsage, "the light's direction must not be 0, 0, 0");
  }
  if (light.shadow_size < 1 || light.shadow_size > 8192) {
    return fail(ErrorCode::kUsage, "the light's shadow size must be 1 to 8192, got {}",
                light.shadow_size);
  }
  if (light.shadow_steps < 0 || light.shadow_steps > 1024) {
    return fail(ErrorCode::kUsage, "the light's shadow steps must be 0 to 1024, got {}",
                light.shadow_steps);
  }
  if (light.visibility_size < 1 || light.visibility_size > 64) {
    return fail(ErrorCode::kUsage, "the light's visibility size must be 1 to 64, got {}",
                light.visibility_size);
  }
  return check_part("the light", "radiance", light.radiance, kMostExtinction);
}

/// The power of two whose multiples extinctions become.
double unit_of(const MediaSettings& settings, std::size_t solids) {
  // At most: each solid has the largest extinction of all media. Sums stay below 2^52 units.
  double most = 0.0, sum = 0.0;
  for (const NamedMedium& named : settings.media) {
    for (int c = 0; c < 3; ++c) {
      most = std::max(most, static_cast<double>(named.medium.extinction[c]));
    }
  }
  sum = most * static_cast<double>(solids);
  for (const Particle& p : settings.particles) {
    sum += static_cast<double>(std::max({p.extinction.x, p.extinction.y, p.extinction.z}));
  }
  if (!(sum > 0.0)) return 1.0;
  int exponent = 0;
  std::frexp(sum, &exponent);
  // Half a unit for each rounding fits, too: 2^51 leaves room for 2^50 of them.
  return std::ldexp(1.0, exponent - 51);
}

MediumTerms terms_of(const glm::vec3& extinction, const glm::vec3& albedo, double unit) {
  MediumTerms terms;
  for (int c = 0; c < 3; ++c) {
    const auto i = static_cast<std::size_t>(c / 2);
    const double sigma = extinction[c];
    terms.extinction[i][c % 2] = std::round(sigma / unit) * unit;
    terms.scattering[i][c % 2] = std::round(sigma * static_cast<double>(albedo[c]) / unit) * unit;
  }
  return terms;
}

/// Whether a name is what a pattern says, in which each `*` stands for any text.
bool matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, star = std::string_view::npos, after = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      after = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p, ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++after;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

/// The names of the first objects, for messages.
std::string names_of(const Scene& scene) {
  constexpr std::size_t kShown = 5;
  std::string names;
  for (std::size_t i = 0; i < std::min(kShown, scene.objects.size()); ++i) {
    names += (i == 0 ? "'" : ", '") + printable(scene.objects[i].name, 60) + "'";
  }
  if (scene.objects.size() > kShown)
    names += fmt::format(" and {} more", scene.objects.size() - kShown);
  return names.empty() ? "none" : names;
}

/// The medium of each object, or null: the one with its name, else the one with the longest
/// pattern.
Result<std::vector<const Medium*>> choose_media(const Scene& scene,
                                                const std::vector<NamedMedium>& media) {
  std::vector<const Medium*> chosen(scene.objects.size(), nullptr);
  std::vector<std::size_t> rank(scene.objects.size(), 0);
  for (const NamedMedium& named : media) {
    bool fits = named.object == "*";
    for (std::size_t o = 0; o < chosen.size(); ++o) {
      if (scene.objects[o].part_of || !matches(named.object, scene.objects[o].name)) continue;
      fits = true;
      const bool same = named.object == scene.objects[o].name;
      const std::size_t of_this = same ? std::string::npos : named.object.size();
      if (of_this <= rank[o]) continue;
      rank[o] = of_this;
      chosen[o] = &named.medium;
    }
    if (fits) continue;
    return fail(ErrorCode::kUsage,
                "a medium is for '{}', but no object has this name; the objects are {}",
                printable(named.object, 60), names_of(scene));
  }
  return chosen;
}

}  // namespace

Result<void> check_media(const MediaSettings& settings) {
  for (const NamedMedium& named : settings.media) {
    const std::string what = fmt::format("the medium of '{}'", named.object);
    const Medium& medium = named.medium;
    if (auto good = check_medium(what, medium.extinction, medium.albedo); !good) return good;
    if (!medium.surface_colour) continue;
    const glm::vec4& colour = *medium.surface_colour;
    if (auto good = check_part(what, "surface", glm::vec3(colour), 1.0); !good) return good;
    if (!(colour.a >= 0.0f && colour.a <= 1.0f)) {
      return fail(ErrorCode::kUsage, "{}: the opacity of the surface must be 0 to 1, got {}", what,
                  colour.a);
    }
  }
  for (std::size_t i = 0; i < settings.particles.size(); ++i) {
    if (auto good = check_particle(settings.particles[i], i); !good) return good;
  }
  if (auto good = check_part("the media", "ambient light", settings.ambient, kMostExtinction);
      !good) {
    return good;
  }
  return check_light(settings.light);
}

Result<MediaTable> make_media_table(const Scene& scene, const MediaSettings& settings,
                                    const FrameOptions& options) {
  MediaTable table;
  table.looks = looks_of(scene, options);
  table.medium_of.assign(scene.objects.size(), MediaTable::kNone);
  auto found = choose_media(scene, settings.media);
  if (!found) return tl::unexpected(found.error());
  const std::vector<const Medium*>& chosen = *found;
  const auto count = static_cast<std::size_t>(
      std::count_if(chosen.begin(), chosen.end(), [](const Medium* m) { return m != nullptr; }));
  const double unit = unit_of(settings, count);
  const auto fill = [&](std::size_t o, const Medium& medium) {
    // Never opaque: rays must not lose crossings of a solid that they may begin in.
    table.looks[o].opaque = false;
    if (!medium.surface) table.looks[o].colour = glm::vec4(0.0f);
    if (medium.surface && medium.surface_colour) table.looks[o].colour = *medium.surface_colour;
  };
  for (std::size_t o = 0; o < chosen.size(); ++o) {
    if (chosen[o] == nullptr) continue;
    const Medium& medium = *chosen[o];
    fill(o, medium);
    table.medium_of[o] = static_cast<std::uint32_t>(table.solids.size());
    table.solids.push_back(terms_of(medium.extinction, medium.albedo, unit));
    table.objects.push_back(static_cast<std::uint32_t>(o));
    table.surface.push_back(medium.surface ? 1 : 0);
  }
  for (std::size_t o = 0; o < chosen.size(); ++o) {
    const auto whole = scene.objects[o].part_of;
    if (!whole || *whole >= chosen.size() || chosen[*whole] == nullptr) continue;
    table.medium_of[o] = table.medium_of[*whole];
    fill(o, *chosen[*whole]);
  }
  table.particles.reserve(settings.particles.size());
  for (const Particle& p : settings.particles) {
    table.particles.push_back(terms_of(p.extinction, p.albedo, unit));
  }
  return table;
}

}  // namespace strata::transparency
