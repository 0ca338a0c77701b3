// Checkpoints that PyTorch writes, imported, against what PyTorch itself computes with them. Needs a Python with torch
// (.deps/python) and the yardstick, ../shared/tools/torch_baseline.py.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "likeness/avatar/multiface/import.h"
#include "likeness/avatar/multiface/torch_archive.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/train/network.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr int kVertices = 40, kLatent = 32;

struct Case {
  const char* name;
  int size;
  const char* options;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class PublishedCheckpoint : public testing::TestWithParam<Case> {};

// The relative distance of two tensors, by their norms.
double Distance(const torch::Tensor& is, const torch::Tensor& should) {
  return ((is - should).norm() / should.norm()).item<double>();
}

TEST_P(PublishedCheckpoint, DecodesAndEncodesAsPyTorchDoes) {
  const auto tools = SampleData("../tools/torch_baseline.py");
  const fs::path source = fs::path(LIKENESS_SOURCE_DIR), python = source / ".deps/python/bin/python";
  if (!tools || !fs::exists(python)) GTEST_SKIP() << "the yardstick or .deps/python is absent";
  const ScratchFolder folder;
  const fs::path file = folder / "a.pth";
  const int size = GetParam().size;
  const std::string command =
      fmt::format("'{}' '{}' '{}' '{}' {} {} 2>'{}'", python.string(),
                  (source / "src/likeness/train/multiface_checkpoint.py").string(), tools->string(), file.string(),
                  size, GetParam().options, (folder / "log").string());
  ASSERT_EQ(std::system(command.c_str()), 0) << ReadFile(folder / "log");

  const std::map<std::string, Tensor> checkpoint = ReadTorchArchive(file);
  const MultifaceNetwork imported = ImportMultiface(file, checkpoint);
  EXPECT_EQ(imported.cameras, 5);
  EXPECT_EQ(imported.architecture.texture_size, size);
  const Network network(imported.architecture, imported.weights);

  std::vector<float> answers = ReadFloats(file.string() + ".raw");
  float* at = answers.data();
  const auto next = [&](std::vector<int64_t> shape) {
    const torch::Tensor tensor = torch::from_blob(at, shape);
    at += tensor.numel();
    return tensor;
  };
  const torch::Tensor z = next({1, kLatent}), view = next({1, 3});
  // Their first row is v = 0, ours v = 1.
  const torch::Tensor average = next({1, 3, size, size}).flip(2), mesh = next({1, 3 * kVertices});
  const torch::Tensor texture = next({1, 3, size, size}).flip(2), vertices = next({1, 3 * kVertices});
  const torch::Tensor mu = next({1, kLatent}), log_sigma = next({1, kLatent});
  ASSERT_EQ(at, answers.data() + answers.size());

  const torch::NoGradGuard no_grad;
  const Network::Decoding decoding = network.Decode(z, view);
  const Network::Encoding encoding = network.Encode(average, mesh);
  // Float32 rounds at 6e-8; twenty layers in another order of summation stay well below a thousandfold of it.
  EXPECT_LT(Distance(decoding.texture, texture), 1e-5);
  EXPECT_LT(Distance(decoding.vertices, vertices), 1e-5);
  EXPECT_LT(Distance(encoding.mu, mu), 1e-5);
  EXPECT_LT(Distance(encoding.log_sigma, log_sigma), 1e-5);
  // A flip would show: the texture is not its own mirror image.
  EXPECT_GT(Distance(decoding.texture.flip(2), texture), 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, PublishedCheckpoint,
                         testing::Values(Case{"base", 512, ""}, Case{"small", 256, ""}, Case{"res", 256, "res"},
                                         Case{"bilinear", 512, "bilinear"}, Case{"non", 256, "non"},
                                         Case{"all options", 256, "res bilinear non"}));

}  // namespace
}  // namespace likeness
