#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <string_view>

#include "strata/core/depth_list.h"

// The record of a hash table cell, after: Lefebvre, Hornus, Lasram, "HA-Buffer: Coherent Hashing
// for single-pass A-buffer", 2013, sections 3 and 4.
// We differ: the payload is stored inverted, so that one unsigned maximum orders records by
// (depth, payload) ascending; the split is a policy, since 8 bits of age end at 255 layers.

namespace strata {

/// Largest depth a record holds: 24 bits.
inline constexpr std::uint32_t kRecordDepthMax = (1u << 24) - 1;

/// Maps a normalized depth, 0 at the near plane and 1 at the far plane, to [0, kRecordDepthMax] by
/// floor(u * (2^24 - 1)). Values outside are clamped; NaN counts as far. (With a factor of 2^24, u
/// = 1 would overflow into the age.)
[[nodiscard]] constexpr std::uint32_t record_depth(double u) {
  if (!(u < 1.0)) return kRecordDepthMax;
  if (!(u > 0.0)) return 0;
  return static_cast<std::uint32_t>(u * kRecordDepthMax);
}

/// The inverse of record_depth(): the middle of the normalized depths that become `depth`, at most
/// half a step (3e-8) from the one that was given, and 1 for kRecordDepthMax. record_depth() of it
/// is `depth` again. @pre depth <= kRecordDepthMax
[[nodiscard]] constexpr double normalized_depth(std::uint32_t depth) {
  return std::min((depth + 0.5) / kRecordDepthMax, 1.0);
}

/// A record [age | nearness | payload], most significant bits first, in one unsigned word.
///
/// - age: the index of the probe at which the record sits, counted from 1. Age 0 is an empty cell,
///   which is the word 0.
/// - nearness: kDepthMax - depth, so that larger is nearer.
/// - payload: the surface tag of DepthItem, [exit:1 | triangle:31], squeezed into kPayloadBits and
///   stored as its complement. A policy with fewer than 32 bits keeps the exit bit and the low
///   bits of the triangle; one without payload keeps nothing.
///
/// Of two words the larger one is older, then nearer, then of smaller payload.
template <class WordType, int age_bits, int payload_bits>
struct BasicRecord {
  using Word = WordType;                             ///< unsigned
  static constexpr int kAgeBits = age_bits;          ///< width of the age
  static constexpr int kNearnessBits = 24;           ///< width of the nearness
  static constexpr int kPayloadBits = payload_bits;  ///< width of the payload; may be 0
  static_assert(kAgeBits + kNearnessBits + kPayloadBits == 8 * sizeof(Word));

  static constexpr unsigned kAgeMax = (1u << kAgeBits) - 1;    ///< layers a pixel, at most
  static constexpr std::uint32_t kDepthMax = kRecordDepthMax;  ///< largest depth
  static constexpr Word kEmpty = 0;                            ///< an empty cell
  /// The difference of two words whose ages differ by 1.
  static constexpr Word kAgeUnit = Word{1} << (kNearnessBits + kPayloadBits);

  /// True if no bit of the payload is lost; always true for records without payload.
  [[nodiscard]] static constexpr bool payload_fits(std::uint32_t payload) {
    return kPayloadBits == 0 || widen(narrow(payload)) == payload;
  }

  /// @pre 1 <= age <= kAgeMax and payload_fits(payload); other payload bits are cut off. Depths
  /// beyond kDepthMax are clamped to it.
  [[nodiscard]] static constexpr Word pack(unsigned age, std::uint32_t depth,
                                           std::uint32_t payload) {
    const std::uint32_t nearness = kDepthMax - std::min(depth, kDepthMax);
    return static_cast<Word>(kAgeUnit * age | Word{nearness} << kPayloadBits |
                             static_cast<Word>(kPayloadMask - narrow(payload)));
  }

  /// The age in a record; 0 in an empty cell.
  [[nodiscard]] static constexpr unsigned age(Word record) {
    return static_cast<unsigned>(record >> (kNearnessBits + kPayloadBits));
  }
  /// The depth as it was given to pack().
  [[nodiscard]] static constexpr std::uint32_t depth(Word record) {
    return kDepthMax - (static_cast<std::uint32_t>(record >> kPayloadBits) & kDepthMax);
  }
  /// The payload as it was given to pack(), as far as the policy keeps it.
  [[nodiscard]] static constexpr std::uint32_t payload(Word record) {
    return widen(static_cast<std::uint32_t>(kPayloadMask - (record & kPayloadMask)));
  }
  /// The crossing in a record.
  [[nodiscard]] static constexpr DepthItem item(Word record) {
    return DepthItem(std::uint64_t{depth(record)} << 32 | payload(record));
  }
  /// The item that a fragment of this depth and payload becomes in a list.
  [[nodiscard]] static constexpr DepthItem item(std::uint32_t depth, std::uint32_t payload) {
    return DepthItem(std::uint64_t{std::min(depth, kDepthMax)} << 32 | widen(narrow(payload)));
  }
  /// The record without its age: the larger rank is the one nearer to the front of the list.
  [[nodiscard]] static constexpr Word rank(Word record) {
    return static_cast<Word>(record & (kAgeUnit - 1));
  }
  /// @pre age(record) < kAgeMax
  [[nodiscard]] static constexpr Word with_next_age(Word record) {
    return static_cast<Word>(record + kAgeUnit);
  }

 private:
  static constexpr std::uint32_t kPayloadMask =
      static_cast<std::uint32_t>((std::uint64_t{1} << kPayloadBits) - 1);

  static constexpr std::uint32_t narrow(std::uint32_t payload) {
    if constexpr (kPayloadBits == 0) {
      return 0;
    } else {
      return payload >> 31 << (kPayloadBits - 1) | (payload & kPayloadMask >> 1);
    }
  }
  static constexpr std::uint32_t widen(std::uint32_t stored) {
    if constexpr (kPayloadBits == 0) {
      return 0;
    } else {
      return stored >> (kPayloadBits - 1) << 31 | (stored & kPayloadMask >> 1);
    }
  }
};

/// [age:8 | nearness:24]: depth only, at most 255 layers a pixel. Equal depths are equal records,
/// and both stay.
struct Record32 : BasicRecord<std::uint32_t, 8, 0> {
  /// For messages.
  static constexpr std::string_view kName = "Record32 [age:8|nearness:24]";
  /// Advice where lists are too long.
  static constexpr std::string_view kDeeper = "use Record64Deep [age:10|nearness:24|payload:30]";
};

/// [age:8 | nearness:24 | payload:32]: at most 255 layers a pixel.
struct Record64 : BasicRecord<std::uint64_t, 8, 32> {
  /// For messages.
  static constexpr std::string_view kName = "Record64 [age:8|nearness:24|payload:32]";
  /// Advice where lists are too long.
  static constexpr std::string_view kDeeper = "use Record64Deep [age:10|nearness:24|payload:30]";
};

/// [age:10 | nearness:24 | payload:30]: at most 1023 layers a pixel; triangles below 2^29.
struct Record64Deep : BasicRecord<std::uint64_t, 10, 30> {
  /// For messages.
  static constexpr std::string_view kName = "Record64Deep [age:10|nearness:24|payload:30]";
  /// Advice where lists are too long.
  static constexpr std::string_view kDeeper = "use CountScanStore, whose lists may have any length";
};

/// Requirements of a hash buffer on a record policy.
template <class R>
concept RecordPolicy = std::unsigned_integral<typename R::Word> &&
    requires(typename R::Word word, unsigned age, std::uint32_t value) {
  { R::pack(age, value, value) } -> std::same_as<typename R::Word>;
  { R::with_next_age(word) } -> std::same_as<typename R::Word>;
  { R::rank(word) } -> std::same_as<typename R::Word>;
  { R::age(word) } -> std::same_as<unsigned>;
  { R::depth(word) } -> std::same_as<std::uint32_t>;
  { R::payload(word) } -> std::same_as<std::uint32_t>;
  { R::item(word) } -> std::same_as<DepthItem>;
  { R::item(value, value) } -> std::same_as<DepthItem>;
  { R::kAgeMax } -> std::convertible_to<unsigned>;
  { R::kName } -> std::convertible_to<std::string_view>;
  { R::kDeeper } -> std::convertible_to<std::string_view>;
};

static_assert(RecordPolicy<Record32> && RecordPolicy<Record64> && RecordPolicy<Record64Deep>);

}  // namespace strata
