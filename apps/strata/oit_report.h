#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "strata/transparency/media/media.h"
#include "strata/transparency/stream/frame.h"
#include "strata/transparency/techniques.h"

namespace strata::apps {

/// What a technique did.
struct OitResult {
  const OitChoice* choice = nullptr;
  std::string left_out;  ///< why it was not drawn; empty: it was
  std::string path;      ///< of its picture; empty: none is written
  transparency::Costs costs;
  transparency::Difference difference;  ///< from the exact reference
  double seconds = 0.0;                 ///< wall clock of a picture, the median of several
  double technique_seconds = 0.0;       ///< of all threads, without making the stream
  /// For the page: PNG files, the picture and its differences from the reference.
  std::vector<std::uint8_t> picture, heat;
};

/// All that `strata oit` can tell of a run.
struct OitOutcome {
  std::uint64_t objects = 0, triangles = 0;
  Camera camera;
  float opacity = 1.0f;
  const transparency::Technique* reference = nullptr;
  int runs = 1;  ///< timed
  std::vector<OitResult> results;
  std::vector<std::uint8_t> reference_picture;   ///< for the page: a PNG file
  std::vector<transparency::SolidReport> media;  ///< with --media: the solids that hold one
  double read_ms = 0, prepare_ms = 0, draw_ms = 0, write_ms = 0;
};

/// "exact", "bounded" or "random".
[[nodiscard]] std::string_view accuracy_word(transparency::Accuracy accuracy);

/// The table of techniques for people.
[[nodiscard]] std::string list_text();
/// The table of techniques for programs.
[[nodiscard]] std::string list_json();

/// For programs, as docs/json.md says.
[[nodiscard]] std::string oit_json(const OitCommand& command, const OitOutcome& outcome,
                                   const Session& session);

}  // namespace strata::apps
