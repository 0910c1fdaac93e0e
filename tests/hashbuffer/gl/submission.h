#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "strata/gl/buffer.h"
#include "strata/gl/shader_program.h"
#include "strata/raster/gl/producer.h"
#include "tests/hashbuffer/store_support.h"

namespace strata::glsl {
extern const gl::GlslPiece tests_hashbuffer_gl_submit_comp;
}

namespace strata::test {

/// A producer that gives the fragments of a list, one invocation each.
class GlSubmission : public gl::Producer {
 public:
  GlSubmission(int width, int height, const std::vector<Fragment>& fragments)
      : width_(static_cast<std::uint32_t>(width)), height_(static_cast<std::uint32_t>(height)) {
    set(fragments);
  }
  void set(const std::vector<Fragment>& fragments) {
    struct Word4 {
      std::uint32_t pixel, depth, payload, unused;
    };
    std::vector<Word4> words;
    for (const Fragment& f : fragments) {
      words.push_back({static_cast<std::uint32_t>(f.y) * width_ + static_cast<std::uint32_t>(f.x),
                       f.depth, f.payload, 0});
    }
    count_ = static_cast<std::uint32_t>(words.size());
    auto buffer = gl::Buffer::of(std::span<const Word4>(words));
    if (buffer) buffer_ = std::move(*buffer);
  }
  [[nodiscard]] std::uint32_t width() const override { return width_; }
  [[nodiscard]] std::uint32_t height() const override { return height_; }
  [[nodiscard]] Result<void> draw(const gl::StoreGlsl& store, gl::PixelRows) override {
    gl::Program* program = nullptr;
    for (auto& [text, made] : programs_) {
      if (text == store) program = &made;
    }
    if (!program) {
      const gl::GlslPiece pieces[] = {store.piece(), glsl::tests_hashbuffer_gl_submit_comp};
      auto made = gl::Program::compute(pieces, store.settings);
      if (!made) return tl::unexpected(made.error());
      programs_.emplace_back(store, std::move(*made));
      program = &programs_.back().second;
    }
    buffer_.bind(0);
    const auto& defines = store.settings.defines;
    const bool serial = std::any_of(defines.begin(), defines.end(),
                                    [](const auto& d) { return d.first == "STORE_SERIAL"; });
    // llvmpipe ends loops after 65535 rounds of an invocation: so few fragments each, if one does
    // all.
    const std::uint32_t step = serial ? 8 : std::max(count_, 1u);
    for (std::uint32_t first = 0; first < count_; first += step) {
      program->set("first", first);
      program->set("end", std::min(first + step, count_));
      const gl::Groups groups = gl::groups_for(serial ? 1 : count_, 64);
      program->dispatch(groups.x, groups.y);
      gl::storage_barrier();
    }
    return {};
  }

 private:
  std::uint32_t width_, height_, count_ = 0;
  gl::Buffer buffer_;
  std::vector<std::pair<gl::StoreGlsl, gl::Program>> programs_;
};

}  // namespace strata::test
