// OpenGL objects that are deleted with their variables. Their context is current, and its GlFunctions alive, whenever
// one is made, moved onto or destroyed.

#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "likeness/gl/functions.h"

namespace likeness {

template <void (*Delete)(const GlFunctions&, GLuint)>
class GlObject {
 public:
  GlObject() = default;
  GlObject(const GlFunctions& gl, GLuint id) : gl_(&gl), id_(id) {}
  GlObject(GlObject&& other) noexcept : gl_(other.gl_), id_(std::exchange(other.id_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(gl_, other.gl_);
    std::swap(id_, other.id_);
    return *this;
  }
  ~GlObject() {
    if (id_ != 0) Delete(*gl_, id_);
  }

  GLuint id() const { return id_; }  // 0: none

 private:
  const GlFunctions* gl_ = nullptr;
  GLuint id_ = 0;
};

namespace internal {
void DeleteBuffer(const GlFunctions& gl, GLuint id);
void DeleteTexture(const GlFunctions& gl, GLuint id);
void DeleteShader(const GlFunctions& gl, GLuint id);
void DeleteProgram(const GlFunctions& gl, GLuint id);
void DeleteQuery(const GlFunctions& gl, GLuint id);
void DeleteFramebuffer(const GlFunctions& gl, GLuint id);
void DeleteVertexArray(const GlFunctions& gl, GLuint id);
}  // namespace internal

using GlBuffer = GlObject<internal::DeleteBuffer>;
using GlTexture = GlObject<internal::DeleteTexture>;
using GlShader = GlObject<internal::DeleteShader>;
using GlProgram = GlObject<internal::DeleteProgram>;
using GlQuery = GlObject<internal::DeleteQuery>;
using GlFramebuffer = GlObject<internal::DeleteFramebuffer>;
using GlVertexArray = GlObject<internal::DeleteVertexArray>;

// `data` may be null: then the contents are undefined. `usage` as in glBufferData. Uses the binding
// GL_COPY_WRITE_BUFFER.
GlBuffer MakeBuffer(const GlFunctions& gl, GLsizeiptr bytes, const void* data, GLenum usage);

// Two-dimensional, RGBA, with all its smaller levels, whose contents are undefined; sampled linearly without them and
// clamped to its edge until something else is set. Uses the binding GL_TEXTURE_2D of the active unit, which is 0
// afterwards.
//   format  GL_RGBA8, GL_RGBA16F, GL_SRGB8_ALPHA8, ...
GlTexture MakeTexture(const GlFunctions& gl, GLenum format, int width, int height);

GlQuery MakeQuery(const GlFunctions& gl);
GlFramebuffer MakeFramebuffer(const GlFunctions& gl);
GlVertexArray MakeVertexArray(const GlFunctions& gl);

struct GlStage {
  GLenum kind = 0;  // GL_COMPUTE_SHADER, GL_VERTEX_SHADER, ...
  std::string source;
};

// Throws Error with the driver's text when a stage does not compile or the stages do not fit together; `name` is for
// this text.
GlProgram MakeProgram(const GlFunctions& gl, const std::string& name, std::initializer_list<GlStage> stages);

// For tests and measurements: wait for all that was handed to the GPU. Rows and values one after the other.
//   returns  RGBA, the texture's first row (t = 0) first, clamped to 8 bits
std::vector<uint8_t> ReadTexture(const GlFunctions& gl, GLuint texture, int width, int height);
std::vector<float> ReadBuffer(const GlFunctions& gl, GLuint buffer, int count);

}  // namespace likeness
