// The only file of csg/ that sees OpenEXR.

#include "strata/csg/picture/picture.h"

#ifdef STRATA_HAVE_OPENEXR
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>

#include <exception>
#include <limits>
#include <new>
#include <vector>

#include "core/atomic_file.h"
#endif

namespace strata::csg {

#ifdef STRATA_HAVE_OPENEXR

Result<void> write_depth_exr(const SurfaceImage& image, const View& view, const std::string& path) {
  if (path == "-") {
    return fail(ErrorCode::kUsage, "OpenEXR files cannot be written to standard output");
  }
  try {
    std::vector<float> distances(image.depth.size());
    for (std::size_t i = 0; i < distances.size(); ++i) {
      distances[i] = image.depth[i] == SurfaceImage::kNone
                         ? std::numeric_limits<float>::infinity()
                         : static_cast<float>(view.distance(image.depth[i] + 0.5));
    }
    auto file = AtomicFile::create(path);
    if (!file) return tl::unexpected(file.error());
    {
      Imf::Header header(image.width, image.height);
      header.compression() = Imf::ZIP_COMPRESSION;
      header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
      Imf::FrameBuffer buffer;
      const auto row = sizeof(float) * static_cast<std::size_t>(image.width);
      buffer.insert("Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(distances.data()),
                                    sizeof(float), row));
      Imf::OutputFile out(file->temporary_path().c_str(), header);
      out.setFrameBuffer(buffer);
      out.writePixels(image.height);
    }
    return file->commit();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for {} x {} pixels", path, image.width,
                image.height);
  } catch (const std::exception& error) {
    return fail(ErrorCode::kOutput, "{}: OpenEXR: {}", path, error.what());
  }
}

#else

Result<void> write_depth_exr(const SurfaceImage&, const View&, const std::string& path) {
  return fail(ErrorCode::kUsage, "{}: this build has no OpenEXR", path);
}

#endif

}  // namespace strata::csg
