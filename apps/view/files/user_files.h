#pragma once

#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// What the window keeps from one run to the next, in the folders that the XDG base directory
// specification names. A file that cannot be read or written is no fault.

namespace strata::view {

/// Folders of the user's files; empty where neither XDG_..._HOME nor HOME is set.
struct UserFolders {
  std::string config;  ///< $XDG_CONFIG_HOME/strata, else ~/.config/strata
  std::string state;   ///< $XDG_STATE_HOME/strata, else ~/.local/state/strata
};
[[nodiscard]] UserFolders user_folders();

inline constexpr std::size_t kMostRecentFiles = 10;

/// The files that were opened last, the last one first; without those that are not there any more.
[[nodiscard]] std::vector<std::string> recent_files(const UserFolders& folders);

/// Puts a file in front of the list. Names with line breaks are not kept.
void remember_file(const UserFolders& folders, const std::string& path);

/// The look that was chosen last, a line of a file; empty: none.
[[nodiscard]] std::string remembered_look(const UserFolders& folders);
void remember_look(const UserFolders& folders, std::string_view look);

/// The size that the window had when it was closed last, in the window system's units; none: it
/// was never closed, or the file says no size of a window.
[[nodiscard]] std::optional<glm::ivec2> remembered_size(const UserFolders& folders);
void remember_size(const UserFolders& folders, const glm::ivec2& size);

}  // namespace strata::view
