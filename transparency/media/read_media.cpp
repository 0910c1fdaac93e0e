#include "strata/transparency/media/media.h"

namespace strata::transparency {

Result<MediaSettings> read_media(const std::string& path) {
  return fail(ErrorCode::kUsage, "{}: media files cannot be read yet", path);
}

}  // namespace strata::transparency
