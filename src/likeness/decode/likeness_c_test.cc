#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/decode/likeness.h"
#include "likeness/decode/random_avatar.h"
#include "likeness/gl/objects.h"
#include "likeness/gl/offscreen.h"

namespace likeness {
namespace {

using testing::HasSubstr;

class CInterface : public testing::Test {
 protected:
  CInterface() {
    Architecture a;
    a.texture_size = 16;
    a.vertex_count = 5;
    a.latent = 4;
    SaveAvatar(path_, RandomAvatar(a, 1));
  }
  const ScratchFolder folder_;
  const std::string path_ = (folder_ / "a.safetensors").string();
};

TEST_F(CInterface, DecodesAsTheHeaderSays) {
  likeness_decoder* decoder = nullptr;
  ASSERT_EQ(likeness_open(path_.c_str(), nullptr, &decoder), LIKENESS_OK) << likeness_last_error();
  likeness_info info = {};
  info.size = sizeof(info);
  ASSERT_EQ(likeness_get_info(decoder, &info), LIKENESS_OK);
  EXPECT_EQ(info.texture_size, 16);
  EXPECT_EQ(info.vertex_count, 5);
  EXPECT_EQ(info.triangle_count, 1);
  EXPECT_EQ(info.triangles[1], 1);
  EXPECT_EQ(info.uvs[2], 1);

  std::vector<uint8_t> pixels(16 * 16 * 4);
  std::vector<float> vertices(15), jacobian(15 * 4);
  const likeness_view view = {{0, 0, 1}, pixels.data(), 64};
  const likeness_mesh mesh = {vertices.data(), 12};
  EXPECT_EQ(likeness_decode(decoder, info.mean_code, &view, 1, &mesh, LIKENESS_RGBA8), LIKENESS_OK);
  EXPECT_EQ(pixels[3], 255);
  EXPECT_NE(vertices[14], 0);
  EXPECT_EQ(likeness_mesh_jacobian(decoder, info.mean_code, nullptr, 5, jacobian.data()), LIKENESS_OK);
  const int32_t third = 2;
  std::vector<float> rows(12);
  EXPECT_EQ(likeness_mesh_jacobian(decoder, info.mean_code, &third, 1, rows.data()), LIKENESS_OK);
  EXPECT_TRUE(std::equal(rows.begin(), rows.end(), jacobian.begin() + 24));
  likeness_close(decoder);

  // From memory, which goes before the decoder does.
  std::string bytes = ReadFile(path_);
  ASSERT_EQ(likeness_open_memory(bytes.data(), bytes.size(), nullptr, &decoder), LIKENESS_OK);
  std::fill(bytes.begin(), bytes.end(), '\0');
  const std::vector<uint8_t> first = pixels;
  ASSERT_EQ(likeness_get_info(decoder, &info), LIKENESS_OK);
  EXPECT_EQ(likeness_decode(decoder, info.mean_code, &view, 1, nullptr, LIKENESS_RGBA8), LIKENESS_OK);
  EXPECT_EQ(pixels, first);
  likeness_close(decoder);
}

TEST_F(CInterface, MistakesAreStatusesWithText) {
  likeness_decoder* decoder = nullptr;
  EXPECT_EQ(likeness_open("absent.safetensors", nullptr, &decoder), LIKENESS_BAD_FILE);
  EXPECT_THAT(likeness_last_error(), HasSubstr("absent.safetensors: no such file"));
  EXPECT_EQ(decoder, nullptr);
  EXPECT_EQ(likeness_open(nullptr, nullptr, &decoder), LIKENESS_INVALID_ARGUMENT);
  EXPECT_EQ(likeness_open_memory("garbage", 7, nullptr, &decoder), LIKENESS_BAD_FILE);
  EXPECT_EQ(likeness_open_memory("garbage, more of it", 19, nullptr, &decoder), LIKENESS_BAD_FILE);
  likeness_options options;
  likeness_default_options(&options);
  options.kernel = "abacus";
  EXPECT_EQ(likeness_open(path_.c_str(), &options, &decoder), LIKENESS_INVALID_ARGUMENT);
  EXPECT_THAT(likeness_last_error(), HasSubstr("abacus"));
  options.kernel = "portable";
  options.threads = 1;
  ASSERT_EQ(likeness_open(path_.c_str(), &options, &decoder), LIKENESS_OK);
  const float code[4] = {NAN, 0, 0, 0};
  std::vector<float> vertices(15);
  const likeness_mesh mesh = {vertices.data(), 12};
  EXPECT_EQ(likeness_decode(decoder, code, nullptr, 0, &mesh, LIKENESS_RGBA8), LIKENESS_INVALID_ARGUMENT);
  EXPECT_EQ(likeness_decode(decoder, code, nullptr, 1, &mesh, LIKENESS_RGBA8), LIKENESS_INVALID_ARGUMENT);
  EXPECT_EQ(likeness_decode(nullptr, code, nullptr, 0, &mesh, LIKENESS_RGBA8), LIKENESS_INVALID_ARGUMENT);
  likeness_close(decoder);
  likeness_close(nullptr);
}

void* EglAddress(void* user, const char* name) {
  ++*static_cast<int*>(user);
  return OffscreenContext::FunctionAddress(name);
}

TEST_F(CInterface, DecodesOnAGpuAsTheHeaderSays) {
  std::unique_ptr<OffscreenContext> context;
  try {
    context = std::make_unique<OffscreenContext>(4, 3);
  } catch (const Error& error) {
    GTEST_SKIP() << error.what();
  }
  const GlFunctions& gl = context->gl();
  int loaded = 0;
  likeness_gl_options options;
  likeness_gl_default_options(&options);
  likeness_gl_decoder* decoder = nullptr;
  EXPECT_EQ(likeness_gl_open(path_.c_str(), &options, &decoder), LIKENESS_INVALID_ARGUMENT);
  EXPECT_THAT(likeness_last_error(), HasSubstr("get_proc_address"));
  options.get_proc_address = EglAddress;
  options.user = &loaded;
  options.storage = "float";
  ASSERT_EQ(likeness_gl_open(path_.c_str(), &options, &decoder), LIKENESS_OK) << likeness_last_error();
  EXPECT_GT(loaded, 0);
  likeness_info info = {};
  info.size = sizeof(info);
  ASSERT_EQ(likeness_gl_get_info(decoder, &info), LIKENESS_OK);
  EXPECT_STREQ(info.kernel, "gl float");
  EXPECT_EQ(info.latent, 4);
  likeness_gl_outputs outputs = {};
  outputs.size = sizeof(outputs);
  ASSERT_EQ(likeness_gl_get_outputs(decoder, &outputs), LIKENESS_OK);
  const float views[6] = {0, 0, 1, 0.6f, 0, 0.8f};
  ASSERT_EQ(likeness_gl_decode(decoder, info.mean_code, views, 2, 1), LIKENESS_OK) << likeness_last_error();
  const std::vector<uint8_t> pixels = ReadTexture(gl, outputs.texture[1], 16, 16);
  const std::vector<float> vertices = ReadBuffer(gl, outputs.vertices, 15);

  likeness_decoder* processor = nullptr;
  ASSERT_EQ(likeness_open(path_.c_str(), nullptr, &processor), LIKENESS_OK);
  std::vector<uint8_t> expected(pixels.size());
  std::vector<float> places(15);
  const likeness_view view = {{0.6f, 0, 0.8f}, expected.data(), 64};
  const likeness_mesh mesh = {places.data(), 12};
  ASSERT_EQ(likeness_decode(processor, info.mean_code, &view, 1, &mesh, LIKENESS_RGBA8), LIKENESS_OK);
  // Whichever kernel this processor has.
  for (size_t i = 0; i < pixels.size(); ++i) ASSERT_NEAR(pixels[i], expected[i], 3) << i;
  for (size_t i = 0; i < places.size(); ++i) ASSERT_NEAR(vertices[i], places[i], 0.02) << i;
  likeness_close(processor);

  EXPECT_EQ(likeness_gl_decode(decoder, info.mean_code, nullptr, 1, 1), LIKENESS_INVALID_ARGUMENT);
  EXPECT_EQ(likeness_gl_decode(decoder, info.mean_code, views, 3, 1), LIKENESS_INVALID_ARGUMENT);
  likeness_gl_close(decoder);
  likeness_gl_close(nullptr);
  EXPECT_EQ(gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));

  const std::string bytes = ReadFile(path_);
  ASSERT_EQ(likeness_gl_open_memory(bytes.data(), bytes.size(), &options, &decoder), LIKENESS_OK);
  likeness_gl_close(decoder);
  EXPECT_EQ(likeness_gl_open("absent.safetensors", &options, &decoder), LIKENESS_BAD_FILE);
  context.reset();
  EXPECT_EQ(likeness_gl_open(path_.c_str(), &options, &decoder), LIKENESS_OPENGL_ERROR);
  EXPECT_THAT(likeness_last_error(), HasSubstr("no OpenGL context is current"));
}

}  // namespace
}  // namespace likeness
