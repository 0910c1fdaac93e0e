#include "strata/transparency/media/media.h"

namespace strata::transparency {

Result<MediaRendering> render_media(const Scene&, const View&, const MediaSettings&,
                                    const FrameOptions&, const Execution&) {
  return fail(ErrorCode::kUsage, "media cannot be rendered yet");
}

}  // namespace strata::transparency
