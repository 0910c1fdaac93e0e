#pragma once

#include <array>
#include <string>

#include "apps/view/gl/canvas.h"
#include "apps/view/gl/file_dialog.h"
#include "apps/view/viewer.h"

namespace strata::view {

/// All that lies beside and on the picture, drawn with Dear ImGui.
class Panels {
 public:
  /// Fonts and colours. @pre ImGui has a context. @param scale of the screen: 2 for twice the dots
  Panels(float scale, std::string gl_renderer);

  /// Where the picture goes in a window of that size.
  [[nodiscard]] Area picture_area(const glm::ivec2& window, const Viewer& viewer) const;

  /// @pre ImGui::NewFrame() was called
  void draw(Viewer& viewer, const glm::ivec2& window, const Area& area);

  /// A line that is shown for some seconds.
  void tell(std::string text);

 private:
  static constexpr float kStatusHeight = 26;

  [[nodiscard]] float side_width(const glm::ivec2& window) const;
  void side(Viewer& viewer, const glm::ivec2& window);
  /// Pixels; 0: there are no tabs, or no console.
  [[nodiscard]] int tabs_height(const Viewer& viewer) const;
  [[nodiscard]] int console_height(const Viewer& viewer) const;
  static void recent(Viewer& viewer);
  void files(Viewer& viewer);
  void tab_bar(Viewer& viewer, const Area& area);
  void start(Viewer& viewer, const Area& area);
  static void numbers(Viewer& viewer);
  void parameters(Viewer& viewer);
  void parameter_files(Viewer& viewer);
  void console(Viewer& viewer, const Area& area);
  void keys(Viewer& viewer, const glm::ivec2& window) const;
  void open_editor(const Viewer& viewer, const TextPlace& place);
  static void voxels(Viewer& viewer);
  void camera(Viewer& viewer);
  static void transparency(Viewer& viewer);
  void section(Viewer& viewer);
  void look(Viewer& viewer);
  void surfaces(Viewer& viewer);
  void picked(Viewer& viewer);
  void solids(Viewer& viewer);
  void exports(Viewer& viewer);
  void statistics(const Viewer& viewer);
  void status(const Viewer& viewer, const glm::ivec2& window);
  void waiting(double seconds) const;
  void messages(Viewer& viewer, const Area& area);
  void trouble(Viewer& viewer, const Area& area);
  void loading(Viewer& viewer, const Area& area);
  void axes(const Viewer& viewer, const Area& area);
  void handle(const Viewer& viewer, const Area& area);
  void mark(const Viewer& viewer, const Area& area);
  void legend(const Viewer& viewer, const Area& area);
  void guides(const Viewer& viewer, const Area& area);
  static void measure(Viewer& viewer);
  static void heat_range(Viewer& viewer);

  float scale_;
  bool light_ = false;
  FileDialog dialog_;
  std::size_t drawn_tab_ = 0;
  std::array<char, 128> set_name_{};
  std::string gl_renderer_;
  std::array<char, 128> filter_{};
  std::array<char, 512> export_name_{"part.3mf"};
  int export_voxels_ = kExportVoxels;
  std::string told_;
  Viewer::Clock::time_point told_at_{};
  std::uint64_t hidden_warnings_ = 0;  ///< of the load of that number
};

}  // namespace strata::view
