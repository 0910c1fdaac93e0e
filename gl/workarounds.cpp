#include "gl/workarounds.h"

#include <array>

namespace strata::gl {
namespace {

bool is_llvmpipe(const Info& info) { return info.renderer.find("llvmpipe") != std::string::npos; }

struct Known {
  std::string_view name, story;
  bool (*needed)(const Info&);
};

constexpr std::array kKnown{
    Known{"loop-rounds",
          "llvmpipe silently ends the loops of an invocation after 65535 rounds in all: lists of "
          "more than 1024 items are sorted in stages, by many invocations, and threads that "
          "fill a hash table take 8000 steps",
          is_llvmpipe},
};

}  // namespace

std::vector<Workaround> choose_workarounds(const Info& info, std::string_view switches) {
  std::vector<Workaround> chosen;
  for (const Known& known : kKnown) chosen.push_back({known.name, known.story, known.needed(info)});
  while (!switches.empty()) {
    const std::size_t comma = switches.find(',');
    std::string_view word = switches.substr(0, comma);
    switches.remove_prefix(comma == std::string_view::npos ? switches.size() : comma + 1);
    bool on = true;
    if (word.starts_with('-') || word.starts_with('+')) {
      on = word.front() == '+';
      word.remove_prefix(1);
    }
    for (Workaround& workaround : chosen) {
      if (word == "all" || word == workaround.name) workaround.in_force = on;
    }
  }
  return chosen;
}

}  // namespace strata::gl
