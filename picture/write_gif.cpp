// The only file that sees giflib. Each picture has a colour table of its own.

#include "picture/animation_formats.h"

#ifdef STRATA_HAVE_GIF
#include <gif_lib.h>

#include <array>
#include <bit>
#include <cmath>
#include <new>
#include <optional>

#include "core/atomic_file.h"
#include "picture/colour_table.h"
#endif

namespace strata {

#ifdef STRATA_HAVE_GIF

namespace {

class GifWriter final : public AnimationWriter {
 public:
  GifWriter(AtomicFile file, const AnimationOptions& options)
      : file_(std::move(file)), options_(options) {}
  GifWriter(const GifWriter&) = delete;
  GifWriter& operator=(const GifWriter&) = delete;
  ~GifWriter() override {
    if (gif_ != nullptr) EGifCloseFile(gif_, nullptr);
  }

  Result<void> add(const Picture& picture) override try {
    if (auto small = check_side(file_.path(), picture, 65535); !small) return small;
    PictureBox box = whole_box(picture);
    if (gif_ == nullptr) {
      if (auto begun = begin(picture); !begun) return begun;
    } else if (!options_.transparent) {
      box = changed_box(before_, picture);
    }
    if (auto done = put(picture, box); !done) return done;
    ++added_;
    if (!options_.transparent) before_ = picture;
    return {};
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for a picture of {} x {} pixels",
                file_.path(), picture.width, picture.height);
  }

  Result<void> finish() override {
    int error = 0;
    const int closed = EGifCloseFile(gif_, &error);
    gif_ = nullptr;
    if (written_ && !*written_) return *written_;
    if (closed == GIF_ERROR) return failure(error);
    return file_.commit();
  }

 private:
  static int write(GifFileType* gif, const GifByteType* bytes, int count) {
    auto* self = static_cast<GifWriter*>(gif->UserData);
    self->written_ = self->file_.write(bytes, static_cast<std::size_t>(count));
    return *self->written_ ? count : 0;
  }

  Result<void> begin(const Picture& picture) {
    int error = 0;
    gif_ = EGifOpen(this, write, &error);
    if (gif_ == nullptr) return failure(error);
    EGifSetGifVersion(gif_, true);
    constexpr int kColourBits = 8;
    bool good = EGifPutScreenDesc(gif_, picture.width, picture.height, kColourBits, 0, nullptr) !=
                GIF_ERROR;
    // Netscape's extension: it plays for ever.
    const std::array<GifByteType, 3> forever{1, 0, 0};
    good = good && EGifPutExtensionLeader(gif_, APPLICATION_EXT_FUNC_CODE) != GIF_ERROR &&
           EGifPutExtensionBlock(gif_, 11, "NETSCAPE2.0") != GIF_ERROR &&
           EGifPutExtensionBlock(gif_, static_cast<int>(forever.size()), forever.data()) !=
               GIF_ERROR &&
           EGifPutExtensionTrailer(gif_) != GIF_ERROR;
    return good ? Result<void>() : failure(gif_->Error);
  }

  Result<void> put(const Picture& picture, const PictureBox& box) {
    const int width = box.right - box.left, height = box.bottom - box.top;
    std::vector<Rgba> pixels;
    pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int v = box.top; v < box.bottom; ++v) {
      const auto row = picture.pixels.begin() + static_cast<std::ptrdiff_t>(v) * picture.width;
      pixels.insert(pixels.end(), row + box.left, row + box.right);
    }
    IndexedPicture indexed = index_picture(pixels, width, options_.transparent);

    GraphicsControlBlock control{};
    control.DisposalMode = options_.transparent ? DISPOSE_BACKGROUND : DISPOSE_DO_NOT;
    control.DelayTime = time_of(added_ + 1) - time_of(added_);
    control.TransparentColor = options_.transparent ? indexed.transparent : NO_TRANSPARENT_COLOR;
    std::array<GifByteType, 4> bytes{};
    EGifGCBToExtension(&control, bytes.data());
    struct Free {
      void operator()(ColorMapObject* map) const { GifFreeMapObject(map); }
    };
    const int colours =
        static_cast<int>(std::bit_ceil(std::max<std::size_t>(2, indexed.colours.size())));
    const std::unique_ptr<ColorMapObject, Free> map(GifMakeMapObject(colours, nullptr));
    if (!map) throw std::bad_alloc();
    for (std::size_t i = 0; i < indexed.colours.size(); ++i) {
      const Rgba& colour = indexed.colours[i];
      map->Colors[i] = {colour.r, colour.g, colour.b};
    }
    bool good =
        EGifPutExtension(gif_, GRAPHICS_EXT_FUNC_CODE, static_cast<int>(bytes.size()),
                         bytes.data()) != GIF_ERROR &&
        EGifPutImageDesc(gif_, box.left, box.top, width, height, false, map.get()) != GIF_ERROR;
    for (int v = 0; good && v < height; ++v) {
      good = EGifPutLine(gif_, indexed.indices.data() + static_cast<std::ptrdiff_t>(v) * width,
                         width) != GIF_ERROR;
    }
    return good ? Result<void>() : failure(gif_->Error);
  }

  /// Hundredths of a second from the beginning.
  [[nodiscard]] int time_of(int frame) const {
    return static_cast<int>(std::lround(frame * 100.0 / options_.fps));
  }
  Result<void> failure(int error) {
    if (written_ && !*written_) return *written_;
    const char* why = GifErrorString(error);
    return fail(ErrorCode::kOutput, "{}: giflib: {}", file_.path(),
                why != nullptr ? why : "unknown error");
  }

  AtomicFile file_;
  AnimationOptions options_;
  GifFileType* gif_ = nullptr;
  std::optional<Result<void>> written_;  ///< the last write
  Picture before_;
  int added_ = 0;
};

}  // namespace

Result<std::unique_ptr<AnimationWriter>> create_gif(const std::string& path,
                                                    const AnimationOptions& options) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  return std::make_unique<GifWriter>(*std::move(file), options);
}

#else

Result<std::unique_ptr<AnimationWriter>> create_gif(const std::string& path,
                                                    const AnimationOptions&) {
  return tl::unexpected(check_animation_name(path).error());
}

#endif

}  // namespace strata
