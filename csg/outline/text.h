#pragma once

#include <string>

#include "csg/outline/outline.h"
#include "csg/outline/segments.h"
#include "strata/core/result.h"

namespace strata::csg {

struct TextOptions {
  std::string text, font, direction, language, script, halign = "left", valign = "baseline";
  double size = 10, spacing = 1;
  Segments segments;
};
/// Text as OpenSCAD sets it (FreeType, HarfBuzz, fontconfig). The spacing of letters is that of
/// versions after 2021.01; older versions set letters 2.3 % closer. `missing` gets the name of a
/// requested font that is not installed and was replaced. @return kInput when no font at all is
/// found; kLimit beyond 1 MiB of text or 20 million points; the job's error
Result<Outline> make_text(const TextOptions& options, std::string& missing,
                          OutlineJob* job = nullptr);

}  // namespace strata::csg
