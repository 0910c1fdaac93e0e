#pragma once

namespace strata::testkit {

/// Whether this build has AddressSanitizer or ThreadSanitizer: they are slow, keep memory that was
/// given back, and reserve more address space than any limit.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
inline constexpr bool kSanitized =
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace strata::testkit
