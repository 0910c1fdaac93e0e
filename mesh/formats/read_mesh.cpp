#include "strata/mesh/formats/read_mesh.h"

#include <filesystem>
#include <new>
#include <stdexcept>
#include <system_error>

#include "mesh/archives/read_3mf_amf.h"
#include "mesh/attributes/select_parts.h"
#include "mesh/formats/format_of_content.h"
#include "mesh/formats/reader_common.h"
#include "mesh/gltf/read_gltf.h"
#include "mesh/text/input_bytes.h"
#include "mesh/text/text_scanner.h"
#ifdef STRATA_HAVE_OPENMESH
#include "mesh/formats/openmesh_reader.h"
#endif

namespace strata {
namespace {

using detail::equals_no_case;

struct NamedFormat {
  MeshFormat format;
  const char* name;
};
constexpr NamedFormat kFormats[] = {{MeshFormat::kObj, "obj"},   {MeshFormat::kStl, "stl"},
                                    {MeshFormat::kPly, "ply"},   {MeshFormat::kOff, "off"},
                                    {MeshFormat::k3mf, "3mf"},   {MeshFormat::kAmf, "amf"},
                                    {MeshFormat::kGltf, "gltf"}, {MeshFormat::kGltf, "glb"}};

Result<MeshFile> read_as(const detail::ReaderInput& input) {
  switch (input.options.format) {
    case MeshFormat::kObj:
      return detail::read_obj(input);
    case MeshFormat::kStl:
      return detail::read_stl(input);
    case MeshFormat::kPly:
      return detail::read_ply(input);
    case MeshFormat::kOff:
      return detail::read_off(input);
    case MeshFormat::kGltf:
      return detail::read_gltf_mesh(input);
    case MeshFormat::k3mf:
    case MeshFormat::kAmf:
      return fail(ErrorCode::kUsage, "{}: {} is read from files only", input.name,
                  mesh_format_name(input.options.format));
    case MeshFormat::kAuto:
      break;
  }
  return fail(ErrorCode::kUsage, "{}: no format was given", input.name);
}

/// 3MF and AMF.
Result<MeshFile> read_archive(const std::string& path, const MeshReadOptions& options,
                              const Execution& execution) {
  if (path == "-") {
    return fail(ErrorCode::kUsage, "standard input: {} is read from files only",
                mesh_format_name(options.format));
  }
  const ArchiveOptions wanted{options.attributes, options.textures, options.wants_parts()};
  auto model = (options.format == MeshFormat::k3mf ? read_3mf_model : read_amf_model)(path, wanted,
                                                                                      execution);
  if (!model) return tl::unexpected(model.error());
  MeshFile file;
  file.soup = std::move(model->soup);
  file.attributes = std::move(model->attributes);
  file.stats.warnings = std::move(model->warnings);
  file.stats.unit_metres = model->unit_metres;
  file.stats.format = mesh_format_name(options.format);
  std::error_code unknown;
  const auto bytes = std::filesystem::file_size(path, unknown);
  if (!unknown) file.stats.bytes = bytes;
  file.stats.vertices = file.soup.positions.size();
  file.stats.faces = file.stats.triangles = file.soup.triangles.size();
  return file;
}

/// Reads text that ends in a readable zero byte. No exception (std::bad_alloc) leaves this
/// function.
/// @param path  of the file; empty where there is none
/// @param file  whose bytes the text is; null: they come from elsewhere
Result<MeshFile> read_text(std::string_view text, const std::string& name, const std::string& path,
                           const MeshReadOptions& options, const Execution& execution,
                           const detail::InputBytes* file = nullptr) {
  if (text.empty()) return fail(ErrorCode::kInput, "{}: the file is empty", name);
  // The first 80 bytes of a binary STL file may be anything.
  const bool anything = (options.format == MeshFormat::kStl && detail::is_binary_stl(text)) ||
                        (options.format == MeshFormat::kGltf && is_glb(text));
  if (!anything && detail::is_wide_text(text)) {
    return fail(ErrorCode::kInput, "{}: {}", name, detail::kWideText);
  }
  const std::size_t size = text.size();
  if (!anything) text = detail::without_byte_order_mark(text);
  try {
    detail::DroppedVertices dropped;
    Result<MeshFile> result =
        read_as({text, name, options, execution, size - text.size(), path, &dropped, file});
    if (result) result->stats.bytes = size;
    if (result || result.error().code != ErrorCode::kInput) return result;
    const MeshFormat looks_like = detail::format_of_content(text);
    if (looks_like != MeshFormat::kAuto && looks_like != options.format) {
      result.error().message +=
          fmt::format(" (read as {}, but it looks like {})", mesh_format_name(options.format),
                      mesh_format_name(looks_like));
    }
    return result;
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: not enough memory for the mesh of {} bytes", name,
                text.size());
  } catch (const std::length_error&) {
    return fail(ErrorCode::kLimit, "{}: not enough memory for the mesh of {} bytes", name,
                text.size());
  }
}

/// Keeps the parts that the options name.
Result<MeshFile> selected(Result<MeshFile> read, const std::string& name,
                          const MeshReadOptions& options) {
  if (!read || options.parts.empty()) return read;
  const auto done = detail::select_parts(options.parts, name, *read);
  if (!done) return tl::unexpected(done.error());
  return read;
}

}  // namespace

MeshFormat mesh_format_named(std::string_view name) {
  for (const NamedFormat& known : kFormats) {
    if (equals_no_case(name, known.name)) return known.format;
  }
  return MeshFormat::kAuto;
}

MeshFormat mesh_format_of(std::string_view path) {
  const std::size_t dot = path.find_last_of("./");
  if (dot == std::string_view::npos || path[dot] != '.') return MeshFormat::kAuto;
  return mesh_format_named(path.substr(dot + 1));
}

MeshFormat mesh_format_of_file(const std::string& path) {
  const MeshFormat named = mesh_format_of(path);
  std::error_code ignored;  // a pipe can be read once
  if (named != MeshFormat::kAuto || !std::filesystem::is_regular_file(path, ignored)) return named;
  const auto file = detail::InputBytes::open(path, 0);
  return file ? detail::format_of_content(file->view()) : MeshFormat::kAuto;
}

const char* mesh_format_name(MeshFormat format) {
  for (const NamedFormat& known : kFormats) {
    if (known.format == format) return known.name;
  }
  return "auto";
}

Result<MeshFile> parse_mesh(std::string_view bytes, const std::string& name,
                            const MeshReadOptions& options, const Execution& execution) {
  try {
    const std::string terminated(bytes);  // adds the zero byte
    return selected(read_text(terminated, name, {}, options, execution), name, options);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: not enough memory for {} bytes", name, bytes.size());
  }
}

Result<MeshFile> read_mesh(const std::string& path, const MeshReadOptions& options,
                           const Execution& execution) {
  MeshReadOptions known = options;
  if (known.format == MeshFormat::kAuto) {
    if (path == "-") {
      return fail(ErrorCode::kUsage, "standard input needs a format: obj, stl, ply, off or glb");
    }
    known.format = mesh_format_of_file(path);
    if (known.format == MeshFormat::kAuto) {
      return fail(
          ErrorCode::kInput,
          "{}: the file name must end in .obj, .stl, .ply, .off, .3mf, .amf, .gltf or .glb, or "
          "the format must be given; the content looks like none of them",
          path);
    }
  }
  if (known.reader == MeshReader::kOpenMesh) {
    if (!known.parts.empty()) {
      return fail(ErrorCode::kUsage, "{}: OpenMesh reads no parts", path);
    }
#ifdef STRATA_HAVE_OPENMESH
    return read_with_openmesh(path, known, execution);
#else
    return fail(ErrorCode::kUsage, "{}: this build has no OpenMesh", path);
#endif
  }
  if (known.format == MeshFormat::k3mf || known.format == MeshFormat::kAmf) {
    return selected(read_archive(path, known, execution), path, known);
  }
  try {
    const auto file = detail::InputBytes::open(path, execution.memory_limit, execution.stop);
    if (!file) return tl::unexpected(file.error());
    Result<MeshFile> result = read_text(file->view(), path == "-" ? "standard input" : path,
                                        path == "-" ? "" : path, known, execution, &*file);
    if (file->changed()) {
      return fail(ErrorCode::kInput, "{}: the file changed while it was read", path);
    }
    return selected(std::move(result), path, known);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: not enough memory to read the file", path);
  }
}

}  // namespace strata
