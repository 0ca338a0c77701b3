#include "likeness/gl/objects.h"

#include <algorithm>

#include "likeness/base/error.h"

namespace likeness {

namespace internal {

void DeleteBuffer(const GlFunctions& gl, GLuint id) { gl.DeleteBuffers(1, &id); }
void DeleteTexture(const GlFunctions& gl, GLuint id) { gl.DeleteTextures(1, &id); }
void DeleteShader(const GlFunctions& gl, GLuint id) { gl.DeleteShader(id); }
void DeleteProgram(const GlFunctions& gl, GLuint id) { gl.DeleteProgram(id); }
void DeleteQuery(const GlFunctions& gl, GLuint id) { gl.DeleteQueries(1, &id); }
void DeleteFramebuffer(const GlFunctions& gl, GLuint id) { gl.DeleteFramebuffers(1, &id); }
void DeleteVertexArray(const GlFunctions& gl, GLuint id) { gl.DeleteVertexArrays(1, &id); }

}  // namespace internal

namespace {

// What the driver says about a shader or a program.
std::string LogOf(GLuint id, PFNGLGETSHADERIVPROC get_integer, PFNGLGETSHADERINFOLOGPROC get_log) {
  GLint length = 0;
  get_integer(id, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<size_t>(std::max(length, 1)), '\0');
  get_log(id, length, &length, log.data());
  log.resize(static_cast<size_t>(length));
  return log;
}

}  // namespace

GlBuffer MakeBuffer(const GlFunctions& gl, GLsizeiptr bytes, const void* data, GLenum usage) {
  GLuint id = 0;
  gl.GenBuffers(1, &id);
  GlBuffer buffer(gl, id);
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, id);
  gl.BufferData(GL_COPY_WRITE_BUFFER, bytes, data, usage);
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, 0);
  return buffer;
}

GlTexture MakeTexture(const GlFunctions& gl, GLenum format, int width, int height) {
  GLuint id = 0;
  gl.GenTextures(1, &id);
  GlTexture texture(gl, id);
  gl.BindTexture(GL_TEXTURE_2D, id);
  int level = 0;
  for (int w = width, h = height;; w = std::max(w / 2, 1), h = std::max(h / 2, 1)) {
    gl.TexImage2D(GL_TEXTURE_2D, level, static_cast<GLint>(format), w, h, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    if (w == 1 && h == 1) break;
    ++level;
  }
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, level);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  gl.BindTexture(GL_TEXTURE_2D, 0);
  return texture;
}

GlQuery MakeQuery(const GlFunctions& gl) {
  GLuint id = 0;
  gl.GenQueries(1, &id);
  return {gl, id};
}

GlFramebuffer MakeFramebuffer(const GlFunctions& gl) {
  GLuint id = 0;
  gl.GenFramebuffers(1, &id);
  return {gl, id};
}

GlVertexArray MakeVertexArray(const GlFunctions& gl) {
  GLuint id = 0;
  gl.GenVertexArrays(1, &id);
  return {gl, id};
}

GlProgram MakeProgram(const GlFunctions& gl, const std::string& name, std::initializer_list<GlStage> stages) {
  GlProgram program(gl, gl.CreateProgram());
  std::vector<GlShader> shaders;
  for (const GlStage& stage : stages) {
    const GlShader& shader = shaders.emplace_back(gl, gl.CreateShader(stage.kind));
    const char* const source = stage.source.c_str();
    gl.ShaderSource(shader.id(), 1, &source, nullptr);
    gl.CompileShader(shader.id());
    GLint good = 0;
    gl.GetShaderiv(shader.id(), GL_COMPILE_STATUS, &good);
    if (good == 0) {
      throw Error("OpenGL ({}) cannot compile the shader '{}': {}", gl.renderer, name,
                  LogOf(shader.id(), gl.GetShaderiv, gl.GetShaderInfoLog));
    }
    gl.AttachShader(program.id(), shader.id());
  }
  gl.LinkProgram(program.id());
  GLint good = 0;
  gl.GetProgramiv(program.id(), GL_LINK_STATUS, &good);
  if (good == 0) {
    throw Error("OpenGL ({}) cannot link the shader '{}': {}", gl.renderer, name,
                LogOf(program.id(), gl.GetProgramiv, gl.GetProgramInfoLog));
  }
  for (const GlShader& shader : shaders) gl.DetachShader(program.id(), shader.id());
  return program;
}

std::vector<uint8_t> ReadTexture(const GlFunctions& gl, GLuint texture, int width, int height) {
  std::vector<uint8_t> pixels(static_cast<size_t>(width) * height * 4);
  gl.BindTexture(GL_TEXTURE_2D, texture);
  gl.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  gl.BindTexture(GL_TEXTURE_2D, 0);
  return pixels;
}

std::vector<float> ReadBuffer(const GlFunctions& gl, GLuint buffer, int count) {
  std::vector<float> values(static_cast<size_t>(count));
  gl.BindBuffer(GL_COPY_READ_BUFFER, buffer);
  gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, static_cast<GLsizeiptr>(values.size() * sizeof(float)), values.data());
  gl.BindBuffer(GL_COPY_READ_BUFFER, 0);
  return values;
}

}  // namespace likeness
