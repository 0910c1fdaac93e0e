#include "csg/transition.h"

#include <algorithm>

namespace strata::csg {

void transitions_of(std::span<const DepthItem> crossings, std::uint32_t solid, InsideRule rule,
                    bool cut, std::vector<Transition>& transitions) {
  int sum = 0;
  for (const DepthItem item : crossings) sum += item.exit() ? -1 : 1;
  const bool unbalanced = rule == InsideRule::kParity ? sum % 2 != 0 : sum != 0;
  if (unbalanced && !cut) {
    // Partners from the front, the last entry with the next exit; what is left becomes a sheet.
    struct Span {
      std::uint32_t begin, end, first, last;
    };
    std::vector<Span> spans;
    std::vector<DepthItem> open;
    for (const DepthItem item : crossings) {
      const bool closes = rule == InsideRule::kParity ? !open.empty() : item.exit();
      if (!closes) {
        open.push_back(item);
      } else if (open.empty()) {
        spans.push_back({item.depth(), item.depth() + 1, item.triangle(), item.triangle()});
      } else {
        spans.push_back(
            {open.back().depth(), item.depth(), open.back().triangle(), item.triangle()});
        open.pop_back();
      }
    }
    for (const DepthItem item : open) {
      spans.push_back({item.depth(), item.depth() + 1, item.triangle(), item.triangle()});
    }
    std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) {
      if (a.begin != b.begin) return a.begin < b.begin;
      return a.end != b.end ? a.end < b.end : a.first < b.first;
    });
    for (std::size_t i = 0; i < spans.size();) {
      Span all = spans[i];
      for (++i; i < spans.size() && spans[i].begin <= all.end; ++i) {
        if (spans[i].end > all.end) all.end = spans[i].end, all.last = spans[i].last;
      }
      if (all.begin == all.end) continue;
      transitions.push_back({all.begin, solid, all.first, false});
      transitions.push_back({all.end, solid, all.last, true});
    }
    return;
  }
  int winding = cut ? -sum : 0;
  bool inside = is_inside(rule, winding);
  if (inside) transitions.push_back({0, solid, Transition::kNone, false});
  for (std::size_t i = 0; i < crossings.size();) {
    const std::size_t begin = i;
    const std::uint32_t depth = crossings[begin].depth();
    for (; i < crossings.size() && crossings[i].depth() == depth; ++i) {
      winding += crossings[i].exit() ? -1 : 1;
    }
    if (is_inside(rule, winding) == inside) continue;
    std::size_t turns = begin;  // the first that faces the right way
    while (turns < i && crossings[turns].exit() != inside) ++turns;
    if (turns == i) turns = begin;
    transitions.push_back({depth, solid, crossings[turns].triangle(), inside});
    inside = !inside;
  }
}

}  // namespace strata::csg
