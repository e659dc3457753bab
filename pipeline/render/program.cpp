#include "pipeline/render/program.hpp"

#include <GLES3/gl3.h>

#include <string>

namespace tactus::render {
namespace {

constexpr GLsizei kLogBytesMax = 1024;

rt::Error refused(const char* name, const char* what, const char* log) {
  return {rt::ExitCode::device_unavailable,
          std::string("this machine's GLES driver does not ") + what + " the program '" + name + "': " + log};
}

rt::Result<GLuint> compile(const char* name, GLenum kind, std::span<const char* const> pieces) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, static_cast<GLsizei>(pieces.size()), pieces.data(), nullptr);
  glCompileShader(shader);
  GLint is_compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &is_compiled);
  if (is_compiled == GL_TRUE) return shader;
  char log[kLogBytesMax] = {};
  glGetShaderInfoLog(shader, kLogBytesMax, nullptr, log);
  glDeleteShader(shader);
  return refused(name, "compile", log);
}

}  // namespace

rt::Result<std::uint32_t> link_program(const char* name, std::span<const char* const> vertex_pieces,
                                       std::span<const char* const> fragment_pieces) {
  const auto vertex = compile(name, GL_VERTEX_SHADER, vertex_pieces);
  if (!vertex) return vertex.error();
  const auto fragment = compile(name, GL_FRAGMENT_SHADER, fragment_pieces);
  if (!fragment) {
    glDeleteShader(*vertex);
    return fragment.error();
  }
  const GLuint program = glCreateProgram();
  glAttachShader(program, *vertex);
  glAttachShader(program, *fragment);
  glLinkProgram(program);
  glDeleteShader(*vertex);  // live on as long as the program does
  glDeleteShader(*fragment);
  GLint is_linked = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &is_linked);
  if (is_linked == GL_TRUE) return program;
  char log[kLogBytesMax] = {};
  glGetProgramInfoLog(program, kLogBytesMax, nullptr, log);
  glDeleteProgram(program);
  return refused(name, "link", log);
}

}  // namespace tactus::render
