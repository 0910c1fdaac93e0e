#include "strata/gl/shader_program.h"

#include <epoxy/gl.h>
#include <fmt/core.h>

#include <algorithm>
#include <charconv>

#include "gl/faults.h"

namespace strata::gl {
namespace {

constexpr std::uint32_t kMostGroups = 65535;  ///< along one axis, on every driver

/// Piece i begins at line i * kLinesOfPiece + 1, for the compiler. (The second number of #line is
/// for this, but Mesa 22.3 forgets it.)
constexpr std::size_t kLinesOfPiece = 100000;

/// Reads a number; the text begins after it then. False if there is none.
bool take_number(std::string_view& text, std::size_t& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

/// The log with the names of pieces and their lines. Drivers write "0:300012(5): ..." (Mesa) or
/// "0(300012) : ..." (NVIDIA) for line 12 of piece 3; other lines are left as they are.
std::string named_log(std::string_view log, std::span<const GlslPiece> pieces) {
  std::string text;
  while (!log.empty()) {
    const std::size_t end = log.find('\n');
    std::string_view line = log.substr(0, end);
    log.remove_prefix(end == std::string_view::npos ? log.size() : end + 1);
    std::string_view rest = line;
    std::size_t source = 0, number = 0;
    if (take_number(rest, source) && !rest.empty() && (rest[0] == ':' || rest[0] == '(')) {
      rest.remove_prefix(1);
      if (take_number(rest, number) && number / kLinesOfPiece < pieces.size()) {
        text += fmt::format("{}:{}", pieces[number / kLinesOfPiece].name, number % kLinesOfPiece);
        line = rest.substr(rest.starts_with(')') ? 1 : 0);
      }
    }
    text += line;
    if (!log.empty()) text += '\n';
  }
  while (!text.empty() && (text.back() == '\n' || text.back() == '\0')) text.pop_back();
  return text;
}

std::string log_of(GLuint id, bool is_shader) {
  GLint length = 0;
  is_shader ? glGetShaderiv(id, GL_INFO_LOG_LENGTH, &length)
            : glGetProgramiv(id, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
  is_shader ? glGetShaderInfoLog(id, length, nullptr, log.data())
            : glGetProgramInfoLog(id, length, nullptr, log.data());
  return log;
}

/// A shader that goes with its scope.
struct Shader {
  GLuint id = 0;
  ~Shader() { glDeleteShader(id); }
};

Result<void> compile(Shader& shader, GLenum stage, std::span<const GlslPiece> pieces,
                     const GlslSettings& settings) {
  std::string text = "#version 450 core\n";
  for (const std::string& extension : settings.extensions) {
    text += "#extension " + extension + " : require\n";
  }
  for (const auto& [name, value] : settings.defines) text += "#define " + name + ' ' + value + '\n';
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    text += fmt::format("#line {} 0\n", i * kLinesOfPiece + 1);
    text += pieces[i].text;
    if (!text.ends_with('\n')) text += '\n';
  }
  if (refuses_shader(pieces)) {
    // Without the driver: Mesa's cache of shaders let text with an #error pass.
    return fail(ErrorCode::kInternal,
                "the OpenGL driver refuses a shader:\n{}: refused by STRATA_GL_FAULTS",
                pieces.back().name);
  }
  shader.id = glCreateShader(stage);
  const char* source = text.data();
  const auto length = static_cast<GLint>(text.size());
  glShaderSource(shader.id, 1, &source, &length);
  glCompileShader(shader.id);
  GLint ok = GL_FALSE;
  glGetShaderiv(shader.id, GL_COMPILE_STATUS, &ok);
  if (ok) return {};
  return fail(ErrorCode::kInternal, "the OpenGL driver refuses a shader:\n{}",
              named_log(log_of(shader.id, true), pieces));
}

Result<GLuint> link(std::span<const GLuint> shaders, std::string_view name) {
  const GLuint id = glCreateProgram();
  for (const GLuint shader : shaders) glAttachShader(id, shader);
  glLinkProgram(id);
  for (const GLuint shader : shaders) glDetachShader(id, shader);
  GLint ok = GL_FALSE;
  glGetProgramiv(id, GL_LINK_STATUS, &ok);
  if (ok) return id;
  const std::string log = named_log(log_of(id, false), {});
  glDeleteProgram(id);
  return fail(ErrorCode::kInternal, "the OpenGL driver refuses to link {}:\n{}", name, log);
}

std::string_view last_name(std::span<const GlslPiece> pieces) {
  return pieces.empty() ? "a program" : pieces.back().name;
}

}  // namespace

Result<Program> Program::compute(std::span<const GlslPiece> pieces, const GlslSettings& settings) {
  Shader shader;
  if (auto compiled = compile(shader, GL_COMPUTE_SHADER, pieces, settings); !compiled) {
    return tl::unexpected(compiled.error());
  }
  auto id = link({&shader.id, 1}, last_name(pieces));
  if (!id) return tl::unexpected(id.error());
  Program program;
  program.id_ = *id;
  return program;
}

Result<Program> Program::graphics(std::span<const GlslPiece> vertex,
                                  std::span<const GlslPiece> fragment,
                                  const GlslSettings& settings) {
  Shader shaders[2];
  if (auto compiled = compile(shaders[0], GL_VERTEX_SHADER, vertex, settings); !compiled) {
    return tl::unexpected(compiled.error());
  }
  if (auto compiled = compile(shaders[1], GL_FRAGMENT_SHADER, fragment, settings); !compiled) {
    return tl::unexpected(compiled.error());
  }
  const GLuint ids[] = {shaders[0].id, shaders[1].id};
  auto id = link(ids, last_name(fragment));
  if (!id) return tl::unexpected(id.error());
  Program program;
  program.id_ = *id;
  return program;
}

void Program::reset() noexcept {
  if (id_ != 0) glDeleteProgram(id_);
  id_ = 0;
}

void Program::use() const { glUseProgram(id_); }

void Program::set(const char* name, std::uint32_t value) const {
  glProgramUniform1ui(id_, glGetUniformLocation(id_, name), value);
}
void Program::set(const char* name, std::int32_t value) const {
  glProgramUniform1i(id_, glGetUniformLocation(id_, name), value);
}
void Program::set(const char* name, float value) const {
  glProgramUniform1f(id_, glGetUniformLocation(id_, name), value);
}
void Program::set(const char* name, std::uint32_t x, std::uint32_t y) const {
  glProgramUniform2ui(id_, glGetUniformLocation(id_, name), x, y);
}

void Program::dispatch(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
  use();
  glDispatchCompute(x, y, z);
}

Groups groups_for(std::uint64_t items, std::uint32_t group_size) {
  const std::uint64_t groups = std::max<std::uint64_t>(1, (items + group_size - 1) / group_size);
  if (groups <= kMostGroups) return {static_cast<std::uint32_t>(groups), 1};
  return {kMostGroups, static_cast<std::uint32_t>((groups + kMostGroups - 1) / kMostGroups)};
}

}  // namespace strata::gl
