// Fragments of one's own: four overlapping discs, drawn by two threads, as sorted depth lists.
#include <cstdint>
#include <cstdio>
#include <thread>

#include <strata/lists.h>

namespace {

struct Disc {
  int x, y, radius;
  double depth;  // 0 near, 1 far
};
constexpr Disc kDiscs[] = {
    {30, 30, 20, 0.9}, {40, 30, 20, 0.1}, {35, 38, 20, 0.5}, {35, 30, 8, 0.1}};

// Draws every second disc from `first` on; the payload is the disc's number.
template <class Sink>
void draw(Sink& sink, std::uint32_t first) {
  for (std::uint32_t i = first; i < 4; i += 2) {
    const Disc& disc = kDiscs[i];
    for (int y = disc.y - disc.radius; y <= disc.y + disc.radius; ++y) {
      for (int x = disc.x - disc.radius; x <= disc.x + disc.radius; ++x) {
        const int dx = x - disc.x, dy = y - disc.y;
        if (dx * dx + dy * dy > disc.radius * disc.radius) continue;
        sink.insert(x, y, strata::record_depth(disc.depth), i);
      }
    }
  }
}

}  // namespace

int main() {
  auto lists = strata::PayloadLists::create(64, 64);
  if (!lists) return std::fprintf(stderr, "%s\n", lists.error().message.c_str()), 1;
  const auto report = lists->build([](auto& sink) {
    std::jthread second([&] { draw(sink, 1); });
    draw(sink, 0);
  });
  if (!report) return std::fprintf(stderr, "%s\n", report.error().message.c_str()), 1;

  std::printf("%llu fragments\n", static_cast<unsigned long long>(report->fragments));
  lists->for_each(35, 32, [](strata::Fragment fragment) {
    std::printf("depth %.1f, disc %u\n", strata::normalized_depth(fragment.depth),
                fragment.payload);
  });
}
