#pragma once

#include <array>
#include <string>
#include <vector>

#include "apps/view/files/folder_listing.h"
#include "apps/view/viewer.h"

namespace strata::view {

/// Lets a person choose a file: folders, and in them what the window opens.
class FileDialog {
 public:
  /// Draws it while viewer.dialog is set. @pre ImGui::NewFrame() was called
  void draw(Viewer& viewer, float scale);

 private:
  void go(const std::string& folder);
  void entries(Viewer& viewer, float scale);

  std::string shown_;  ///< what viewer.dialog was; another one is a wish to go there
  bool open_ = false;
  std::string folder_, error_;
  std::array<char, 1024> path_{};
  std::vector<FolderEntry> entries_;
};

}  // namespace strata::view
