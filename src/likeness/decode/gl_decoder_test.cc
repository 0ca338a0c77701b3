#include "likeness/decode/gl_decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "likeness/base/error.h"
#include "likeness/base/testing.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/random_avatar.h"
#include "likeness/decode/test_architectures.h"
#include "likeness/gl/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

constexpr std::array<float, 3> kViews[2] = {{0.6f, 0, 0.8f}, {-0.48f, 0.6f, 0.64f}};

// What a decoder makes of two views.
struct Frame {
  std::vector<uint8_t> pixels[2];
  std::vector<float> vertices;
};

Frame FrameOnProcessor(const std::filesystem::path& file, int person, const std::vector<float>& code) {
  DecoderOptions options;
  options.kernel = "portable";
  options.person = person;
  const auto decoder = Decoder::Open(file, options);
  const int size = decoder->architecture().texture_size;
  Frame frame;
  frame.vertices.resize(static_cast<size_t>(decoder->architecture().vertex_count) * 3);
  Decoder::View views[2];
  for (int v = 0; v < 2; ++v) {
    frame.pixels[v].resize(static_cast<size_t>(size) * size * 4);
    views[v] = {{kViews[v][0], kViews[v][1], kViews[v][2]}, frame.pixels[v].data(), int64_t{4} * size};
  }
  decoder->Decode(code, views, {frame.vertices.data(), 12});
  return frame;
}

Frame ReadFrame(const GlFunctions& gl, const GlDecoder& decoder) {
  const int size = decoder.architecture().texture_size;
  Frame frame;
  for (int v = 0; v < 2; ++v) frame.pixels[v] = ReadTexture(gl, decoder.texture(v), size, size);
  frame.vertices = ReadBuffer(gl, decoder.vertices(), 3 * decoder.architecture().vertex_count);
  return frame;
}

template <typename Base>
class WithFolder : public WithContext<Base, 4, 3> {
 protected:
  std::filesystem::path FileOf(const Avatar& avatar) const {
    SaveAvatar(folder_ / "avatar", avatar);
    return folder_ / "avatar";
  }

  const ScratchFolder folder_;
};

class GlDecoderChoice : public WithFolder<testing::TestWithParam<Choice>> {};
class GlDecoderTest : public WithFolder<testing::Test> {};

Architecture Small() {
  return Choose("", [](Architecture& a) { a.texture_size = 16; }).architecture;
}

// Small ones: here the driver takes more time to compile a layer than to run it. Two convolutions show all that a kind
// of network has of its own; the eight of Multiface's layout show tiles of both sizes and groups along z.
std::vector<Choice> SmallChoices() {
  std::vector<Choice> small;
  for (Choice choice : Choices()) {
    if (choice.name == "size 128" || choice.name == "multiface fc8-all") continue;
    if (choice.architecture.texture_size == 64) choice.architecture.texture_size = 16;
    small.push_back(choice);
  }
  return small;
}

bool AlsoInHalf(const Choice& choice) {
  return choice.name == "tied" || choice.name == "residual" || choice.name == "bilinear";
}

TEST_P(GlDecoderChoice, EqualsTheProcessor) {
  const Avatar avatar = RandomAvatar(GetParam().architecture, 1);
  const std::filesystem::path file = FileOf(avatar);
  const int person = avatar.architecture.identities - 1;
  const std::vector<float>& code = avatar.codes[1].mu;
  const Frame truth = FrameOnProcessor(file, person, code);
  std::vector<std::string> storages = {GetParam().name == "multiface" ? "half" : "float"};
  if (AlsoInHalf(GetParam())) storages.emplace_back("half");
  for (const std::string& storage : storages) {
    SCOPED_TRACE(storage);
    GlDecoderOptions options;
    options.storage = storage;
    options.person = person;
    const auto decoder = GlDecoder::Open(gl(), file, options);
    decoder->Decode(code, kViews, true);
    const Frame frame = ReadFrame(gl(), *decoder);
    const KernelAccuracy first = Compare({frame.pixels[0], frame.vertices}, {truth.pixels[0], truth.vertices});
    const KernelAccuracy second = Compare({frame.pixels[1], {}}, {truth.pixels[1], {}});
    EXPECT_GE(std::min(first.psnr_db, second.psnr_db), kLeastPsnrDb);
    EXPECT_LE(first.largest_distance_mm, storage == "float" ? 2e-4 : kMostDistanceMm / 2);
    for (int v = 0; v < 2; ++v) {
      for (size_t i = 3; i < frame.pixels[v].size(); i += 4) ASSERT_EQ(frame.pixels[v][i], 255);
      if (storage == "half") continue;
      // Either is within 2e-3 of the exact colour (decoder_test.cc): bytes differ by one, and where that lies within
      // twice as much of the middle between two bytes, which is 0.8% of the colours; here there are at least 768.
      size_t others = 0;
      for (size_t i = 0; i < frame.pixels[v].size(); ++i) {
        ASSERT_NEAR(frame.pixels[v][i], truth.pixels[v][i], 1) << "view " << v << ", byte " << i;
        if (frame.pixels[v][i] != truth.pixels[v][i]) ++others;
      }
      EXPECT_LE(others, frame.pixels[v].size() * 3 / 4 / 50);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Architectures, GlDecoderChoice, testing::ValuesIn(SmallChoices()));

TEST_F(GlDecoderTest, PartsOfAFrameEqualTheWhole) {
  const Avatar avatar = RandomAvatar(Small(), 2);
  const auto decoder = GlDecoder::Open(gl(), FileOf(avatar));
  const std::vector<float>&code = avatar.codes[0].mu, other = avatar.codes[1].mu;
  decoder->Decode(code, kViews, true);
  const Frame whole = ReadFrame(gl(), *decoder);
  decoder->Decode(other, kViews, true);
  const Frame others = ReadFrame(gl(), *decoder);
  EXPECT_NE(others.vertices, whole.vertices);
  EXPECT_NE(others.pixels[0], whole.pixels[0]);

  decoder->Decode(code, {}, true);  // the mesh alone: the textures stay
  Frame frame = ReadFrame(gl(), *decoder);
  EXPECT_EQ(frame.vertices, whole.vertices);
  EXPECT_EQ(frame.pixels[0], others.pixels[0]);
  decoder->Decode(other, {&kViews[1], 1}, false);  // a view alone: the mesh and the other texture stay
  frame = ReadFrame(gl(), *decoder);
  EXPECT_EQ(frame.vertices, whole.vertices);
  EXPECT_EQ(frame.pixels[0], others.pixels[1]);
  EXPECT_EQ(frame.pixels[1], others.pixels[1]);
}

// Colours beyond 0 to 255 too, by a display transform that is far from none.
TEST_F(GlDecoderTest, HalfFloatTexturesAreNotClamped) {
  const Avatar avatar = RandomAvatar(Small(), 3);
  const std::filesystem::path file = FileOf(avatar);
  const std::vector<float>& code = avatar.codes[0].mu;
  GlDecoderOptions options;
  options.format = PixelFormat::kRgba16F;
  options.storage = "float";
  options.display = {{2.5f, 0.5f, 1}, {-100, 30, 0}};
  const auto decoder = GlDecoder::Open(gl(), file, options);
  decoder->Decode(code, {kViews, 1}, false);
  std::vector<float> colours(16 * 16 * 4), plain(colours.size());
  gl().BindTexture(GL_TEXTURE_2D, decoder->texture(0));
  gl().GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, colours.data());
  options.display = {};
  const auto untouched = GlDecoder::Open(gl(), file, options);
  untouched->Decode(code, {kViews, 1}, false);
  gl().BindTexture(GL_TEXTURE_2D, untouched->texture(0));
  gl().GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, plain.data());
  const float gain[4] = {2.5f, 0.5f, 1, 1}, offset[4] = {-100, 30, 0, 0};
  const std::vector<uint8_t> bytes = FrameOnProcessor(file, 0, code).pixels[0];
  for (size_t i = 0; i < colours.size(); ++i) {
    // Half precision, which OpenGL may round either way: 2^-10 of each.
    const float expected = gain[i % 4] * plain[i] + offset[i % 4] / 255;
    ASSERT_NEAR(colours[i], expected, (std::abs(gain[i % 4] * plain[i]) + std::abs(expected)) / 1024 + 1e-5) << i;
    ASSERT_NEAR(255 * std::clamp(plain[i], 0.0f, 1.0f), bytes[i], 0.5 + 255.0 / 1024) << i;
  }
  EXPECT_LT(*std::min_element(colours.begin(), colours.end()), 0);
  EXPECT_GT(*std::max_element(colours.begin(), colours.end()), 1);
}

TEST_F(GlDecoderTest, HalfStorageIsTakenWhereItSuffices) {
  Avatar avatar = RandomAvatar(Small(), 4);
  const auto usual = GlDecoder::Open(gl(), FileOf(avatar));
  EXPECT_TRUE(usual->half());
  ASSERT_NE(usual->accuracy(), nullptr);
  EXPECT_TRUE(usual->accuracy()->Suffices());
  avatar.vertex_variance = 1e6f;  // a metre: 2^-11 of it is more than 0.02 mm
  const auto large = GlDecoder::Open(gl(), FileOf(avatar));
  EXPECT_FALSE(large->half());
  EXPECT_EQ(large->accuracy(), nullptr);
}

TEST_F(GlDecoderTest, CostsAreThoseOfTheShapes) {
  Architecture a = Small();
  a.latent = 128;
  const Avatar avatar = RandomAvatar(a, 5);
  GlDecoderOptions options;
  options.storage = "half";
  const auto decoder = GlDecoder::Open(gl(), FileOf(avatar), options);
  // 16 x 16: 32 x 4 x 4 features, then 16 x 8 x 8, then colours.
  const std::vector<GlLayerCost> costs = decoder->Costs(2, true);
  ASSERT_EQ(costs.size(), 5U);
  EXPECT_EQ(costs[0].name, "code_fc");
  EXPECT_EQ(costs[0].flops, 2 * 128 * 256);
  EXPECT_EQ(costs[0].weight_bytes, 2 * 128 * 256);
  EXPECT_EQ(costs[1].name, "mesh_fc");
  EXPECT_EQ(costs[1].bias_bytes, 4 * 112);
  EXPECT_EQ(costs[3].name, "convolution 0");
  const double channels = static_cast<double>(DecoderChannels(a)[0]), next = static_cast<double>(DecoderChannels(a)[1]);
  EXPECT_EQ(costs[3].flops, 2 * 2 * 5 * 5 * 4 * channels * 4 * next);
  EXPECT_EQ(costs[3].bias_bytes, 2 * 8 * 8 * next);
  EXPECT_EQ(costs[4].feature_bytes, 2 * (2 * 8 * 8 * next + 4 * 16 * 16));
  EXPECT_EQ(decoder->Costs(0, true).size(), 2U);
}

TEST_F(GlDecoderTest, RefusesWhatDoesNotFit) {
  const Avatar avatar = RandomAvatar(Small(), 6);
  const std::filesystem::path file = FileOf(avatar);
  const auto decoder = GlDecoder::Open(gl(), file);
  std::vector<float> code(11);
  std::array<float, 3> view = {0, 0, 1};
  const auto error = [&] { return ErrorOf([&] { decoder->Decode(code, {&view, 1}, true); }); };
  EXPECT_EQ(error(), "");
  view[1] = 0.5f;
  EXPECT_THAT(error(), HasSubstr("expected a unit vector"));
  view = {0, 0, 1};
  code[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(error(), HasSubstr("not finite"));
  code.resize(10);
  EXPECT_THAT(error(), HasSubstr("this avatar's have 11"));
  GlDecoderOptions options;
  options.storage = "double";
  EXPECT_THAT(ErrorOf([&] { GlDecoder::Open(gl(), file, options); }), HasSubstr("no storage 'double'"));
  EXPECT_THAT(ErrorOf([&] { GlDecoder::Open(gl(), folder_ / "absent"); }), HasSubstr("absent: no such file"));
}

// Contexts that this machine does not have, by functions that tell of less.
TEST_F(GlDecoderTest, RefusesContextsThatCannotDoIt) {
  const std::filesystem::path file = FileOf(RandomAvatar(Small(), 7));
  GlFunctions old = gl();
  old.major_version = 3;
  EXPECT_THAT(ErrorOf([&] { GlDecoder::Open(old, file); }), HasSubstr("needs OpenGL 4.3; this context"));
  GlFunctions narrow = gl();
  narrow.GetInteger64v = [](GLenum, GLint64* value) { *value = 4096; };
  EXPECT_THAT(ErrorOf([&] { GlDecoder::Open(narrow, file); }), HasSubstr("takes a buffer of"));
}

}  // namespace
}  // namespace likeness
