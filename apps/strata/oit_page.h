#pragma once

#include <string>

#include "apps/commands/commands.h"
#include "apps/strata/oit_report.h"
#include "strata/csg/picture/picture.h"
#include "strata/transparency/stream/frame.h"

namespace strata::apps {

/// Where a picture differs from the reference, by the largest difference of a channel: from what is
/// just visible in 8 bits, light, to 1, dark, on a logarithmic scale. @pre the images have one size
[[nodiscard]] csg::Picture heat_map(const transparency::Image& image,
                                    const transparency::Image& reference);

/// A page of HTML that compares the techniques of a run, complete in itself. The outcome has the
/// pictures.
[[nodiscard]] std::string oit_page(const OitCommand& command, const OitOutcome& outcome,
                                   int threads);

}  // namespace strata::apps
