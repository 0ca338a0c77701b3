#include "likeness/render/gl/mesh_renderer.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "likeness/base/error.h"
#include "likeness/geometry/mesh_corners.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

constexpr char kVertexShader[] = R"(#version 330 core
layout(location = 0) in vec3 position;  // mm
layout(location = 1) in vec2 uv;        // v up
uniform mat4 clip_from_mesh;
out vec2 texture_at;
void main() {
  gl_Position = clip_from_mesh * vec4(position, 1);
  texture_at = vec2(uv.x, 1 - uv.y);  // row 0 is v = 1
}
)";

constexpr char kFragmentShader[] = R"(#version 330 core
in vec2 texture_at;
uniform sampler2D texels;
uniform bool textured;
uniform float exposure;
uniform vec3 line_colour;
out vec4 colour;
vec3 Linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
vec3 Encoded(vec3 c) { return mix(c * 12.92, 1.055 * pow(c, vec3(1 / 2.4)) - 0.055, step(0.0031308, c)); }
void main() {
  vec3 shown = textured ? texture(texels, texture_at).rgb : line_colour;
  if (textured && exposure != 1) shown = Encoded(Linear(shown) * exposure);
  colour = vec4(shown, 1);
}
)";

}  // namespace

Eigen::Matrix4d ClipFromMesh(const Camera& camera, const RigidTransform& world_from_mesh, double near_mm,
                             double far_mm) {
  LIKENESS_CHECK(camera.width > 0 && camera.height > 0 && near_mm > 0 && far_mm > near_mm);
  const PixelFromMesh pixel_from_mesh = ProjectionOf(camera, world_from_mesh);  // (x z, y z, z)
  const Eigen::RowVector4d depth = pixel_from_mesh.row(2);
  Eigen::Matrix4d clip_from_mesh;
  clip_from_mesh.row(0) = 2.0 / camera.width * pixel_from_mesh.row(0) - depth;
  clip_from_mesh.row(1) = depth - 2.0 / camera.height * pixel_from_mesh.row(1);  // pixels count down, OpenGL up
  clip_from_mesh.row(2) = (far_mm + near_mm) / (far_mm - near_mm) * depth;
  clip_from_mesh(2, 3) -= 2 * far_mm * near_mm / (far_mm - near_mm);
  clip_from_mesh.row(3) = depth;
  return clip_from_mesh;
}

GlMeshRenderer::GlMeshRenderer(const GlFunctions& gl)
    : gl_(&gl),
      program_(MakeProgram(gl, "mesh", {{GL_VERTEX_SHADER, kVertexShader}, {GL_FRAGMENT_SHADER, kFragmentShader}})),
      clip_from_mesh_(gl.GetUniformLocation(program_.id(), "clip_from_mesh")),
      exposure_(gl.GetUniformLocation(program_.id(), "exposure")),
      line_colour_(gl.GetUniformLocation(program_.id(), "line_colour")),
      textured_(gl.GetUniformLocation(program_.id(), "textured")),
      array_(MakeVertexArray(gl)) {}

void GlMeshRenderer::SetTopology(const MeshTopology& topology) {
  MeshCorners corners = CornersOf(topology);
  std::vector<float> uvs;
  for (const int uv : corners.uvs) uvs.insert(uvs.end(), topology.uvs[uv].begin(), topology.uvs[uv].end());
  const std::vector<GLuint>& indices = corners.indices;
  corner_vertices_ = std::move(corners.vertices);
  index_count_ = static_cast<int>(indices.size());
  gathered_.resize(3 * corner_vertices_.size());
  const auto bytes = [](const auto& values) { return static_cast<GLsizeiptr>(values.size() * sizeof(values[0])); };
  positions_ = MakeBuffer(*gl_, bytes(gathered_), nullptr, GL_STREAM_DRAW);
  uvs_ = MakeBuffer(*gl_, bytes(uvs), uvs.data(), GL_STATIC_DRAW);
  indices_ = MakeBuffer(*gl_, bytes(indices), indices.data(), GL_STATIC_DRAW);
  gl_->BindVertexArray(array_.id());
  const auto attribute = [&](GLuint location, const GlBuffer& buffer, int values) {
    gl_->BindBuffer(GL_ARRAY_BUFFER, buffer.id());
    gl_->VertexAttribPointer(location, values, GL_FLOAT, GL_FALSE, 0, nullptr);
    gl_->EnableVertexAttribArray(location);
  };
  attribute(0, positions_, 3);
  attribute(1, uvs_, 2);
  gl_->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.id());
  gl_->BindVertexArray(0);
}

void GlMeshRenderer::SetVertices(const Vertices& vertices) {
  for (size_t i = 0; i < corner_vertices_.size(); ++i) {
    LIKENESS_CHECK(corner_vertices_[i] < vertices.rows());
    std::copy_n(vertices.data() + static_cast<size_t>(3) * corner_vertices_[i], 3, &gathered_[3 * i]);
  }
  gl_->BindBuffer(GL_ARRAY_BUFFER, positions_.id());
  const auto bytes = static_cast<GLsizeiptr>(gathered_.size() * sizeof(float));
  gl_->BufferData(GL_ARRAY_BUFFER, bytes, nullptr, GL_STREAM_DRAW);  // a frame under way keeps the old contents
  gl_->BufferSubData(GL_ARRAY_BUFFER, 0, bytes, gathered_.data());
  gl_->BindBuffer(GL_ARRAY_BUFFER, 0);
}

void GlMeshRenderer::Draw(GLuint texture, const Camera& camera, const RigidTransform& world_from_mesh, int x,
                          const MeshStyle& style) const {
  const Eigen::Matrix4f matrix = ClipFromMesh(camera, world_from_mesh, kNearMm, kFarMm).cast<float>();
  gl_->Viewport(x, 0, camera.width, camera.height);
  gl_->UseProgram(program_.id());
  gl_->UniformMatrix4fv(clip_from_mesh_, 1, GL_FALSE, matrix.data());
  gl_->ActiveTexture(GL_TEXTURE0);
  gl_->BindTexture(GL_TEXTURE_2D, texture);
  gl_->BindVertexArray(array_.id());
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_LEQUAL);
  gl_->Disable(GL_BLEND);
  gl_->FrontFace(GL_CCW);
  gl_->CullFace(GL_BACK);
  (style.cull_back_faces ? gl_->Enable : gl_->Disable)(GL_CULL_FACE);
  const bool lines = style.surface != MeshFill::kTexture;
  if (lines) {  // the surface hides lines behind it: push it back a little
    gl_->Enable(GL_POLYGON_OFFSET_FILL);
    gl_->PolygonOffset(1, 1);
    if (style.surface == MeshFill::kLines) gl_->ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  }
  DrawTriangles(true, style);
  if (lines) {
    gl_->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl_->Disable(GL_POLYGON_OFFSET_FILL);
    gl_->PolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    DrawTriangles(false, style);
    gl_->PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  }
  gl_->Disable(GL_DEPTH_TEST);
  gl_->Disable(GL_CULL_FACE);
  gl_->BindVertexArray(0);
  gl_->BindTexture(GL_TEXTURE_2D, 0);
}

void GlMeshRenderer::DrawTriangles(bool textured, const MeshStyle& style) const {
  gl_->Uniform1i(textured_, textured ? 1 : 0);
  gl_->Uniform1f(exposure_, style.exposure);
  gl_->Uniform3f(line_colour_, style.line_colour[0], style.line_colour[1], style.line_colour[2]);
  gl_->DrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
}

void GlTextureStream::Upload(const uint8_t* texels, int size) {
  const auto bytes = static_cast<GLsizeiptr>(size) * size * 4;
  if (size != size_) {
    texture_ = MakeTexture(*gl_, GL_RGBA8, size, size);
    buffer_ = MakeBuffer(*gl_, bytes, nullptr, GL_STREAM_DRAW);
    size_ = size;
  }
  gl_->BindBuffer(GL_PIXEL_UNPACK_BUFFER, buffer_.id());
  gl_->BufferData(GL_PIXEL_UNPACK_BUFFER, bytes, nullptr, GL_STREAM_DRAW);  // a copy under way keeps the old contents
  void* const memory = gl_->MapBufferRange(GL_PIXEL_UNPACK_BUFFER, 0, bytes, GL_MAP_WRITE_BIT);
  if (memory == nullptr)
    throw Error("the OpenGL driver ({}) gives no memory for a texture of {} x {}", gl_->renderer, size, size);
  std::memcpy(memory, texels, static_cast<size_t>(bytes));
  gl_->UnmapBuffer(GL_PIXEL_UNPACK_BUFFER);
  gl_->BindTexture(GL_TEXTURE_2D, texture_.id());
  gl_->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size, size, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  gl_->BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  gl_->GenerateMipmap(GL_TEXTURE_2D);
  gl_->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  gl_->BindTexture(GL_TEXTURE_2D, 0);
}

}  // namespace likeness
