#include "strata/core/result.h"

namespace strata {

tl::unexpected<Error> fail_with(ErrorCode code, fmt::string_view text, fmt::format_args args) {
  return tl::unexpected<Error>(Error{code, fmt::vformat(text, args)});
}

}  // namespace strata
