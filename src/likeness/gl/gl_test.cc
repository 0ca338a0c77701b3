#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "likeness/base/error.h"
#include "likeness/base/testing.h"
#include "likeness/gl/objects.h"
#include "likeness/gl/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

class OpenGl : public WithContext<testing::Test> {};

constexpr char kVertexShader[] = R"(#version 330 core
layout(location = 0) in vec2 point;
void main() { gl_Position = vec4(point, 0.0, 1.0); })";

constexpr char kFragmentShader[] = R"(#version 330 core
layout(location = 0) out vec4 colour;
void main() { colour = vec4(gl_FragCoord.xy / 255.0, 1.0, 1.0); })";

// A triangle over the lower left half of 16 x 16 pixels, in a context of version 3.3.
TEST_F(OpenGl, DrawsATriangle) {
  const GlFunctions& gl = this->gl();
  constexpr int kSize = 16;
  const GlTexture picture = MakeTexture(gl, GL_RGBA8, kSize, kSize);
  const GlFramebuffer framebuffer = MakeFramebuffer(gl);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, picture.id(), 0);
  gl.Viewport(0, 0, kSize, kSize);
  gl.ClearColor(0, 0, 0, 0);
  gl.Clear(GL_COLOR_BUFFER_BIT);
  const GlProgram program =
      MakeProgram(gl, "triangle", {{GL_VERTEX_SHADER, kVertexShader}, {GL_FRAGMENT_SHADER, kFragmentShader}});
  const float corners[] = {-1, -1, 1, -1, -1, 1};
  const GlBuffer points = MakeBuffer(gl, sizeof(corners), corners, GL_STATIC_DRAW);
  const GlVertexArray layout = MakeVertexArray(gl);
  gl.BindVertexArray(layout.id());
  gl.BindBuffer(GL_ARRAY_BUFFER, points.id());
  gl.EnableVertexAttribArray(0);
  gl.VertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
  gl.UseProgram(program.id());
  gl.DrawArrays(GL_TRIANGLES, 0, 3);

  std::array<uint8_t, kSize * kSize * 4> pixels{};
  gl.ReadPixels(0, 0, kSize, kSize, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      if (x + y == kSize - 1) continue;  // their centres lie on the edge
      const uint8_t* const pixel = &pixels[4 * static_cast<size_t>(y * kSize + x)];
      const bool inside = x + y < kSize - 1;
      EXPECT_EQ(pixel[2], inside ? 255 : 0) << x << " " << y;
      if (!inside) continue;
      // Half a unit is rounded to either side.
      EXPECT_NEAR(pixel[0], x + 0.5, 0.5) << x << " " << y;
      EXPECT_NEAR(pixel[1], y + 0.5, 0.5) << x << " " << y;
    }
  }
}

TEST_F(OpenGl, MistakesInShadersAreTold) {
  const GlFunctions& gl = this->gl();
  const std::string wrong = "#version 330 core\nvoid main() { colour = vec4(1.0); }";
  EXPECT_THAT(ErrorOf([&] {
                MakeProgram(gl, "wrong", {{GL_FRAGMENT_SHADER, wrong}});
              }),
              testing::AllOf(HasSubstr("cannot compile the shader 'wrong'"), HasSubstr("colour")));
  const std::string uses = "#version 330 core\nvec4 f();\nvoid main() { gl_Position = f(); }";
  EXPECT_THAT(ErrorOf([&] {
                MakeProgram(gl, "uses", {{GL_VERTEX_SHADER, uses}});
              }),
              HasSubstr("cannot link the shader 'uses'"));
}

TEST_F(OpenGl, ErrorsAreToldOnceAndCleared) {
  const GlFunctions& gl = this->gl();
  CheckGlErrors(gl, "resting");
  gl.Clear(~0U);
  gl.BindTexture(GL_FLOAT, 0);
  EXPECT_THAT(ErrorOf([&] { CheckGlErrors(gl, "clearing"); }), HasSubstr("an invalid value while clearing"));
  CheckGlErrors(gl, "resting");
}

TEST_F(OpenGl, MovedObjectsAreDeletedOnce) {
  const GlFunctions& gl = this->gl();
  GlBuffer buffer = MakeBuffer(gl, 4, nullptr, GL_STATIC_DRAW);
  const GLuint id = buffer.id();
  GlBuffer other = std::move(buffer);
  EXPECT_EQ(buffer.id(), 0U);  // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(other.id(), id);
  other = GlBuffer();
  EXPECT_EQ(other.id(), 0U);
}

TEST_F(OpenGl, TwoContextsLiveSideBySide) {
  const GlFunctions& gl = this->gl();
  const GlBuffer buffer = MakeBuffer(gl, 4, "abc", GL_STATIC_DRAW);
  { const OffscreenContext other(3, 3); }
  context_->MakeCurrent();
  char read[4] = {};
  gl.BindBuffer(GL_COPY_READ_BUFFER, buffer.id());
  gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, 4, read);
  EXPECT_STREQ(read, "abc");
}

TEST_F(OpenGl, VersionsThatAreNotThereAreRefused) {
  EXPECT_THAT(ErrorOf([] { OffscreenContext(9, 1); }), HasSubstr("no offscreen OpenGL 9.1"));
  EXPECT_THAT(ErrorOf([] { GlFunctions(OffscreenContext::FunctionAddress, 9, 1); }),
              HasSubstr("expected 9.1 or newer"));
  EXPECT_THAT(ErrorOf([] { GlFunctions([](const char*) -> void* { return nullptr; }, 3, 3); }),
              HasSubstr("no function glActiveTexture"));
}

}  // namespace
}  // namespace likeness
