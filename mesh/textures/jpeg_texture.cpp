#include "mesh/textures/jpeg_texture.h"

#ifdef STRATA_HAVE_JPEG

#include <csetjmp>
#include <cstdio>
// jpeglib.h needs what <cstdio> declares.
#include <jerror.h>
#include <jpeglib.h>

namespace strata::detail {
namespace {

constexpr int kMostScans = 500;  // of a progressive picture: a small file may ask for any number

/// What libjpeg works on. Its errors jump to `back`, so the functions that call it have no locals
/// with destructors.
struct JpegJob {
  jpeg_decompress_struct picture = {};
  jpeg_error_mgr errors = {};
  jpeg_progress_mgr progress = {};
  std::jmp_buf back = {};
  const Execution* execution = nullptr;
  bool stopped = false;
  char reason[JMSG_LENGTH_MAX] = "";

  ~JpegJob() { jpeg_destroy_decompress(&picture); }
};

JpegJob& job_of(j_common_ptr common) { return *static_cast<JpegJob*>(common->client_data); }

[[noreturn]] void jump(j_common_ptr common) {
  (*common->err->format_message)(common, job_of(common).reason);
  std::longjmp(job_of(common).back, 1);
}

/// A picture that ends too early or holds nonsense is refused; other warnings are not heeded.
void heed(j_common_ptr common, int level) {
  const int code = common->err->msg_code;
  if (level < 0 &&
      (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE)) {
    jump(common);
  }
}

void watch(j_common_ptr common) {
  JpegJob& job = job_of(common);
  job.stopped = job.execution->stop.stop_requested();
  const bool endless = job.picture.input_scan_number > kMostScans;
  if (endless) {
    std::snprintf(job.reason, sizeof job.reason, "it has more than %d scans", kMostScans);
  }
  if (job.stopped || endless) std::longjmp(job.back, 1);
}

bool read_header(JpegJob& job, const unsigned char* bytes, unsigned long size) {
  job.picture.err = jpeg_std_error(&job.errors);
  job.errors.error_exit = jump;
  job.errors.emit_message = heed;
  job.progress.progress_monitor = watch;
  job.picture.client_data = &job;
  if (setjmp(job.back)) return false;
  jpeg_create_decompress(&job.picture);
  job.picture.progress = &job.progress;
  jpeg_mem_src(&job.picture, bytes, size);
  jpeg_read_header(&job.picture, TRUE);
  const bool four =
      job.picture.jpeg_color_space == JCS_CMYK || job.picture.jpeg_color_space == JCS_YCCK;
  job.picture.out_color_space = four ? JCS_CMYK : JCS_EXT_RGBA;
  return true;
}

/// Decodes all rows into 4 bytes a texel.
bool read_rows(JpegJob& job, unsigned char* texels) {
  if (setjmp(job.back)) return false;
  jpeg_start_decompress(&job.picture);
  while (job.picture.output_scanline < job.picture.output_height) {
    unsigned char* row =
        texels + std::size_t{4} * job.picture.output_width * job.picture.output_scanline;
    jpeg_read_scanlines(&job.picture, &row, 1);
  }
  jpeg_finish_decompress(&job.picture);
  return true;
}

/// Inks to light, as programs without a colour profile do it. Adobe's programs, which mark their
/// files, write paper as 255, others as 0.
void make_light(std::vector<glm::u8vec4>& texels, bool adobe) {
  for (glm::u8vec4& at : texels) {
    if (!adobe) at = glm::u8vec4(255) - at;
    const auto times_black = [&](int ink) {
      return static_cast<std::uint8_t>((ink * at.w + 127) / 255);
    };
    at = {times_black(at.x), times_black(at.y), times_black(at.z), 255};
  }
}

}  // namespace

Result<Texture> read_jpeg(const std::string& name, std::string_view bytes,
                          const Execution& execution) {
  JpegJob job;
  job.execution = &execution;
  const auto failure = [&]() -> tl::unexpected<Error> {
    if (job.stopped) return fail(ErrorCode::kCancelled, "{}: stopped", name);
    return fail(job.errors.msg_code == JERR_OUT_OF_MEMORY ? ErrorCode::kLimit : ErrorCode::kInput,
                "{}: the JPEG cannot be decoded: {}", name, static_cast<const char*>(job.reason));
  };
  if (!read_header(job, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size())) {
    return failure();
  }
  const std::uint64_t width = job.picture.image_width, height = job.picture.image_height;
  // The coefficients of a progressive picture are held: 2 bytes a sample.
  const auto samples = static_cast<std::uint64_t>(job.picture.num_components);
  const std::uint64_t each = 4 + (jpeg_has_multiple_scans(&job.picture) ? 2 * samples : 0);
  if (auto good = check_texture_size(name, width, height, each * width * height, execution);
      !good) {
    return tl::unexpected(good.error());
  }
  Texture texture;
  texture.name = name;
  texture.width = static_cast<int>(width);
  texture.height = static_cast<int>(height);
  texture.texels.resize(width * height);
  if (!read_rows(job, &texture.texels.front().x)) return failure();
  if (job.picture.out_color_space == JCS_CMYK) {
    make_light(texture.texels, job.picture.saw_Adobe_marker != 0);
  }
  return texture;
}

}  // namespace strata::detail

#else

namespace strata::detail {

Result<Texture> read_jpeg(const std::string& name, std::string_view, const Execution&) {
  return fail(ErrorCode::kUsage, "{}: this build reads no JPEG (libjpeg62-turbo-dev was missing)",
              name);
}

}  // namespace strata::detail

#endif
