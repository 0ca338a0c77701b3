// What models say is read back field by field; what they compute is compared with the run-time decoder by ONNX Runtime,
// where scripts/setup --with-onnxruntime has put it.

#include "likeness/decode/export/onnx.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <set>

#include "likeness/avatar/avatar_id.h"
#include "likeness/base/file.h"
#include "likeness/base/npy.h"
#include "likeness/base/testing.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/random_avatar.h"
#include "likeness/decode/test_architectures.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using Extents = std::vector<int64_t>;

constexpr int kFrames = 3;  // run at once
constexpr float kViews[kFrames][3] = {{0.6f, 0, 0.8f}, {-0.48f, 0.6f, 0.64f}, {0, 0, 1}};

// Fields of a message, by number: whole numbers, and bytes of texts and messages.
struct Message {
  std::multimap<int, std::string> bytes;
  std::multimap<int, int64_t> numbers;

  explicit Message(const std::string& text) {
    size_t at = 0;
    const auto number = [&] {
      uint64_t value = 0;
      for (int shift = 0;; shift += 7) {
        const auto byte = static_cast<uint8_t>(text.at(at++));
        value |= static_cast<uint64_t>(byte & 0x7f) << shift;
        if (byte < 0x80) return value;
      }
    };
    while (at < text.size()) {
      const uint64_t tag = number();
      const int field = static_cast<int>(tag >> 3);
      if ((tag & 7) == 0) {
        numbers.emplace(field, static_cast<int64_t>(number()));
      } else {
        const uint64_t size = (tag & 7) == 2 ? number() : 4;
        if (size > text.size() - at) throw std::out_of_range("a field is cut short");
        bytes.emplace(field, text.substr(at, size));
        at += size;
      }
    }
  }

  std::string Bytes(int field) const { return bytes.count(field) == 1 ? bytes.find(field)->second : ""; }
  int64_t Number(int field) const { return numbers.count(field) == 1 ? numbers.find(field)->second : -1; }
  std::vector<std::string> AllBytes(int field) const {
    std::vector<std::string> all;
    for (auto [it, end] = bytes.equal_range(field); it != end; ++it) all.push_back(it->second);
    return all;
  }
  Extents AllNumbers(int field) const {
    Extents all;
    for (auto [it, end] = numbers.equal_range(field); it != end; ++it) all.push_back(it->second);
    return all;
  }
};

// A model, by the numbers of fields in onnx.proto.
struct Model {
  Message file, graph;

  explicit Model(const std::string& bytes) : file(bytes), graph(file.Bytes(7)) {}

  // Extents of inputs (11) or outputs (12); a batch's is -1.
  std::map<std::string, Extents> Values(int field) const {
    std::map<std::string, Extents> values;
    for (const std::string& text : graph.AllBytes(field)) {
      const Message value(text), tensor(Message(value.Bytes(2)).Bytes(1));
      Extents& extents = values[value.Bytes(1)];
      for (const std::string& dimension : Message(tensor.Bytes(2)).AllBytes(1)) {
        const Message extent(dimension);
        extents.push_back(extent.Bytes(2) == "batch" ? -1 : extent.Number(1));
      }
      EXPECT_EQ(tensor.Number(1), value.Bytes(1) == "person" ? 7 : 1);  // int64, float
      EXPECT_NE(value.Bytes(3), "");
    }
    return values;
  }
};

class OnnxTest : public testing::Test {
 protected:
  std::string Save(const std::string& name, const Avatar& avatar) const {
    SaveAvatar(folder_ / (name + ".safetensors"), avatar);
    return folder_ / (name + ".safetensors");
  }

  const ScratchFolder folder_;
};

class OnnxStructure : public OnnxTest, public testing::WithParamInterface<Choice> {};

TEST_P(OnnxStructure, IsAGraphThatCanBeRun) {
  const Architecture& a = GetParam().architecture;
  const std::string file = Save("a", RandomAvatar(a, 1));
  const Model model(OnnxBytes(file));
  EXPECT_EQ(model.file.Number(1), 7);
  EXPECT_EQ(Message(model.file.Bytes(8)).Number(2), 13);

  std::map<std::string, Extents> inputs = {{"code", {-1, a.latent}}};
  if (a.model != ModelKind::kLinear) inputs["view"] = {-1, 3};
  for (const NamedCondition& condition : a.conditions) inputs["condition." + condition.name] = {-1, condition.size};
  if (a.identities > 1) inputs["person"] = {-1};
  EXPECT_EQ(model.Values(11), inputs);
  EXPECT_EQ(model.Values(12), (std::map<std::string, Extents>{{"texture", {-1, 3, a.texture_size, a.texture_size}},
                                                              {"vertices", {-1, a.vertex_count, 3}}}));

  std::set<std::string> known, used;
  for (const auto& [name, extents] : inputs) known.insert(name);
  for (const std::string& text : model.graph.AllBytes(5)) {
    const Message tensor(text);
    const bool whole_numbers = tensor.Number(2) == 7;
    EXPECT_TRUE(whole_numbers || tensor.Number(2) == 1);
    const size_t size = tensor.Bytes(9).size() / (whole_numbers ? 8 : 4);
    EXPECT_EQ(static_cast<int64_t>(size), ElementCount(tensor.AllNumbers(1))) << tensor.Bytes(8);
    EXPECT_TRUE(known.insert(tensor.Bytes(8)).second) << tensor.Bytes(8);
  }
  for (const std::string& text : model.graph.AllBytes(1)) {
    const Message node(text);
    for (const std::string& input : node.AllBytes(1)) {
      EXPECT_EQ(known.count(input), 1) << node.Bytes(3) << " needs " << input;
      used.insert(input);
    }
    EXPECT_TRUE(known.insert(node.Bytes(2)).second) << node.Bytes(2);
  }
  EXPECT_TRUE(known.count("texture") == 1 && known.count("vertices") == 1);
  used.insert({"texture", "vertices"});
  EXPECT_EQ(used, known);
}

INSTANTIATE_TEST_SUITE_P(Architectures, OnnxStructure, testing::ValuesIn(Choices()));

TEST_F(OnnxTest, TensorsHaveTheFilesNames) {
  const Avatar avatar = RandomAvatar(Choose("", [](Architecture&) {}).architecture, 2);
  const Model model(OnnxBytes(Save("a", avatar)));
  for (const std::string& text : model.graph.AllBytes(5)) {
    const Message tensor(text);
    if (tensor.Bytes(8) != "decoder.texture_conv.0.weight") continue;
    const Tensor& weight = avatar.weights.at(tensor.Bytes(8));
    EXPECT_EQ(tensor.AllNumbers(1), weight.shape);
    EXPECT_EQ(std::memcmp(tensor.Bytes(9).data(), weight.values.data(), 4 * weight.values.size()), 0);
    return;
  }
  ADD_FAILURE() << "no such tensor";
}

TEST_F(OnnxTest, MetadataTellWhoAndWhereToBegin) {
  const Architecture a = Choose("", [](Architecture& people) {
                           people.identities = 2;
                           people.identity = IdentityConditioning::kOneHot;
                         }).architecture;
  const Avatar avatar = RandomAvatar(a, 3);
  const std::string file = Save("a", avatar);
  const auto metadata = [](const std::string& bytes) {
    std::map<std::string, std::string> all;
    for (const std::string& text : Model(bytes).file.AllBytes(14)) all[Message(text).Bytes(1)] = Message(text).Bytes(2);
    return all;
  };
  std::map<std::string, std::string> found = metadata(OnnxBytes(file));
  EXPECT_EQ(found["avatar"], AvatarId(avatar));
  EXPECT_EQ(found["people"], R"(["person_0","person_1"])");
  EXPECT_EQ(std::count(found["mean_code"].begin(), found["mean_code"].end(), ','), a.latent - 1);
  EXPECT_NEAR(std::stof(found["mean_code"]), Decoder::Open(file)->mean_code()[0], 1e-6);
  // One of them alone is nobody's choice.
  OnnxOptions options;
  options.person = 1;
  EXPECT_EQ(metadata(OnnxBytes(file, options)).count("people"), 0);
  EXPECT_EQ(Model(OnnxBytes(file, options)).Values(11).count("person"), 0);
}

TEST_F(OnnxTest, WhatDoesNotFitIsRefused) {
  const std::string file = Save("a", RandomAvatar(Choose("", [](Architecture&) {}).architecture, 4));
  OnnxOptions options;
  options.most_bytes = 2 << 20;
  EXPECT_THAT(ErrorOf([&] { OnnxBytes(file, options); }),
              HasSubstr("a.safetensors: its decoder needs more than the 2 MB"));
  options = {};
  options.person = 1;
  EXPECT_THAT(ErrorOf([&] { OnnxBytes(file, options); }), HasSubstr("there is no person 1"));
}

// A model of an avatar beside the answers of the run-time decoder, for a batch of frames: of other codes, views,
// conditions and, where the model has all of them, people.
class Trial {
 public:
  Trial(fs::path start, const std::string& avatar_file, const Avatar& avatar, std::optional<int> person)
      : start_(std::move(start)), a_(avatar.architecture) {
    WriteFile(start_.string() + ".onnx", OnnxBytes(avatar_file, {person}));
    std::vector<float> codes, views, people, conditions;
    for (int i = 0; i < kFrames; ++i) {
      const FrameCode& frame = avatar.codes[i];
      codes.insert(codes.end(), frame.mu.begin(), frame.mu.end());
      views.insert(views.end(), kViews[i], kViews[i] + 3);
      conditions.insert(conditions.end(), frame.conditions.begin(), frame.conditions.end());
      const int shown = person.value_or((kFrames - 1 - i) % a_.identities);
      people.push_back(static_cast<float>(shown));
      Decode(avatar_file, frame, kViews[i], shown);
    }
    WriteInput("code", {kFrames, a_.latent}, codes);
    WriteInput("view", {kFrames, 3}, views);
    WriteInput("person", {kFrames}, people);
    WriteConditions(conditions);
  }

  void Compare() const {
    const NpyArray texture = Output("texture"), vertices = Output("vertices");
    const size_t size = a_.texture_size, area = size * size;
    ASSERT_THAT(texture.shape, ElementsAre(kFrames, 3, size, size));
    ASSERT_THAT(vertices.shape, ElementsAre(kFrames, a_.vertex_count, 3));
    double colour = 0, distance = 0;
    for (size_t i = 0; i < texture.values.size(); ++i) {
      const size_t frame = i / (3 * area), channel = i / area % 3, texel = i % area;
      const double difference = std::abs(texture.values[i] - pixels_[frame][4 * texel + channel]);
      colour = std::max(colour, difference - 0.5);  // rounded there, not here
    }
    for (size_t i = 0; i < vertices.values.size(); ++i) {
      distance = std::max(distance, std::abs(vertices.values[i] - vertices_[i]));
    }
    EXPECT_LT(colour, 0.01);
    EXPECT_LT(distance, 0.001);
  }

 private:
  void Decode(const std::string& avatar_file, const FrameCode& frame, const float* view, int person) {
    DecoderOptions options;
    options.kernel = "portable";
    options.person = person;
    options.conditions = frame.conditions;
    std::vector<uint8_t>& pixels = pixels_.emplace_back(static_cast<size_t>(4) * a_.texture_size * a_.texture_size);
    const Decoder::View looking{{view[0], view[1], view[2]}, pixels.data(), int64_t{4} * a_.texture_size};
    std::vector<float> mesh(static_cast<size_t>(3) * a_.vertex_count);
    Decoder::Open(avatar_file, options)->Decode(frame.mu, {&looking, 1}, {mesh.data()});
    vertices_.insert(vertices_.end(), mesh.begin(), mesh.end());
  }

  fs::path Beside(const std::string& name) const { return start_.string() + "." + name + ".npy"; }
  void WriteInput(const std::string& name, const Extents& shape, const std::vector<float>& values) const {
    WriteFile(Beside(name), EncodeNpy(shape, values));
  }
  NpyArray Output(const std::string& name) const { return ParseNpy(Beside(name), ReadFile(Beside(name))); }

  // Each named one by itself, of all frames.
  void WriteConditions(const std::vector<float>& all) const {
    const int named = NamedChannels(a_);
    int begin = 0;
    for (const NamedCondition& condition : a_.conditions) {
      std::vector<float> values;
      for (int i = 0; i < kFrames; ++i) {
        const auto from = all.begin() + i * named + begin;
        values.insert(values.end(), from, from + condition.size);
      }
      WriteInput("condition." + condition.name, {kFrames, condition.size}, values);
      begin += condition.size;
    }
  }

  const fs::path start_;
  const Architecture a_;
  std::vector<std::vector<uint8_t>> pixels_;
  std::vector<float> vertices_;
};

TEST_F(OnnxTest, OnnxRuntimeComputesWhatTheDecoderDoes) {
  const fs::path source = LIKENESS_SOURCE_DIR, home = source / ".deps/onnxruntime";
  if (!fs::exists(home / "complete")) GTEST_SKIP() << home << " is absent; scripts/setup --with-onnxruntime makes it";
  std::vector<Choice> choices = Choices();
  choices.push_back(Choose("linear with two conditions", [](Architecture& a) {
    a.model = ModelKind::kLinear;
    a.identities = 2;
    a.identity = IdentityConditioning::kLearned;
    a.identity_size = 3;
    a.conditions = {{"gaze", 6}, {"light", 2}};
  }));
  std::map<std::string, Trial> trials;
  for (size_t i = 0; i < choices.size(); ++i) {
    const Avatar avatar = RandomAvatar(choices[i].architecture, 5 + i);
    const std::string file = Save(std::to_string(i), avatar);
    trials.try_emplace(choices[i].name, folder_ / std::to_string(i), file, avatar, std::nullopt);
    if (avatar.architecture.identities == 1) continue;
    trials.try_emplace(choices[i].name + ", one", folder_ / (std::to_string(i) + "_one"), file, avatar, 1);
  }
  const std::string command = fmt::format("'{}' '{}' '{}' 2>'{}'", (home / "bin/python").string(),
                                          (source / "src/likeness/decode/export/run_onnx.py").string(),
                                          folder_.path().string(), (folder_ / "log").string());
  ASSERT_EQ(std::system(command.c_str()), 0) << ReadFile(folder_ / "log");
  for (const auto& [name, trial] : trials) {
    SCOPED_TRACE(name);
    trial.Compare();
  }
}

}  // namespace
}  // namespace likeness
