#include "likeness/decode/decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <thread>

#include "likeness/avatar/plain_network.h"
#include "likeness/base/testing.h"
#include "likeness/decode/kernels.h"
#include "likeness/decode/random_avatar.h"
#include "likeness/decode/test_architectures.h"

namespace likeness {
namespace {

using testing::HasSubstr;

std::string FileOf(const Avatar& avatar) {
  static const ScratchFolder folder;
  static int count = 0;
  const std::filesystem::path path = folder / fmt::format("{}.safetensors", count++);
  SaveAvatar(path, avatar);
  return path.string();
}

constexpr float kViews[2][3] = {{0.6f, 0, 0.8f}, {-0.48f, 0.6f, 0.64f}};

// What the slow network gives, in shown units.
struct Truth {
  std::vector<double> texture[2];  // [S, S, 3], not clamped
  std::vector<double> vertices;
};

int LastPerson(const Avatar& avatar) { return avatar.architecture.identities - 1; }

// Of the last person; without values the named conditions are at their means.
Truth TruthOf(const Avatar& avatar, const std::vector<float>& code, const std::vector<float>& conditions = {}) {
  const PlainNetwork plain{avatar.architecture, avatar.weights};
  std::vector<double> named(NamedChannels(avatar.architecture), 0.0);
  for (size_t i = 0; i < conditions.size(); ++i) {
    named[i] = (conditions[i] - avatar.condition_mean[i]) / avatar.condition_deviation[i];
  }
  const std::vector<double> condition = plain.Condition(LastPerson(avatar), named);
  const Identity& person = avatar.identities.back();
  const std::vector<double> z(code.begin(), code.end());
  Truth truth;
  const int area = avatar.architecture.texture_size * avatar.architecture.texture_size;
  for (int v = 0; v < 2; ++v) {
    const std::vector<double> texture = plain.DecodeTexture(z, {kViews[v][0], kViews[v][1], kViews[v][2]}, condition);
    for (int i = 0; i < 3 * area; ++i) {
      truth.texture[v].push_back(texture[i % 3 * area + i / 3] * std::sqrt(avatar.texture_variance) +
                                 person.texture_mean.values()[i]);
    }
  }
  truth.vertices = plain.DecodeVertices(z, condition);
  for (size_t i = 0; i < truth.vertices.size(); ++i) {
    truth.vertices[i] = truth.vertices[i] * std::sqrt(avatar.vertex_variance) + person.vertex_mean.data()[i];
  }
  return truth;
}

struct Frame {
  std::vector<uint8_t> pixels[2];
  std::vector<float> vertices;
};

// Two views and the mesh, into rows with something between them that must stay as it is.
Frame DecodeFrame(Decoder& decoder, const std::vector<float>& code, PixelFormat format = PixelFormat::kRgba8) {
  const int size = decoder.architecture().texture_size, vertices = decoder.architecture().vertex_count;
  const int64_t row = size * (format == PixelFormat::kRgba8 ? 4 : 8), pitch = row + 12;
  std::vector<uint8_t> padded[2];
  std::vector<float> spread(static_cast<size_t>(vertices) * 5, -7);
  Decoder::View views[2];
  for (int v = 0; v < 2; ++v) {
    padded[v].assign(static_cast<size_t>(pitch) * size, 0xab);
    std::copy_n(kViews[v], 3, views[v].direction);
    views[v].pixels = padded[v].data();
    views[v].row_bytes = pitch;
  }
  decoder.Decode(code, views, {spread.data(), 20}, format);
  Frame frame;
  for (int v = 0; v < 2; ++v) {
    for (int y = 0; y < size; ++y) {
      const auto begin = padded[v].begin() + y * pitch;
      frame.pixels[v].insert(frame.pixels[v].end(), begin, begin + row);
      EXPECT_TRUE(std::all_of(begin + row, begin + pitch, [](uint8_t b) { return b == 0xab; })) << "row " << y;
    }
  }
  for (int i = 0; i < vertices; ++i) {
    frame.vertices.insert(frame.vertices.end(), &spread[5 * i], &spread[5 * i] + 3);
    EXPECT_EQ(spread[5 * i + 3], -7);
  }
  return frame;
}

float HalfValue(const uint8_t* bytes) {
  uint16_t half = 0;
  std::memcpy(&half, bytes, 2);
  const int exponent = half >> 10 & 31;
  const float mantissa = static_cast<float>(half & 1023);
  const float value = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
  return (half & 0x8000) != 0 ? -value : value;
}

// Largest distance of a byte from the value that it stands for, less the half that rounding may take.
double WorstByte(const std::vector<uint8_t>& pixels, const std::vector<double>& truth) {
  double worst = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const double value = std::clamp(truth[i], 0.0, 255.0);
    worst = std::max(worst, std::abs(pixels[i / 3 * 4 + i % 3] - value) - 0.5);
  }
  return worst;
}

double PsnrOf(const std::vector<uint8_t>& pixels, const std::vector<double>& truth) {
  double squares = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const double difference = pixels[i / 3 * 4 + i % 3] - std::floor(std::clamp(truth[i], 0.0, 255.0) + 0.5);
    squares += difference * difference;
  }
  return squares == 0 ? 100 : 10 * std::log10(255 * 255 * static_cast<double>(truth.size()) / squares);
}

class DecoderChoice : public testing::TestWithParam<Choice> {};

TEST_P(DecoderChoice, EveryKernelEqualsThePlainNetwork) {
  const Avatar avatar = RandomAvatar(GetParam().architecture, 1);
  const std::string file = FileOf(avatar);
  const std::vector<float>& code = avatar.codes[1].mu;
  const std::vector<float>& conditions = avatar.codes[1].conditions;
  const Truth truth = TruthOf(avatar, code, conditions);
  for (const Kernel* kernel : AllKernels()) {
    if (!kernel->available()) {
      GTEST_LOG_(INFO) << "this processor lacks " << kernel->name;
      continue;
    }
    SCOPED_TRACE(kernel->name);
    DecoderOptions options;
    options.kernel = kernel->name;
    options.person = LastPerson(avatar);
    options.conditions = conditions;
    const auto decoder = Decoder::Open(file, options);
    const Frame frame = DecodeFrame(*decoder, code);
    const bool exact = kernel->name == std::string("portable");
    for (int v = 0; v < 2; ++v) {
      // float32 through up to eleven layers, of values up to 255; half-precision biases are 2^-11 of up to 255.
      if (kernel->full_precision) {
        EXPECT_LT(WorstByte(frame.pixels[v], truth.texture[v]), exact ? 2e-3 : 0.25);
      }
      EXPECT_GE(PsnrOf(frame.pixels[v], truth.texture[v]), kLeastPsnrDb);
      for (size_t i = 3; i < frame.pixels[v].size(); i += 4) ASSERT_EQ(frame.pixels[v][i], 255);
    }
    double distance = 0;
    for (size_t i = 0; i < frame.vertices.size(); ++i) {
      distance = std::max(distance, std::abs(frame.vertices[i] - truth.vertices[i]));
    }
    EXPECT_LT(distance, exact ? 1e-4 : kMostDistanceMm / 2);

    const Frame half = DecodeFrame(*decoder, code, PixelFormat::kRgba16F);
    const double tolerance = kernel->full_precision ? 0.25 : 6;
    for (size_t i = 0; i < truth.texture[0].size(); ++i) {
      const double value = 255 * HalfValue(&half.pixels[0][2 * (i / 3 * 4 + i % 3)]);
      ASSERT_NEAR(value, truth.texture[0][i], tolerance + std::abs(truth.texture[0][i]) / 2048) << i;
    }
    ASSERT_EQ(HalfValue(&half.pixels[1][6]), 1);
  }
}

INSTANTIATE_TEST_SUITE_P(Architectures, DecoderChoice, testing::ValuesIn(Choices()));

// A pool of somebody else's: a thread for each share, in falling order.
void Pool(void* pool, int count, void (*body)(void* context, int index), void* context) {
  ++*static_cast<int*>(pool);
  std::vector<std::thread> threads;
  for (int i = count - 1; i >= 0; --i) threads.emplace_back(body, context, i);
  for (std::thread& thread : threads) thread.join();
}

TEST(Decoder, BytesDoNotDependOnThreads) {
  const Avatar avatar = RandomAvatar(Choose("", [](Architecture& a) { a.texture_size = 128; }).architecture, 2);
  const std::string file = FileOf(avatar);
  for (const Kernel* kernel : AvailableKernels()) {
    DecoderOptions options;
    options.kernel = kernel->name;
    options.threads = 1;
    const Frame one = DecodeFrame(*Decoder::Open(file, options), avatar.codes[0].mu);
    int calls = 0;
    for (const int threads : {2, 3, 7, -4}) {
      options.threads = std::abs(threads);
      options.parallel = threads < 0 ? Pool : nullptr;
      options.pool = &calls;
      const auto decoder = Decoder::Open(file, options);
      for (int repeat = 0; repeat < 2; ++repeat) {
        const Frame frame = DecodeFrame(*decoder, avatar.codes[0].mu);
        EXPECT_EQ(frame.pixels[0], one.pixels[0]) << kernel->name << " with " << threads;
        EXPECT_EQ(frame.pixels[1], one.pixels[1]) << kernel->name << " with " << threads;
        EXPECT_EQ(frame.vertices, one.vertices) << kernel->name << " with " << threads;
      }
    }
    EXPECT_GT(calls, 0);
  }
}

TEST(Decoder, PeopleThatItCannotShowAreRefused) {
  Architecture a = Choose("", [](Architecture& people) {
                     people.identities = 2;
                     people.identity = IdentityConditioning::kOneHot;
                   }).architecture;
  DecoderOptions options;
  options.person = 2;
  EXPECT_THAT(ErrorOf([&] { Decoder::Open(FileOf(RandomAvatar(a, 8)), options); }), HasSubstr("there is no person 2"));
  a.model = ModelKind::kBilinear;
  EXPECT_THAT(ErrorOf([&] { Decoder::Open(FileOf(RandomAvatar(a, 8))); }), HasSubstr("bilinear"));
}

TEST(Decoder, PartsOfAFrameEqualTheWhole) {
  const Avatar avatar = RandomAvatar(Choose("", [](Architecture&) {}).architecture, 3);
  const auto decoder = Decoder::Open(FileOf(avatar));
  const std::vector<float>& code = avatar.codes[0].mu;
  const Frame whole = DecodeFrame(*decoder, code);
  std::vector<float> vertices(whole.vertices.size());
  decoder->Decode(code, {}, {vertices.data(), 12});
  EXPECT_EQ(vertices, whole.vertices);
  std::vector<uint8_t> pixels(whole.pixels[1].size());
  Decoder::View view{{kViews[1][0], kViews[1][1], kViews[1][2]}, pixels.data(), 4 * 64};
  decoder->Decode(code, {&view, 1}, {});
  EXPECT_EQ(pixels, whole.pixels[1]);
}

TEST(Decoder, DisplayTransformIsApplied) {
  const Avatar avatar = RandomAvatar(Choose("", [](Architecture&) {}).architecture, 4);
  DecoderOptions options;
  options.kernel = "portable";
  options.display = {{1.25f, 0.5f, 1}, {-20, 30, 0}};
  const auto decoder = Decoder::Open(FileOf(avatar), options);
  Truth truth = TruthOf(avatar, avatar.codes[0].mu);
  for (size_t i = 0; i < truth.texture[0].size(); ++i) {
    truth.texture[0][i] = options.display.gain[i % 3] * truth.texture[0][i] + options.display.offset[i % 3];
  }
  EXPECT_LT(WorstByte(DecodeFrame(*decoder, avatar.codes[0].mu).pixels[0], truth.texture[0]), 2e-3);
}

TEST(Decoder, JacobianEqualsFiniteDifferences) {
  for (const bool linear : {false, true}) {
    Architecture a = Choose("", [](Architecture&) {}).architecture;
    if (linear) a.model = ModelKind::kLinear;
    const Avatar avatar = RandomAvatar(a, 5);
    const PlainNetwork plain{a, avatar.weights};
    const std::vector<float>& code = avatar.codes[0].mu;
    const int latent = a.latent, rows = 3 * a.vertex_count;
    std::vector<double> expected(static_cast<size_t>(rows) * latent);
    for (int l = 0; l < latent; ++l) {
      constexpr double kStep = 1e-6;
      std::vector<double> z(code.begin(), code.end()), more = z;
      z[l] -= kStep, more[l] += kStep;
      const std::vector<double> below = plain.DecodeVertices(z), above = plain.DecodeVertices(more);
      for (int i = 0; i < rows; ++i) {
        expected[static_cast<size_t>(i) * latent + l] =
            (above[i] - below[i]) / (2 * kStep) * std::sqrt(avatar.vertex_variance);
      }
    }
    for (const Kernel* kernel : AvailableKernels()) {
      DecoderOptions options;
      options.kernel = kernel->name;
      const auto decoder = Decoder::Open(FileOf(avatar), options);
      std::vector<float> all(expected.size());
      decoder->Jacobian(code, {}, all);
      const double tolerance = kernel->dense_bytes == 4 ? 1e-5 : 2e-3;
      for (size_t i = 0; i < all.size(); ++i) ASSERT_NEAR(all[i], expected[i], tolerance) << kernel->name << " " << i;
      const std::vector<int> listed = {36, 0, 5};
      std::vector<float> some(listed.size() * 3 * latent);
      decoder->Jacobian(code, listed, some);
      for (size_t k = 0; k < listed.size(); ++k) {
        for (int i = 0; i < 3 * latent; ++i) {
          EXPECT_EQ(some[k * 3 * latent + i], all[static_cast<size_t>(listed[k]) * 3 * latent + i]) << k << " " << i;
        }
      }
    }
  }
}

// Ranges of fixed-point features come from a few codes near the mean one.
TEST(Decoder, CodesFarFromTheAvatarsOwnKeepTheirAccuracy) {
  const Avatar avatar = RandomAvatar(Choose("", [](Architecture&) {}).architecture, 9);
  std::vector<float> code = avatar.codes[0].mu;
  for (float& v : code) v *= 4;
  const Truth truth = TruthOf(avatar, code);
  for (const Kernel* kernel : AvailableKernels()) {
    DecoderOptions options;
    options.kernel = kernel->name;
    const auto decoder = Decoder::Open(FileOf(avatar), options);
    EXPECT_GE(PsnrOf(DecodeFrame(*decoder, code).pixels[0], truth.texture[0]), kLeastPsnrDb) << kernel->name;
  }
}

// Without view features of the code's size, a feature that only sides show must have its range from there.
TEST(Decoder, SidesKeepTheirAccuracy) {
  const Avatar avatar = RandomAvatar(Choose("", [](Architecture&) {}).architecture, 10);
  Avatar by_side = avatar;
  for (float& v : by_side.weights["decoder.view_fc.weight"].values) v *= 50;
  for (float& v : by_side.weights["decoder.code_fc.weight"].values) v *= 0.01f;
  const std::vector<float>& code = by_side.codes[0].mu;
  const Truth truth = TruthOf(by_side, code);
  for (const Kernel* kernel : AvailableKernels()) {
    DecoderOptions options;
    options.kernel = kernel->name;
    const auto decoder = Decoder::Open(FileOf(by_side), options);
    EXPECT_GE(PsnrOf(DecodeFrame(*decoder, code).pixels[0], truth.texture[0]), kLeastPsnrDb) << kernel->name;
  }
}

// Features far from zero, which the next layer's biases take away again: bfloat16 has no room for what is left, and
// half-precision biases neither where it is very far.
TEST(Decoder, AKernelThatLosesTheTextureIsNotChosen) {
  const Architecture a = Choose("", [](Architecture&) {}).architecture;
  for (const float far : {30.0f, 150.0f}) {
    Avatar avatar = RandomAvatar(a, 6);
    for (float& v : avatar.weights["decoder.texture_conv.1.bias"].values) v += far;
    const PlainNetwork plain{a, avatar.weights};
    const std::string next = "decoder.texture_conv.2";
    const std::vector<double> zeros(16 * 16 * 32, 0.0), shifted(zeros.size(), far);
    const std::vector<double> without = plain.Apply(next, zeros, 16), with = plain.Apply(next, shifted, 16);
    std::vector<float>& bias = avatar.weights[next + ".bias"].values;
    for (size_t i = 0; i < bias.size(); ++i) bias[i] -= static_cast<float>(with[i] - without[i]);
    const std::string file = FileOf(avatar);
    const std::vector<float>& code = avatar.codes[0].mu;
    const Truth truth = TruthOf(avatar, code);
    const auto automatic = Decoder::Open(file);
    EXPECT_GE(PsnrOf(DecodeFrame(*automatic, code).pixels[0], truth.texture[0]), kLeastPsnrDb);
    for (const Kernel* kernel : AvailableKernels()) {
      if (kernel->full_precision) continue;
      DecoderOptions options;
      options.kernel = kernel->name;
      EXPECT_NE(automatic->kernel(), kernel->name);
      std::unique_ptr<Decoder> decoder;
      const std::string refused = ErrorOf([&] { decoder = Decoder::Open(file, options); });
      if (kernel->fixed_point) {
        EXPECT_THAT(refused, HasSubstr("cannot represent"));
      } else {
        ASSERT_EQ(refused, "");
        EXPECT_LT(PsnrOf(DecodeFrame(*decoder, code).pixels[0], truth.texture[0]), kLeastPsnrDb);
      }
    }
    if (far > 100) {
      EXPECT_EQ(automatic->kernel(), "portable");
    }
  }
}

TEST(Decoder, RefusesWhatDoesNotFit) {
  const Avatar avatar = RandomAvatar(Choose("", [](Architecture&) {}).architecture, 7);
  const auto decoder = Decoder::Open(FileOf(avatar));
  std::vector<uint8_t> pixels(64 * 64 * 4);
  std::vector<float> code(11), vertices(37 * 3);
  Decoder::View view{{0, 0, 1}, pixels.data(), 256};
  const auto error = [&] { return ErrorOf([&] { decoder->Decode(code, {&view, 1}, {vertices.data(), 12}); }); };
  EXPECT_EQ(error(), "");
  view.direction[1] = 0.5f;
  EXPECT_THAT(error(), HasSubstr("expected a unit vector"));
  view = {{0, 0, 1}, pixels.data(), 255};
  EXPECT_THAT(error(), HasSubstr("expected at least 256"));
  view = {{0, 0, 1}, nullptr, 256};
  EXPECT_THAT(error(), HasSubstr("no memory"));
  view.pixels = pixels.data();
  code[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(error(), HasSubstr("not finite"));
  code.resize(10);
  EXPECT_THAT(error(), HasSubstr("this avatar's have 11"));
  DecoderOptions options;
  options.kernel = "amxx";
  EXPECT_THAT(ErrorOf([&] { options.Check(); }), HasSubstr("no kernel 'amxx'"));
}

// Each case changes one entry of a good file.
TEST(Decoder, RefusesDamagedFiles) {
  const ScratchFolder folder;
  SaveAvatar(folder / "good", RandomAvatar(Choose("", [](Architecture& a) { a.texture_size = 16; }).architecture, 8));
  const SafetensorsFile good(folder / "good");
  const auto error = [&](const std::string& key, const std::string& value, const std::string& tensor = "",
                         const std::vector<float>& values = {}) {
    std::map<std::string, std::string> metadata = good.metadata();
    if (!key.empty()) metadata[key] = value;
    std::vector<TensorView> tensors;
    for (const std::string& name : good.names()) {
      if (name != tensor) tensors.push_back({name, good.DTypeOf(name), good.ShapeOf(name), good.Bytes(name)});
    }
    if (!values.empty()) tensors.push_back(ViewOf(tensor, {static_cast<int64_t>(values.size())}, values));
    WriteSafetensors(folder / "bad", tensors, metadata);
    return ErrorOf([&] { Decoder::Open(folder / "bad"); });
  };
  EXPECT_EQ(error("", ""), "");
  EXPECT_THAT(error("format", "pt"), HasSubstr("bad: is no avatar"));
  EXPECT_THAT(error("version", "9"), HasSubstr("version '9'"));
  EXPECT_THAT(error("architecture", "{}"), HasSubstr("not understood"));
  EXPECT_THAT(error("texture.variance", "nan"), HasSubstr("positive number"));
  EXPECT_THAT(error("", "", "decoder.code_fc.bias"), HasSubstr("'decoder.code_fc.bias' is missing"));
  EXPECT_THAT(error("", "", "decoder.view_fc.bias", {1, 2, 3}), HasSubstr("of another type or shape"));
  EXPECT_THAT(error("", "", "decoder.view_fc.bias", std::vector<float>(8, INFINITY)), HasSubstr("not finite"));
  EXPECT_THAT(error("", "", "decoder.gaze_fc.bias", {1, 2, 3}), HasSubstr("'decoder.gaze_fc.bias'"));
  EXPECT_THAT(error("", "", "vertex.mean"), HasSubstr("vertex.mean"));
  EXPECT_THAT(error("", "", "codes.mu"), HasSubstr("codes.mu"));
  // The encoder is not needed.
  EXPECT_EQ(error("", "", "encoder.mesh_fc.weight"), "");
  EXPECT_THAT(ErrorOf([&] { Decoder::Open(folder / "absent"); }), HasSubstr("absent: no such file"));
}

}  // namespace
}  // namespace likeness
