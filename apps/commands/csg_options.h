#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/commands/scene_options.h"
#include "strata/core/result.h"

namespace strata::apps {

/// The options of `strata csg` as words. Empty: not given.
struct CsgWords {
  SceneWords scene;
  std::string expression, size, camera, projection, scheme, samples, quality, background, ids,
      turntable, path_frames, fps, camera_file, depth, measure;
  std::string crease, occlusion, caps;
  std::string preview, render, shown, frames, export_format, summary, summary_file, csg_limit;
  std::vector<std::string> cuts;
  bool view_all = false, auto_centre = false, edges = false, transparent = false, shadow = false;
};

/// What to say at the end of a message about the name of an output that the command does not write:
/// "; strata mesh writes meshes". Empty: no command writes such files.
[[nodiscard]] std::string other_writer(const std::string& path);

/// Whether a picture, or with `depth` a file of distances, can be written under a name: .png, .exr
/// or a stream. @param asked_by what the sentence begins with: "--ids " @return kUsage
Result<void> check_picture_name(std::string_view asked_by, const std::string& path,
                                bool depth = false);

/// Reads the words that all commands that draw have in common: camera, look, sections. The common
/// part, inputs, output and report of `request` are set. @return kUsage
Result<void> read_picture_options(const CsgWords& words, PictureRequest& request);

/// Reads the words into `command`, as read_picture_options() and those of `strata csg` alone.
/// @return kUsage
Result<void> read_csg_options(const CsgWords& words, CsgCommand& command);

/// `white`, `#ffffff` or `#fff`, sRGB. @param must begins the message: "--background must be"
/// @return kUsage
Result<glm::u8vec3> parse_colour(std::string_view must, std::string_view text);

/// A camera as OpenSCAD's --camera has it: seven numbers, target, rotation and distance, or six,
/// eye and target. @return kUsage
Result<Camera> parse_camera(std::string_view text);

/// p(erspective) or o(rthographic), in OpenSCAD's spellings. @return kUsage
Result<Projection> parse_projection(std::string_view text);

/// A section plane: `x=5`, `z<10`, `y>0` or `nx,ny,nz,d`. @return kUsage
Result<csg::SectionPlane> parse_section(std::string_view text);

}  // namespace strata::apps
