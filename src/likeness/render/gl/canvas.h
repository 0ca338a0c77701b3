// A picture that OpenGL draws into, with smooth edges.

#pragma once

#include <array>

#include "likeness/gl/objects.h"
#include "likeness/image/image.h"

namespace likeness {

class GlCanvas {
 public:
  //   samples  a pixel; 1: edges are not smoothed. Fewer where the driver has fewer.
  // Throws Error when the driver cannot draw into such a picture.
  GlCanvas(const GlFunctions& gl, int width, int height, int samples);

  int width() const { return width_; }
  int height() const { return height_; }

  // From now on everything is drawn here, on this colour: RGB, 0 ... 1.
  void Begin(const std::array<float, 3>& background);
  // What was drawn is complete; a framebuffer of the caller's is to be bound again.
  void End();

  // Copies the complete picture into a framebuffer (0: the window's), its lower left corner to (x, y).
  void CopyTo(GLuint framebuffer, int x, int y) const;
  // The same at another size.
  void ScaleTo(GLuint framebuffer, int x, int y, int width, int height) const;
  // The complete picture, RGB.
  ImageU8 Read() const;

 private:
  const GlFunctions* gl_;
  int width_, height_, samples_;
  GlTexture sampled_colour_, sampled_depth_, colour_;
  GlFramebuffer sampled_, complete_;
};

// Part of a framebuffer, RGB; (x, y) is its lower left corner.
ImageU8 ReadFramebuffer(const GlFunctions& gl, GLuint framebuffer, int x, int y, int width, int height);

}  // namespace likeness
