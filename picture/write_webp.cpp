// The only file that sees libwebp. Animations are lossless: edges of solids are what lossy ones
// blur.

#include "picture/animation_formats.h"

#ifdef STRATA_HAVE_WEBP
#include <webp/encode.h>
#include <webp/mux.h>

#include <cmath>

#include "core/atomic_file.h"
#endif

namespace strata {

#ifdef STRATA_HAVE_WEBP

namespace {

class WebpWriter final : public AnimationWriter {
 public:
  WebpWriter(AtomicFile file, const AnimationOptions& options)
      : file_(std::move(file)), options_(options) {}
  WebpWriter(const WebpWriter&) = delete;
  WebpWriter& operator=(const WebpWriter&) = delete;
  ~WebpWriter() override { WebPAnimEncoderDelete(encoder_); }

  Result<void> add(const Picture& picture) override {
    if (auto small = check_side(file_.path(), picture, WEBP_MAX_DIMENSION); !small) return small;
    if (encoder_ == nullptr) {
      if (auto begun = begin(picture); !begun) return begun;
    }
    WebPPicture frame;
    if (WebPPictureInit(&frame) == 0) return failure("this libwebp is another than at build time");
    frame.use_argb = 1;
    frame.width = picture.width;
    frame.height = picture.height;
    static_assert(sizeof(Rgba) == 4);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(picture.pixels.data());
    const int stride = picture.width * 4;
    const bool held = options_.transparent ? WebPPictureImportRGBA(&frame, bytes, stride) != 0
                                           : WebPPictureImportRGBX(&frame, bytes, stride) != 0;
    const bool added = held && WebPAnimEncoderAdd(encoder_, &frame, time_of(added_), &config_) != 0;
    const bool memory = !held || frame.error_code == VP8_ENC_ERROR_OUT_OF_MEMORY;
    WebPPictureFree(&frame);
    if (!added) {
      return fail(memory ? ErrorCode::kLimit : ErrorCode::kOutput, "{}: libwebp: {}", file_.path(),
                  memory ? "out of memory" : WebPAnimEncoderGetError(encoder_));
    }
    ++added_;
    return {};
  }

  Result<void> finish() override {
    WebPData data;
    WebPDataInit(&data);
    if (WebPAnimEncoderAdd(encoder_, nullptr, time_of(added_), nullptr) == 0 ||
        WebPAnimEncoderAssemble(encoder_, &data) == 0) {
      return failure(WebPAnimEncoderGetError(encoder_));
    }
    auto done = file_.write(data.bytes, data.size);
    WebPDataClear(&data);
    return done ? file_.commit() : done;
  }

 private:
  /// Milliseconds from the beginning.
  [[nodiscard]] int time_of(int frame) const {
    return static_cast<int>(std::lround(frame * 1000.0 / options_.fps));
  }
  Result<void> begin(const Picture& picture) {
    WebPAnimEncoderOptions settings;
    if (WebPAnimEncoderOptionsInit(&settings) == 0 || WebPConfigInit(&config_) == 0) {
      return failure("this libwebp is another than at build time");
    }
    settings.anim_params.loop_count = 0;  // for ever
    constexpr int kEffort = 2;            // of 9; 6 takes twice the time and saves a twentieth
    WebPConfigLosslessPreset(&config_, kEffort);
    config_.exact = 1;
    encoder_ = WebPAnimEncoderNew(picture.width, picture.height, &settings);
    if (encoder_ == nullptr) return failure("out of memory");
    return {};
  }
  tl::unexpected<Error> failure(const char* why) {
    return fail(ErrorCode::kOutput, "{}: libwebp: {}", file_.path(), why);
  }

  AtomicFile file_;
  AnimationOptions options_;
  WebPConfig config_{};
  WebPAnimEncoder* encoder_ = nullptr;
  int added_ = 0;
};

}  // namespace

Result<std::unique_ptr<AnimationWriter>> create_webp(const std::string& path,
                                                     const AnimationOptions& options) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  return std::make_unique<WebpWriter>(*std::move(file), options);
}

#else

Result<std::unique_ptr<AnimationWriter>> create_webp(const std::string& path,
                                                     const AnimationOptions&) {
  return tl::unexpected(check_animation_name(path).error());
}

#endif

}  // namespace strata
