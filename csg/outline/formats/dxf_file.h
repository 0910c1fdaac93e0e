#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <map>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"

namespace strata::csg {

/// One group of a DXF file: a code, and a value as text.
struct DxfGroup {
  int code = 0;
  std::string_view value;
  std::uint32_t line = 0;  ///< line of the value, from 1
};

/// An entity: its type, and its groups in order. A POLYLINE has its VERTEX entities as `parts`.
struct DxfEntity {
  std::string_view type;
  std::string_view layer;
  std::uint32_t line = 0;
  std::vector<DxfGroup> groups;
  std::vector<DxfEntity> parts;
};

struct DxfBlock {
  glm::dvec2 base{0};
  std::vector<DxfEntity> entities;
};

/// The entities of a DXF file in text form, and its blocks by name.
struct DxfFile {
  std::vector<DxfEntity> entities;
  std::map<std::string, DxfBlock, std::less<>> blocks;
};

/// Parses `text`, which must outlive the result. Messages call the file `name`. @return kInput
/// naming file and line; kCancelled
Result<DxfFile> parse_dxf(std::string_view text, const std::string& name,
                          const std::stop_token& stop = {});

/// Reads a number as DXF writes it. @return kInput naming file and line: not a finite number
Result<double> dxf_number(const DxfGroup& group, const std::string& name);

}  // namespace strata::csg
