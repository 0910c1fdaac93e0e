#include "strata/picture/animation.h"

#include <algorithm>
#include <bit>
#include <new>
#include <string_view>

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "picture/animation_formats.h"

namespace strata {
namespace {

bool ends_in(std::string_view text, std::string_view extension) {
  if (text.size() <= extension.size()) return false;
  return std::equal(extension.rbegin(), extension.rend(), text.rbegin(), [](char a, char b) {
    return a == (b >= 'A' && b <= 'Z' ? static_cast<char>(b - 'A' + 'a') : b);
  });
}

/// A folder of 0000.png, 0001.png, ...
class PngFolder final : public AnimationWriter {
 public:
  PngFolder(AtomicFolder folder, const AnimationOptions& options)
      : folder_(std::move(folder)), execution_{options.threads} {
    const std::size_t digits = fmt::formatted_size("{}", options.frames - 1);
    digits_ = std::max(4, static_cast<int>(digits));
  }
  Result<void> add(const Picture& picture) override {
    return write_png(picture,
                     fmt::format("{}/{:0{}}.png", folder_.temporary_path(), next_++, digits_),
                     execution_);
  }
  Result<void> finish() override { return folder_.commit(); }

 private:
  AtomicFolder folder_;
  Execution execution_;
  int digits_, next_ = 0;
};

}  // namespace

Result<std::unique_ptr<AnimationWriter>> create_png_folder(const std::string& path,
                                                           const AnimationOptions& options) {
  auto folder = AtomicFolder::create(path);
  if (!folder) return tl::unexpected(folder.error());
  return std::make_unique<PngFolder>(*std::move(folder), options);
}

PictureBox changed_box(const Picture& before, const Picture& after) {
  PictureBox box{after.width, after.height, 0, 0};
  const auto width = static_cast<std::size_t>(after.width);
  for (int v = 0; v < after.height; ++v) {
    const Rgba* a = before.pixels.data() + static_cast<std::size_t>(v) * width;
    const Rgba* b = after.pixels.data() + static_cast<std::size_t>(v) * width;
    const auto first = static_cast<int>(std::mismatch(a, a + width, b).first - a);
    if (first == after.width) continue;
    int last = after.width - 1;
    while (a[last] == b[last]) --last;
    box.left = std::min(box.left, first);
    box.right = std::max(box.right, last + 1);
    box.top = std::min(box.top, v);
    box.bottom = v + 1;
  }
  return box.bottom == 0 ? PictureBox{0, 0, 1, 1} : box;
}

Result<void> check_side(const std::string& path, const Picture& picture, int most) {
  if (std::max(picture.width, picture.height) <= most) return {};
  return fail(ErrorCode::kLimit,
              "{}: a picture of {} x {} pixels: this format has sides of up to {}", path,
              picture.width, picture.height, most);
}

Result<void> check_animation_name(const std::string& path) {
  if (path.ends_with('/') || ends_in(path, ".apng")) return {};
  if (ends_in(path, ".gif")) {
#ifndef STRATA_HAVE_GIF
    return fail(ErrorCode::kUsage, "{}: this build has no giflib (libgif-dev); .apng needs nothing",
                path);
#endif
    return {};
  }
  if (ends_in(path, ".webp")) {
#ifndef STRATA_HAVE_WEBP
    return fail(ErrorCode::kUsage,
                "{}: this build has no libwebp (libwebp-dev); .apng needs nothing", path);
#endif
    return {};
  }
  return fail(ErrorCode::kUsage,
              "{}: animations are written as .gif, .webp or .apng, or as a folder: FOLDER/", path);
}

Result<std::unique_ptr<AnimationWriter>> create_animation(const std::string& path,
                                                          const AnimationOptions& options) {
  if (auto named = check_animation_name(path); !named) return tl::unexpected(named.error());
  if (options.frames < 1) {
    return fail(ErrorCode::kUsage, "an animation of {} pictures: it must have 1 at least",
                options.frames);
  }
  const double most = ends_in(path, ".gif") ? 50 : 100;
  if (!(options.fps >= 0.1 && options.fps <= most)) {
    return fail(ErrorCode::kUsage, "{}: {} pictures a second; there must be 0.1 to {}", path,
                options.fps, most);
  }
  if (path.ends_with('/')) return create_png_folder(path, options);
  if (ends_in(path, ".gif")) return create_gif(path, options);
  if (ends_in(path, ".webp")) return create_webp(path, options);
  return create_apng(path, options);
}

}  // namespace strata
