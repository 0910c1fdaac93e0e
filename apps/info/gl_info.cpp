#include "apps/info/gl_info.h"

#ifdef STRATA_HAVE_GL
#include <array>

#include "strata/gl/context.h"
#include "strata/raster/lattice_mesh.h"
#endif

namespace strata::apps {

#ifndef STRATA_HAVE_GL

Result<void> tell_gl(JsonWriter&, std::string&) {
  return fail(ErrorCode::kUsage,
              "--gl: this strata was built without OpenGL (STRATA_WITH_GL, libepoxy-dev)");
}

#else

namespace {

constexpr std::array kExtensions{
    "GL_ARB_gpu_shader_int64",          "GL_NV_shader_atomic_int64",
    "GL_ARB_fragment_shader_interlock", "GL_EXT_shader_framebuffer_fetch",
    "GL_NV_conservative_raster",        "GL_KHR_robustness"};

/// How something will be done here, and why.
struct Path {
  const char* name;
  std::string taken, reason;
};

std::vector<Path> paths_of(const gl::Info& info) {
  std::vector<Path> paths;
  paths.push_back({"ha32", "one pass", "32-bit atomic maxima are in every OpenGL 4.5"});
  paths.push_back({"ha64", info.has_int64_atomics ? "one pass" : "two passes, keys and payloads",
                   info.int64_atomics_reason});
  paths.push_back(
      {"compute_rasterizer", info.has_int64 ? "yes" : "no",
       info.has_int64 ? "64-bit integers compile" : "GL_ARB_gpu_shader_int64 does not compile"});
  const bool places = info.limits.subpixel_bits >= static_cast<unsigned>(kLatticeBits);
  const bool blocks = info.limits.fragment_storage_blocks >= 6;
  paths.push_back({"hardware_rasterizer", places && blocks ? "yes" : "no",
                   !places   ? fmt::format("vertices fall on 1/{} of a pixel, 1/{} is needed",
                                           1u << info.limits.subpixel_bits, kLatticeSteps)
                   : !blocks ? fmt::format("{} storage blocks in fragment shaders, 6 are needed",
                                           info.limits.fragment_storage_blocks)
                             : fmt::format("vertices fall on 1/{} of a pixel",
                                           1u << info.limits.subpixel_bits)});
  return paths;
}

std::vector<std::pair<const char*, std::uint64_t> > limits_of(const gl::Info& info) {
  const gl::Limits& l = info.limits;
  return {{"storage_block_bytes", l.storage_block_bytes},
          {"storage_bindings", l.storage_bindings},
          {"fragment_storage_blocks", l.fragment_storage_blocks},
          {"compute_storage_blocks", l.compute_storage_blocks},
          {"compute_groups", l.compute_groups[0]},
          {"compute_invocations", l.compute_invocations},
          {"compute_shared_bytes", l.compute_shared_bytes},
          {"framebuffer_side", l.framebuffer_side},
          {"subpixel_bits", l.subpixel_bits}};
}

std::string text_of(const gl::Info& info) {
  std::string text = "OpenGL\n";
  const auto line = [&](std::string_view topic, const std::string& rest) {
    text += fmt::format("  {:<12} {}\n", topic, rest);
  };
  line("renderer", info.renderer + (info.is_software ? ", software" : ""));
  line("vendor", info.vendor);
  line("version", fmt::format("{}, GLSL {}", info.version, info.glsl_version));
  line("context", info.window_system);
  std::string_view topic = "extensions";
  for (const char* name : kExtensions) {
    line(topic, fmt::format("{} {}", info.has_extension(name) ? "yes" : "no ", name));
    topic = "";
  }
  topic = "limits";
  for (const auto& [name, value] : limits_of(info)) {
    line(topic, fmt::format("{} {}", name, value));
    topic = "";
  }
  topic = "paths";
  for (const Path& path : paths_of(info)) {
    line(topic, fmt::format("{}: {}, since {}", path.name, path.taken, path.reason));
    topic = "";
  }
  topic = "workarounds";
  for (const gl::Workaround& workaround : info.workarounds) {
    line(topic, fmt::format("{}, {}: {}", workaround.name,
                            workaround.in_force ? "in force" : "not needed or switched off",
                            workaround.story));
    topic = "";
  }
  return text;
}

void write_gl(JsonWriter& json, const gl::Info& info) {
  json.key("gl").begin_object();
  json.member("renderer", info.renderer);
  json.member("software", info.is_software);
  json.member("vendor", info.vendor);
  json.member("version", info.version);
  json.member("glsl_version", info.glsl_version);
  json.member("context", info.window_system);
  json.key("extensions").begin_array();
  for (const std::string& name : info.extensions) json.value(name);
  json.end_array();
  json.key("limits").begin_object();
  for (const auto& [name, value] : limits_of(info)) json.member(name, value);
  json.end_object();
  json.key("paths").begin_array();
  for (const Path& path : paths_of(info)) {
    json.begin_object();
    json.member("name", path.name);
    json.member("taken", path.taken);
    json.member("reason", path.reason);
    json.end_object();
  }
  json.end_array();
  json.key("workarounds").begin_array();
  for (const gl::Workaround& workaround : info.workarounds) {
    json.begin_object();
    json.member("name", workaround.name);
    json.member("in_force", workaround.in_force);
    json.member("story", workaround.story);
    json.end_object();
  }
  json.end_array();
  json.end_object();
}

}  // namespace

Result<void> tell_gl(JsonWriter& json, std::string& text) {
  const auto context = gl::Context::headless();
  if (!context) return tl::unexpected(context.error());
  const gl::Info& info = (*context)->info();
  if (!text.empty()) text += '\n';
  text += text_of(info);
  write_gl(json, info);
  return {};
}

#endif

}  // namespace strata::apps
