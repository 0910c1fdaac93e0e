#pragma once

#include <string>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// Settings of write_ldi_exr().
struct LdiExrOptions {
  /// Every crossing as a point sample; default: solid intervals as volume samples.
  bool samples = false;
};

/// Writes sorted depth lists as a deep scanline OpenEXR file (ZIPS, pixel (u, v) at x = u, y = v).
/// A compositor sees tidy deep pixels; reading back gives exactly the same lists.
///
/// - A (FLOAT): 1 where solid lies behind it, 0 for a mark; with samples always 1.
/// - Z (FLOAT): depth of the front crossing, or of the crossing.
/// - ZBack (FLOAT; intervals only): depth where this piece ends.
/// - id (UINT): triangle of that crossing.
/// - facing (UINT; samples only): 0 entering, 1 leaving.
/// - strata.depth, strata.payload (UINT): exact depth and [exit:1 | triangle:31] of that crossing.
/// - strata.depthBack, strata.payloadBack (UINT; intervals only): the same of the back crossing;
///   a depthBack of 4294967295 says that there is none.
///
/// Intervals: a walk along the list counts the winding number, +1 on entering, -1 on leaving. Each
/// crossing begins a sample, except the one that brings the winding number from 1 to 0: it is the
/// back crossing of the sample before it. So a ray through a clean solid has one sample an
/// interval, [entry, exit]. Where solids overlap, the pieces between crossings are samples that
/// adjoin, all with A = 1. Crossings after which the winding number is 0 or less (holes, inverted
/// parts) are marks: ZBack = Z, A = 0. An entry that nothing follows has ZBack = Z, A = 1.
///
/// Z and ZBack are depths times strata.depth_scale, the world length of a lattice step along the
/// ray (1 if world_from_image is not affine, or the lengths do not fit in a float). So that pixels
/// are tidy without exception (sorted, no overlap: deepImageState = TIDY), equal depths of one list
/// are pushed one floating-point step apart. The exact depths are those of the strata channels.
///
/// Attributes: strata.version (int, 1), strata.mode (string, "intervals" or "samples"),
/// strata.depth_limit (int, depths are below it), strata.depth_scale (double, Z = depth in lattice
/// steps times this), strata.world_from_image (m44d for row vectors, as EXR has it: world =
/// (u + 0.5, v + 0.5, depth, 1) * M).
///
/// Memory: a few rows of samples; for standard output, pipes and devices the whole file.
/// @return kUsage when `image` is not valid (check_layered_depth_image) or this build has no
///   OpenEXR, kOutput naming the path, kLimit, kCancelled
Result<void> write_ldi_exr(const std::string& path, const LayeredDepthImage& image,
                           const LdiExrOptions& options = {}, const Execution& execution = {});

/// Reads what write_ldi_exr wrote, in either mode. Files of others are refused; do not read files
/// that you do not trust, OpenEXR 3.1 has known defects. Sizes are checked against the length of
/// the file and the memory limit before anything is allocated.
/// @return kInput naming the file and the row, kLimit, kUsage without OpenEXR, kCancelled
Result<LayeredDepthImage> read_ldi_exr(const std::string& path, const Execution& execution = {});

/// Settings of write_ldi_npz().
struct LdiNpzOptions {
  bool compress = false;  ///< deflate the arrays (numpy.savez_compressed) instead of storing them
};

/// Writes sorted depth lists as a NumPy archive, for `numpy.load`:
///
/// | array            | type | shape                | content                                     |
/// |------------------|------|----------------------|---------------------------------------------|
/// | offsets          | <u8  | (height * width + 1) | list of (u, v): offsets[v * width + u] ...  |
/// | depth            | <u4  | (n)                  | exact depth of crossing i                   |
/// | payload          | <u4  | (n)                  | [exit:1 | triangle:31]                      |
/// | world_from_image | <f8  | (4, 4)               | M @ (u + 0.5, v + 0.5, depth, 1)            |
/// | shape            | <i8  | (2)                  | height, width                               |
/// | depth_limit      | <u4  | ()                   | depths are below it                         |
///
/// @return kUsage when `image` is not valid or this build has no libzip, kOutput, kLimit,
///   kCancelled
Result<void> write_ldi_npz(const std::string& path, const LayeredDepthImage& image,
                           const LdiNpzOptions& options = {}, const Execution& execution = {});

/// Reads such an archive, written here or by numpy.savez. Sizes are checked as for EXR.
/// @return kInput naming the file and the array, kLimit, kUsage without libzip, kCancelled
Result<LayeredDepthImage> read_ldi_npz(const std::string& path, const Execution& execution = {});

/// Whether width and height are in [1, 65536], depth_limit in [1, 2^24], offsets rise from 0 to the
/// number of items, and every list is sorted with depths below the limit.
/// @return kUsage naming the pixel
Result<void> check_layered_depth_image(const LayeredDepthImage& image);

/// Writes a picture of depth lists as an 8-bit greyscale PNG, as an X-ray film would show the
/// solid: 255 (1 - exp(-2 t / t_max)) / (1 - exp(-2)), where t is the length of the ray inside
/// (winding number > 0) and t_max the longest in the image. Pixel (u, v) is column u; v grows
/// upwards.
/// @return kUsage when the image has no pixels, kOutput naming the path, kLimit
Result<void> write_xray_png(const std::string& path, const LayeredDepthImage& image);

}  // namespace strata
