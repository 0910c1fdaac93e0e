// The only file of transparency/ that sees OpenEXR.

#include "strata/transparency/write_image.h"

#ifdef STRATA_HAVE_OPENEXR
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>

#include <exception>
#include <new>

#include "core/atomic_file.h"
#endif

namespace strata::transparency {

#ifdef STRATA_HAVE_OPENEXR

Result<void> write_exr(const Image& image, const std::string& path) {
  if (path == "-") {
    return fail(ErrorCode::kUsage, "OpenEXR files cannot be written to standard output");
  }
  try {
    auto file = AtomicFile::create(path);
    if (!file) return tl::unexpected(file.error());
    {
      Imf::Header header(image.width, image.height);
      header.compression() = Imf::ZIP_COMPRESSION;
      Imf::FrameBuffer buffer;
      // OpenEXR reads through the pointer only, but its type does not say so.
      char* first = const_cast<char*>(reinterpret_cast<const char*>(image.pixels.data()));
      const std::size_t row = sizeof(glm::vec4) * static_cast<std::size_t>(image.width);
      std::size_t offset = 0;
      for (const char* channel : {"R", "G", "B", "A"}) {
        header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
        buffer.insert(channel, Imf::Slice(Imf::FLOAT, first + offset, sizeof(glm::vec4), row));
        offset += sizeof(float);
      }
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

Result<void> write_exr(const Image&, const std::string& path) {
  return fail(ErrorCode::kUsage, "{}: this build has no OpenEXR", path);
}

#endif

}  // namespace strata::transparency
