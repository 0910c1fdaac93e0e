#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "apps/view/console.h"
#include "apps/view/files/file_watch.h"
#include "apps/view/files/parameter_sets.h"
#include "apps/view/files/user_files.h"
#include "apps/view/measure/measurements.h"
#include "apps/view/scene/camera_control.h"
#include "apps/view/scene/document.h"
#include "apps/view/scene/exporter.h"
#include "apps/view/scene/loader.h"
#include "apps/view/scene/part_numbers.h"
#include "apps/view/scene/render_thread.h"
#include "apps/view/scene/view_history.h"
#include "apps/view/view_options.h"

// All of the window that is not pixels: what is shown, what the mouse and keys do, what is under
// way. Knows no window system and no GL.

namespace strata::view {

enum class MouseButton : std::uint8_t { kLeft, kRight, kMiddle };

/// Times and numbers for the statistics panel, and for who measures.
struct Statistics {
  std::uint64_t frames = 0;  ///< pictures shown
  double coarse_ms = 0;      ///< of the last coarse picture
  int divisor = 1;           ///< how coarse it was
  double whole_ms = 0;       ///< of the last whole picture with one sample a pixel
  double smooth_ms = 0;      ///< of the last one with more
  int samples = 1;           ///< of that
  double prepare_ms = 0;     ///< of the last time the tree changed
  double reaction_ms = 0;    ///< from the last input to its (coarse) picture on the screen
  double largest_reaction_ms = 0;
  std::uint64_t reactions = 0;
  double whole_latency_ms = 0;  ///< from the last input to the whole picture on the screen
  double present_ms = 0;        ///< of drawing panels and handing the window over
  csg::DrawReport report;       ///< of the last whole picture
  std::uint64_t longest_list = 0;
};

/// One scene of the window, and how it is looked at. Kept here while another one is shown.
struct Tab {
  csg::SceneInput input;
  std::string title;
  std::shared_ptr<const Model> model;
  Looks looks;
  std::optional<csg::SectionPlane> last_section;
  Camera camera, start_camera;
  bool camera_set = false;
  ViewHistory history;
  ParameterValues values;                ///< that differ from the program's
  std::vector<std::string> definitions;  ///< openscad's options without those of the values
  std::unique_ptr<FileWatch> watch;
};

class Viewer {
 public:
  using Clock = std::chrono::steady_clock;

  /// Begins to load. @param wake called from other threads when tick() has something to do
  Viewer(const ViewOptions& options, std::unique_ptr<Renderer> renderer,
         const std::function<void()>& wake);

  /// The size of the picture in pixels. (0, 0): nothing is shown.
  void set_viewport(const glm::ivec2& size);
  [[nodiscard]] const glm::ivec2& viewport() const { return viewport_; }

  /// Takes what threads have made, looks at files, and asks for a picture when one is due.
  void tick();
  /// What was taken by tick() is on the screen now. @param present_ms of drawing the window
  void presented(double present_ms);
  /// Nothing is loading.
  [[nodiscard]] bool loaded() const { return loader_.idle() && !load_due_ && to_open_.empty(); }
  /// Nothing is under way at all, and the screen shows the whole picture.
  [[nodiscard]] bool settled() const;

  /// The picture to show; null before the first one. `serial` changes with it.
  [[nodiscard]] const Frame* frame() const { return frame_ ? &*frame_ : nullptr; }
  [[nodiscard]] std::uint64_t frame_serial() const { return frame_serial_; }

  // Input. Pixels of the picture.
  void mouse_button(MouseButton button, bool down, const glm::dvec2& at, bool shift, bool control);
  void mouse_move(const glm::dvec2& at);
  /// A wheel, or two fingers on a touch pad: zooms; with shift or sideways it moves.
  void scroll(const glm::dvec2& steps, const glm::dvec2& at, bool shift);
  /// A key by its name, `ctrl+shift+v`, `p`, `escape`. False: it means nothing here.
  bool key(std::string_view name);
  [[nodiscard]] bool dragging() const { return drag_ != Drag::kNone; }

  // What panels and scripts set. Each asks for a new picture.
  [[nodiscard]] const Camera& camera() const { return camera_; }
  void set_camera(const Camera& camera);
  void look(std::string_view name);  ///< a named view, `centre`, `all`, `reset`
  void orbit_by(const glm::dvec2& pixels);
  void pan_by(const glm::dvec2& pixels);
  void zoom_by(double steps, std::optional<glm::dvec2> at = {});
  [[nodiscard]] const Looks& looks() const { return looks_; }
  void set_looks(Looks looks);
  void set_hidden(std::uint32_t solid, bool hidden);
  void set_section(std::optional<csg::SectionPlane> plane);
  void flip_section();
  void toggle_section();
  /// The least and largest offset at which the section cuts anything.
  [[nodiscard]] glm::dvec2 section_range() const;
  /// Where the section can be taken hold of, and where its arrow ends, in pixels.
  struct Handle {
    glm::dvec2 at, tip;
  };
  [[nodiscard]] std::optional<Handle> section_handle() const;
  [[nodiscard]] const csg::PictureOptions& picture_options() const { return picture_; }
  void set_edges(bool on);
  void set_scheme(const csg::ColourScheme* scheme);
  [[nodiscard]] Heat heat() const { return heat_; }
  void set_heat(Heat heat);
  [[nodiscard]] const std::optional<SeenThrough>& see_through() const { return see_through_; }
  void set_see_through(std::optional<SeenThrough> how);  ///< none: opaque
  /// What media the scene has, whether they are shown or not; null: none.
  [[nodiscard]] const std::shared_ptr<const transparency::MediaSettings>& media() const {
    return media_;
  }
  /// Sets the media and shows them.
  void set_media(std::shared_ptr<const transparency::MediaSettings> media);
  void reload();
  void cancel_load();
  /// Back to where the view was before its last change, and forth again. False: there is none.
  bool undo();
  bool redo();
  [[nodiscard]] const ViewHistory& history() const { return history_; }
  /// The hand rests: undo comes back to what is shown now.
  void rest() {
    if (camera_set_) history_.rest(state());
  }

  // Files. Each that is opened here has a tab of its own; those of the command line share one.
  /// Opens files one after the other. A folder becomes the one that the dialog shows.
  void open_files(const std::vector<std::string>& paths);
  [[nodiscard]] const std::vector<Tab>& tabs() const { return tabs_; }
  [[nodiscard]] std::size_t tab() const { return tab_; }
  void show_tab(std::size_t index);
  void next_tab(int by);
  void close_tab(std::size_t index);
  /// The file that is being read, or what the window is called; empty: nothing is open.
  [[nodiscard]] std::string loading_name() const;
  [[nodiscard]] std::string title() const;
  [[nodiscard]] const UserFolders& folders() const { return folders_; }

  // The parameters of a program (see customizer.h). A change is read in after a short while.
  [[nodiscard]] const std::vector<Parameter>& parameters() const;
  [[nodiscard]] const ParameterValues& parameter_values() const { return values_; }
  void set_parameter(const Parameter& parameter, ParameterValue value);
  void reset_parameters();
  Result<void> load_parameters(const std::string& file, const std::string& set);
  Result<void> save_parameters(const std::string& file, const std::string& set) const;

  // Numbers of the part, measured in the background: without hidden solids, whatever the section.
  [[nodiscard]] const std::optional<Result<PartNumbers>>& numbers() const { return numbers_; }
  [[nodiscard]] bool measuring() const { return measurer_.busy() || numbers_due_; }
  /// Large scenes are measured when asked. True: this one waits for that.
  [[nodiscard]] bool measuring_waits() const { return numbers_wait_; }
  void measure_now();
  [[nodiscard]] const Material& material() const { return *material_; }
  void set_material(const Material& material) { material_ = &material; }

  /// What the scene and errors said.
  [[nodiscard]] const std::vector<ConsoleLine>& console() const { return console_; }
  /// Opens a place in the user's editor. @return kUsage: there is none, or it cannot be started
  Result<void> edit(const TextPlace& place) const;
  [[nodiscard]] bool can_edit() const { return !editor_.empty(); }
  /// The file and line of the picked solid.
  [[nodiscard]] std::optional<TextPlace> picked_place() const;
  /// Begins to write what is seen to a file: a mesh or voxels; of a picture wants_picture becomes
  /// the name. @return kUsage: nothing is loaded, an export is under way, an unknown format, or the
  /// file is one that was read
  Result<void> start_export(const std::string& path, int resolution);
  void cancel_export() { exporter_.cancel(); }
  void pick(const glm::ivec2& pixel);
  /// Measures below a pixel with the board's tool; picking() until that is done.
  void measure_at(const glm::ivec2& pixel);
  /// Chooses a tool; the same one again puts it away.
  void take_up(Tool tool);
  [[nodiscard]] MeasureBoard& board() { return board_; }
  [[nodiscard]] const MeasureBoard& board() const { return board_; }
  /// The range of the colours of thicknesses; none: from the values.
  [[nodiscard]] const std::optional<glm::dvec2>& heat_range() const { return heat_range_; }
  void set_heat_range(std::optional<glm::dvec2> range);
  /// Tints a solid, or none; the last pick is forgotten unless it is to be kept.
  void select(std::optional<std::uint32_t> solid, bool keep_pick = false);

  // What panels show.
  bool show_axes = true, show_panels = true, show_console = false, show_keys = false;
  bool light_look = false;
  std::optional<std::string> dialog;  ///< the folder that the file dialog shows; none: it is closed
  bool wants_quit = false, wants_screenshot = false;  ///< by keys
  std::string wants_picture;                          ///< a file; empty: none
  [[nodiscard]] const Model* model() const { return model_.get(); }
  /// A file of voxels is shown, which has no surfaces and no solids.
  [[nodiscard]] bool shows_voxels() const { return model_ && model_->voxels; }
  /// What the window is to tell for a moment; empty: nothing.
  std::string wants_told;
  [[nodiscard]] const ViewOptions& options() const { return options_; }
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  void reset_statistics();
  [[nodiscard]] bool loading() const { return loader_.busy(); }
  [[nodiscard]] double load_progress() const { return loader_.progress(); }
  [[nodiscard]] double load_seconds() const { return loader_.seconds(); }
  [[nodiscard]] bool exporting() const { return exporting_; }
  [[nodiscard]] double export_progress() const { return exporter_.progress(); }
  [[nodiscard]] std::uint64_t exports() const { return exports_; }  ///< that ended, well or not
  /// What the last one says. @pre there was one
  [[nodiscard]] const Result<std::string>& exported() const { return exported_; }
  [[nodiscard]] const std::string& load_error() const { return load_error_; }
  /// Takes the errors off the picture.
  void forget_errors() {
    load_error_.clear();
    draw_error_.clear();
  }
  [[nodiscard]] ErrorCode load_error_code() const { return load_error_code_; }
  [[nodiscard]] const std::string& draw_error() const { return draw_error_; }
  [[nodiscard]] std::uint64_t loads() const { return loads_; }  ///< that ended, well or not
  /// The last pick, until the next one or a reload; empty while one is under way.
  [[nodiscard]] const std::optional<Picked>& picked() const { return picked_; }
  [[nodiscard]] bool picking() const { return picking_; }
  [[nodiscard]] std::string describe(const Picked& picked) const;
  [[nodiscard]] std::string solid_name(std::uint32_t solid) const;
  /// What drew the last picture, and why not something better.
  [[nodiscard]] const std::string& drawn_by() const { return drawn_by_; }
  /// Anything between the mouse and the screen: the window should look often.
  [[nodiscard]] bool busy() const { return !settled() || loading() || exporting_; }

 private:
  enum class Drag : std::uint8_t { kNone, kOrbit, kPan, kZoom, kSection };

  /// A new picture is due. @param input a hand asked for it, and waits
  void change(bool looks, bool input = true);
  void take_model(std::shared_ptr<const Model> model);
  void take_frame(Frame frame);
  void take_load(Result<std::shared_ptr<const Model>> loaded);
  void take_pick(Result<Picked> picked);
  void drop_load();
  void first_camera();
  void start_load(const csg::SceneInput& input);
  void open_next();
  void add_tab(csg::SceneInput input);
  void store_tab();
  void restore_tab(std::size_t index);
  void say_all();
  void tick_numbers();
  void first_parameters();
  [[nodiscard]] ViewState state() const {
    return {camera_, looks_.section, looks_.hidden, looks_.voxels};
  }
  void take_state(const ViewState& state);

  ViewOptions options_;
  Camera camera_, start_camera_;
  bool camera_set_ = false;
  csg::PictureOptions picture_;
  Heat heat_ = Heat::kOff;
  std::optional<glm::dvec2> heat_range_;
  MeasureBoard board_;
  bool guides_asked_ = false;  ///< by the last request
  std::optional<SeenThrough> see_through_;
  std::shared_ptr<const transparency::MediaSettings> media_;
  Looks looks_;
  std::optional<csg::SectionPlane> last_section_;
  std::shared_ptr<const Model> model_;
  std::shared_ptr<const Arrangement> arrangement_;
  glm::ivec2 viewport_{0};

  bool due_ = false, arrange_due_ = false;
  std::optional<Clock::time_point> load_due_;  ///< parameters have changed
  std::deque<std::string> to_open_;
  std::optional<csg::SceneInput> opening_;  ///< is being read, and becomes a tab if it can be
  std::vector<Tab> tabs_;                   ///< the one that is shown is stored when it is left
  std::size_t tab_ = 0;
  ViewHistory history_;
  Clock::time_point last_change_{};
  ParameterValues values_;
  std::vector<std::string> definitions_;
  UserFolders folders_ = user_folders();
  std::string editor_;
  std::vector<ConsoleLine> console_;
  bool quiet_cancel_ = false;  ///< of the load that is under way nothing is told
  bool numbers_due_ = false, numbers_wait_ = false;
  std::vector<std::uint8_t> measured_hidden_;
  std::optional<float> measured_threshold_;
  std::optional<Result<PartNumbers>> numbers_;
  const Material* material_ = materials().data();
  std::optional<Clock::time_point> changed_at_;  ///< the first change not yet asked for
  bool changed_by_input_ = false;
  struct Asked {
    std::uint64_t number;
    Clock::time_point at;
    bool input = false;
  };
  std::deque<Asked> asked_;  ///< whose (coarse) picture has not been shown
  std::optional<Asked> whole_asked_;
  std::uint64_t last_asked_ = 0;
  bool frame_presented_ = true;

  std::optional<Frame> frame_;
  std::uint64_t frame_serial_ = 0;
  Statistics statistics_;
  std::string load_error_, draw_error_, drawn_by_;
  ErrorCode load_error_code_ = ErrorCode::kInternal;
  std::uint64_t loads_ = 0;
  std::optional<Picked> picked_;
  bool picking_ = false, centre_on_pick_ = false;

  Drag drag_ = Drag::kNone;
  glm::dvec2 mouse_{0}, pressed_at_{0};
  bool moved_ = false;
  MouseButton button_ = MouseButton::kLeft;
  Clock::time_point last_click_{};
  glm::dvec2 last_click_at_{-1000};

  std::unique_ptr<FileWatch> watch_;
  Clock::time_point looked_{};
  bool exporting_ = false;
  std::uint64_t exports_ = 0;
  Result<std::string> exported_;
  Exporter exporter_;
  PartMeasurer measurer_;
  Loader loader_;
  RenderThread thread_;
};

/// A key or a gesture, and what it does.
struct KeyHelp {
  std::string_view name, what;
};
/// Keys and mouse, for people.
[[nodiscard]] std::vector<KeyHelp> key_list();
/// The same, a line each, for --help.
[[nodiscard]] std::string key_help();

}  // namespace strata::view
