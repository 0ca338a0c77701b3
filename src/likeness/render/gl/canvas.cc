#include "likeness/render/gl/canvas.h"

#include <algorithm>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {
namespace {

GlTexture SampledTexture(const GlFunctions& gl, GLenum format, int width, int height, int samples) {
  GLuint id = 0;
  gl.GenTextures(1, &id);
  GlTexture texture(gl, id);
  gl.BindTexture(GL_TEXTURE_2D_MULTISAMPLE, id);
  gl.TexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, samples, format, width, height, GL_TRUE);
  gl.BindTexture(GL_TEXTURE_2D_MULTISAMPLE, 0);
  return texture;
}

void CheckComplete(const GlFunctions& gl, int width, int height, int samples) {
  if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return;
  throw Error(
      "the OpenGL driver ({}) cannot draw a picture of {} x {} pixels with {} samples a pixel; update it, or "
      "use another one",
      gl.renderer, width, height, samples);
}

}  // namespace

GlCanvas::GlCanvas(const GlFunctions& gl, int width, int height, int samples)
    : gl_(&gl), width_(width), height_(height), sampled_(MakeFramebuffer(gl)), complete_(MakeFramebuffer(gl)) {
  LIKENESS_CHECK(width > 0 && height > 0 && samples > 0);
  GLint most = 1;
  gl.GetIntegerv(GL_MAX_SAMPLES, &most);
  samples_ = std::clamp(samples, 1, std::max(1, static_cast<int>(most)));
  sampled_colour_ = SampledTexture(gl, GL_RGBA8, width, height, samples_);
  sampled_depth_ = SampledTexture(gl, GL_DEPTH_COMPONENT24, width, height, samples_);
  gl.BindFramebuffer(GL_FRAMEBUFFER, sampled_.id());
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D_MULTISAMPLE, sampled_colour_.id(), 0);
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D_MULTISAMPLE, sampled_depth_.id(), 0);
  CheckComplete(gl, width, height, samples_);
  colour_ = MakeTexture(gl, GL_RGBA8, width, height);
  gl.BindFramebuffer(GL_FRAMEBUFFER, complete_.id());
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour_.id(), 0);
  CheckComplete(gl, width, height, 1);
  gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
}

void GlCanvas::Begin(const std::array<float, 3>& background) {
  gl_->BindFramebuffer(GL_FRAMEBUFFER, sampled_.id());
  gl_->Viewport(0, 0, width_, height_);
  gl_->Disable(GL_SCISSOR_TEST);
  gl_->ClearColor(background[0], background[1], background[2], 1);
  gl_->Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void GlCanvas::End() {
  gl_->BindFramebuffer(GL_READ_FRAMEBUFFER, sampled_.id());
  gl_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, complete_.id());
  gl_->BlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  gl_->BindFramebuffer(GL_FRAMEBUFFER, 0);
}

void GlCanvas::CopyTo(GLuint framebuffer, int x, int y) const { ScaleTo(framebuffer, x, y, width_, height_); }

void GlCanvas::ScaleTo(GLuint framebuffer, int x, int y, int width, int height) const {
  const bool same_size = width == width_ && height == height_;
  gl_->BindFramebuffer(GL_READ_FRAMEBUFFER, complete_.id());
  gl_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  gl_->BlitFramebuffer(0, 0, width_, height_, x, y, x + width, y + height, GL_COLOR_BUFFER_BIT,
                       same_size ? GL_NEAREST : GL_LINEAR);
  gl_->BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
}

ImageU8 GlCanvas::Read() const { return ReadFramebuffer(*gl_, complete_.id(), 0, 0, width_, height_); }

ImageU8 ReadFramebuffer(const GlFunctions& gl, GLuint framebuffer, int x, int y, int width, int height) {
  std::vector<uint8_t> rows(static_cast<size_t>(width) * height * 4);  // RGBA: no padding whatever the width
  gl.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  gl.ReadPixels(x, y, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rows.data());
  gl.BindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  ImageU8 picture(width, height, 3);
  for (int row = 0; row < height; ++row) {
    const uint8_t* from = rows.data() + static_cast<size_t>(height - 1 - row) * width * 4;  // OpenGL begins below
    for (int column = 0; column < width; ++column) std::copy_n(from + 4 * column, 3, picture.at(column, row));
  }
  return picture;
}

}  // namespace likeness
