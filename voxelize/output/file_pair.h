#pragma once

#include <string>
#include <string_view>

#include "core/letters.h"

namespace strata {

/// A header and its data, beside each other under one stem. (Internal to voxelize/.)
struct FilePair {
  std::string head, data;

  /// @param path  either of them; of another extension it is that of the data
  FilePair(const std::string& path, std::string_view head_extension,
           std::string_view data_extension)
      : head(path), data(path) {
    const std::string name = lower_case(path);
    if (name.ends_with(head_extension)) {
      data.replace(path.size() - head_extension.size(), std::string::npos, data_extension);
    } else if (name.ends_with(data_extension)) {
      head.replace(path.size() - data_extension.size(), std::string::npos, head_extension);
    } else {
      head += head_extension;
    }
  }
  /// As the header names it.
  [[nodiscard]] std::string data_name() const { return data.substr(data.rfind('/') + 1); }
};

}  // namespace strata
