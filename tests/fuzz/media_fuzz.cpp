// Media files, and tables of particles where the text does not begin as an object does.

#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "strata/transparency/media/media.h"
#include "tests/fuzz/input_file.h"
#include "transparency/media/particle_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  using namespace strata::transparency;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (text.starts_with('{')) {
    const InputFile file(text, ".json");
    const auto settings = read_media(file.path());
    if (!settings && settings.error().message.empty()) std::abort();
    return 0;
  }
  const InputFile file(text, ".csv");
  std::vector<Particle> particles;
  if (const auto done = read_particles(file.path(), {}, particles); !done) {
    if (!done.error().message.starts_with(file.path())) std::abort();
    return 0;
  }
  for (const Particle& p : particles) {
    if (!(p.radius > 0.0 && p.radius <= kFarthest)) std::abort();
  }
  return 0;
}
