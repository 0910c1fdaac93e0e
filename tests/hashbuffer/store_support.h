#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "hashbuffer/random.h"
#include "strata/core/depth_list.h"
#include "strata/hashbuffer/record.h"
#include "tests/support/sanitized.h"

namespace strata::test {

struct Fragment {
  int x = 0, y = 0;
  std::uint32_t depth = 0;
  std::uint32_t payload = 0;
};

/// Payload bits that every record policy with a payload keeps.
inline constexpr std::uint32_t kCommonPayload = 0x9fffffffu;

/// `count` fragments at random pixels. Few depths and payloads make many ties and duplicates.
inline std::vector<Fragment> random_fragments(Random& random, int width, int height,
                                              std::size_t count, std::uint32_t depths = 1u << 24,
                                              std::uint32_t payloads = 0) {
  std::vector<Fragment> fragments(count);
  for (Fragment& fragment : fragments) {
    fragment.x = static_cast<int>(random.below(static_cast<std::uint64_t>(width)));
    fragment.y = static_cast<int>(random.below(static_cast<std::uint64_t>(height)));
    fragment.depth = static_cast<std::uint32_t>(random.below(depths));
    fragment.payload = payloads == 0 ? static_cast<std::uint32_t>(random.next()) & kCommonPayload
                                     : static_cast<std::uint32_t>(random.below(payloads));
  }
  return fragments;
}

inline void shuffle(Random& random, std::vector<Fragment>& fragments) {
  for (std::size_t i = fragments.size(); i > 1; --i) {
    std::swap(fragments[i - 1], fragments[random.below(i)]);
  }
}

/// The oracle: sorts everything.
template <class Record>
LayeredDepthImage sort_everything(int width, int height, const std::vector<Fragment>& fragments) {
  struct Entry {
    std::uint64_t pixel;
    DepthItem item;
    auto operator<=>(const Entry&) const = default;
  };
  std::vector<Entry> entries;
  for (const Fragment& f : fragments) {
    const std::uint32_t payload = Record::kPayloadBits == 0 ? 0 : f.payload;
    const std::uint32_t depth = std::min(f.depth, (1u << 24) - 1);
    entries.push_back({static_cast<std::uint64_t>(f.y) * static_cast<std::uint64_t>(width) +
                           static_cast<std::uint64_t>(f.x),
                       DepthItem(std::uint64_t{depth} << 32 | payload)});
  }
  std::sort(entries.begin(), entries.end());
  LayeredDepthImage image;
  image.width = width;
  image.height = height;
  image.depth_limit = 1u << 24;
  image.offsets.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) + 1, 0);
  for (const Entry& entry : entries) {
    ++image.offsets[entry.pixel + 1];
    image.items.push_back(entry.item);
  }
  for (std::size_t i = 1; i < image.offsets.size(); ++i) image.offsets[i] += image.offsets[i - 1];
  return image;
}

/// Each list of `image` cut to its first `count` items.
inline LayeredDepthImage cut_lists(const LayeredDepthImage& image, std::size_t count) {
  LayeredDepthImage result = image;
  result.items.clear();
  for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
    for (std::uint64_t i = image.offsets[pixel]; i < image.offsets[pixel + 1]; ++i) {
      if (i - image.offsets[pixel] < count) result.items.push_back(image.items[i]);
    }
    result.offsets[pixel + 1] = result.items.size();
  }
  return result;
}

/// Inserts a fragment, without its payload where the sink keeps none.
template <class Sink>
void insert_into(Sink& sink, const Fragment& f) {
  if constexpr (requires { sink.insert(f.x, f.y, f.depth); }) {
    sink.insert(f.x, f.y, f.depth);
  } else {
    sink.insert(f.x, f.y, f.depth, f.payload);
  }
}

/// Inserts the fragments from `threads` threads that start together and yield now and then.
class Submission {
 public:
  explicit Submission(const std::vector<Fragment>& fragments, int threads = 1)
      : fragments_(&fragments), threads_(static_cast<std::size_t>(threads)) {}

  template <class Sink>
  void operator()(Sink& sink) const {
    if (threads_ == 1) {
      for (const Fragment& f : *fragments_) insert_into(sink, f);
      return;
    }
    std::vector<std::jthread> pool;
    for (std::size_t thread = 0; thread < threads_; ++thread) {
      pool.emplace_back([this, thread, &sink] {
        Random random(thread);
        for (std::size_t i = thread; i < fragments_->size(); i += threads_) {
          insert_into(sink, (*fragments_)[i]);
          if (random.below(64) == 0) std::this_thread::yield();
        }
      });
    }
  }

 private:
  const std::vector<Fragment>* fragments_;
  std::size_t threads_;
};

template <class Sink>
void submit(Sink& sink, const std::vector<Fragment>& fragments, int threads = 1) {
  const Submission submission(fragments, threads);
  submission(sink);
}

}  // namespace strata::test
