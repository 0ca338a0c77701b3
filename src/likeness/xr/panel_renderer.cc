#include "likeness/xr/panel_renderer.h"

#include "likeness/render/gl/mesh_renderer.h"

namespace likeness {
namespace {

constexpr char kVertexShader[] = R"(#version 330 core
uniform mat4 clip_from_panel;
uniform vec3 half_size;  // mm
out vec2 texture_at;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = clip_from_panel * vec4((2 * corner - 1) * half_size.xy, 0, 1);
  texture_at = corner;
}
)";

constexpr char kFragmentShader[] = R"(#version 330 core
in vec2 texture_at;
uniform sampler2D texels;
out vec4 colour;
void main() { colour = texture(texels, texture_at); }
)";

}  // namespace

GlPanelRenderer::GlPanelRenderer(const GlFunctions& gl)
    : gl_(&gl),
      program_(MakeProgram(gl, "panel", {{GL_VERTEX_SHADER, kVertexShader}, {GL_FRAGMENT_SHADER, kFragmentShader}})),
      clip_from_panel_(gl.GetUniformLocation(program_.id(), "clip_from_panel")),
      half_size_(gl.GetUniformLocation(program_.id(), "half_size")),
      array_(MakeVertexArray(gl)) {}

void GlPanelRenderer::Draw(GLuint texture, const Camera& camera, const RigidTransform& local_from_panel,
                           double width_mm, double height_mm) const {
  const Eigen::Matrix4f matrix = ClipFromMesh(camera, local_from_panel, kNearMm, kFarMm).cast<float>();
  gl_->Viewport(0, 0, camera.width, camera.height);
  gl_->UseProgram(program_.id());
  gl_->UniformMatrix4fv(clip_from_panel_, 1, GL_FALSE, matrix.data());
  gl_->Uniform3f(half_size_, static_cast<float>(width_mm / 2), static_cast<float>(height_mm / 2), 0);
  gl_->ActiveTexture(GL_TEXTURE0);
  gl_->BindTexture(GL_TEXTURE_2D, texture);
  gl_->BindVertexArray(array_.id());
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_LEQUAL);
  gl_->Enable(GL_BLEND);
  gl_->BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  gl_->DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  gl_->Disable(GL_BLEND);
  gl_->Disable(GL_DEPTH_TEST);
  gl_->BindVertexArray(0);
  gl_->BindTexture(GL_TEXTURE_2D, 0);
}

GlTexture PlainTexture(const GlFunctions& gl, const uint8_t (&rgba)[4]) {
  GlTexture texture = MakeTexture(gl, GL_RGBA8, 1, 1);
  gl.BindTexture(GL_TEXTURE_2D, texture.id());
  gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
  gl.BindTexture(GL_TEXTURE_2D, 0);
  return texture;
}

}  // namespace likeness
