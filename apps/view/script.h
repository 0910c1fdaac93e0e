#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"

// What drives the window without a person: a command a line.

namespace strata::view {

enum class Action {
  kOrbit,       ///< dx dy: numbers, pixels
  kPan,         ///< dx dy
  kZoom,        ///< steps [x y]
  kDrag,        ///< word: left, right or middle; x0 y0 x1 y1 [moves]
  kClick,       ///< x y: as the left button
  kKey,         ///< word: a key with its modifiers, such as ctrl+4
  kView,        ///< word: a named view, centre, all or reset
  kCamera,      ///< word: as --camera
  kSaveCamera,  ///< word: the file
  kLoadCamera,  ///< word: the file
  kProjection,  ///< word: as --projection
  kSection,     ///< word: off, flip, or a plane as --cut
  kSlice,       ///< word: off, or as VoxelScene::slice_of() has it
  kThreshold,   ///< word: file, or numbers: one
  kVoxels,      ///< word: a style of voxels
  kGhosts,      ///< on
  kEdges,
  kAxes,
  kPanels,
  kHeat,       ///< word: off, wall, ray (or thickness) or depth
  kHeatRange,  ///< numbers: low, high; none: from the values
  kDistance,   ///< x y x y: prints it
  kAngle,
  kRadius,  ///< x y
  kThickness,
  kSize,
  kClear,     ///< all measurements
  kBox,       ///< on: prints its size
  kGrid,      ///< on: prints its spacing
  kScaleBar,  ///< on: prints its length
  kTicks,
  kOpacity,    ///< word: off, or numbers: 0 to 1
  kTechnique,  ///< word: as --technique has it
  kMedia,      ///< on: whether those of --media are shown
  kScheme,     ///< word: a colour scheme
  kHide,       ///< word: which solids
  kShow,
  kColour,  ///< word: which solids; value: a colour as parse_colour() has it, or none
  kPick,    ///< x y: prints what is there
  kReload,
  kCancel,  ///< the load that is under way
  kResize,  ///< width height
  kWait,    ///< until the picture is whole; numbers: seconds at least. word "reload": until a file
            ///< has changed and is loaded
  kScreenshot,  ///< word: the file; of the whole window
  kPicture,     ///< word: the file; of the picture alone
  kExport,      ///< word: the file; numbers: voxels along the longest side
  kOpen,        ///< word: a file that gets a tab of its own
  kTab,         ///< word: next, previous, close or a number from 1
  kUndo,
  kRedo,
  kParameter,   ///< word: the parameter's name; value
  kParameters,  ///< word: reset, load or save; value: the file; more: the set
  kNumbers,     ///< a line of JSON to standard output
  kMaterial,    ///< word: a material
  kEdit,        ///< opens the picked solid in the editor
  kLook,        ///< word: dark or light
  kConsole,     ///< on
  kKeys,        ///< on: the overlay of all keys
  kDialog,      ///< word: a folder, or off
  kMessages,    ///< to standard output
  kScroll,      ///< x y, and word "shift"
  kPrint,       ///< word: to standard output
  kStats,       ///< a line of JSON to standard output
  kResetStats,
  kQuit
};

struct ScriptCommand {
  int line = 0;
  std::string_view name;  ///< as scripts have it; lives as long as the program
  Action action = Action::kWait;
  std::vector<double> numbers;
  std::string word, value, more;
  bool on = false;
};

/// Reads a script. Words are separated by blanks; one that holds blanks is put in double quotes. A
/// line that begins with #, and what follows a # that stands alone, is a comment.
/// @return kUsage naming file:line
Result<std::vector<ScriptCommand>> parse_script(std::string_view text, const std::string& name);

/// The same from a file, or from standard input for "-". @return kInput, kUsage
Result<std::vector<ScriptCommand>> read_script(const std::string& path);

/// The commands with a line of explanation each, for --help.
[[nodiscard]] std::string script_help();

}  // namespace strata::view
