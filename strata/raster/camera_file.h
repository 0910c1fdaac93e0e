#pragma once

#include <span>
#include <string>
#include <vector>

#include "strata/core/result.h"
#include "strata/raster/view.h"

namespace strata {

/// A camera at a time of a film.
struct TimedCamera {
  double time = 0;  ///< seconds
  Camera camera;    ///< at that time
};

/// Reads a camera file: lines of text, `#` begins a comment.
///
///   target 0 0 5          the point in the middle of the picture
///   rotation 60 0 30      degrees, as Camera::rotation; or  eye 70 -120 90
///   distance 140          of the eye from the target
///   fov 22.5              degrees
///   projection perspective|orthographic
///
/// A line `time 2.5` begins another camera, which has the values of the one before it where it says
/// nothing. Times rise. @return kInput naming file and line
Result<std::vector<TimedCamera>> read_cameras(const std::string& path);

/// Writes a camera file of one camera; read_cameras() gives the same numbers. @return kOutput
Result<void> write_camera(const Camera& camera, const std::string& path);

/// A camera between those of a film: eye and target move along curves through theirs (cubic, with
/// the slopes of Catmull and Rom), the field of view changes evenly, and up turns evenly unless the
/// horizon is level at both ends: then it stays level. Outside of the times it stands still. @pre
/// there is one at least, and times rise
[[nodiscard]] Camera camera_at(std::span<const TimedCamera> path, double time);

}  // namespace strata
