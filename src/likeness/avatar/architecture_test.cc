#include "likeness/avatar/architecture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Architecture Paper(int size) {
  Architecture a;
  a.texture_size = size;
  a.vertex_count = 7306;
  return a;
}

TEST(Architecture, ChannelsAreThePapersAndSmallerTexturesDropInnerLayers) {
  EXPECT_THAT(EncoderChannels(Paper(1024)), ElementsAre(16, 32, 32, 64, 64, 128, 128, 256));
  EXPECT_THAT(EncoderChannels(Paper(512)), ElementsAre(16, 32, 32, 64, 64, 128, 128));
  EXPECT_THAT(EncoderChannels(Paper(64)), ElementsAre(16, 32, 32, 64));
  EXPECT_THAT(EncoderChannels(Paper(2048)), ElementsAre(16, 32, 32, 64, 64, 128, 128, 256, 256));
}

TEST(Architecture, JsonRoundTrip) {
  Architecture a = Paper(256);
  a.preset = "demo \"quoted\"";
  a.latent = 77;
  a.conditioning = Conditioning::kFc32;
  a.normalisation = Normalisation::kNone;
  a.untied_bias = UntiedBias::kDecoderAndChannel;
  a.layout = Layout::kMultiface;
  a.upsampling = Upsampling::kNearest;
  a.residual = true;
  a.identities = 3;
  a.identity = IdentityConditioning::kLearned;
  a.identity_size = 5;
  a.conditions = {{"gaze", 6}, {"light", 1}};
  EXPECT_EQ(ArchitectureFromJson(ArchitectureToJson(a)), a);
}

TEST(Architecture, FilesOfVersionOneNameNoLayout) {
  const std::string old =
      R"({"preset":"demo","model":"deep","texture_size":256,"vertex_count":7306,"latent":128,"conditioning":"fc8",)"
      R"("normalisation":"weight","untied_bias":"everywhere","geometry":"tracked","identities":1})";
  Architecture a = Paper(256);
  a.preset = "demo";
  EXPECT_EQ(ArchitectureFromJson(old), a);
}

TEST(Architecture, EveryNameParsesBack) {
  for (const std::string& name : ModelKindNames()) EXPECT_EQ(ToString(ParseModelKind(name)), name);
  for (const std::string& name : ConditioningNames()) EXPECT_EQ(ToString(ParseConditioning(name)), name);
  for (const std::string& name : NormalisationNames()) EXPECT_EQ(ToString(ParseNormalisation(name)), name);
  for (const std::string& name : UntiedBiasNames()) EXPECT_EQ(ToString(ParseUntiedBias(name)), name);
  for (const std::string& name : LayoutNames()) EXPECT_EQ(ToString(ParseLayout(name)), name);
  for (const std::string& name : UpsamplingNames()) EXPECT_EQ(ToString(ParseUpsampling(name)), name);
  for (const std::string& name : IdentityConditioningNames()) {
    EXPECT_EQ(ToString(ParseIdentityConditioning(name)), name);
  }
  for (const std::string& name : GeometryNames()) EXPECT_EQ(ToString(ParseGeometry(name)), name);
  EXPECT_EQ(ToString(Conditioning::kFc8All), "fc8-all");
  EXPECT_EQ(ToString(Geometry::kBillboard), "billboard");
  EXPECT_THAT(ErrorOf([] { ParseModelKind("deeep"); }), HasSubstr("deep, linear, bilinear"));
}

TEST(Architecture, CheckNamesWhatIsWrongAndWhatIsNotAvailable) {
  const auto error = [](auto change) {
    Architecture a = Paper(256);
    change(a);
    return ErrorOf([&] { a.Check(); });
  };
  EXPECT_EQ(error([](Architecture&) {}), "");
  EXPECT_THAT(error([](Architecture& a) { a.texture_size = 300; }), HasSubstr("power of two"));
  EXPECT_THAT(error([](Architecture& a) { a.texture_size = 8192; }), HasSubstr("texture size is 8192"));
  EXPECT_THAT(error([](Architecture& a) { a.vertex_count = 0; }), HasSubstr("vertex count"));
  EXPECT_THAT(error([](Architecture& a) { a.latent = -1; }), HasSubstr("latent"));
  EXPECT_EQ(error([](Architecture& a) { a.layout = Layout::kMultiface; }), "");
  EXPECT_THAT(error([](Architecture& a) {
                a.layout = Layout::kMultiface;
                a.texture_size = 128;
              }),
              HasSubstr("at least 256"));
  EXPECT_EQ(error([](Architecture& a) { a.geometry = Geometry::kEllipsoid; }), "");
  EXPECT_EQ(error([](Architecture& a) { a.identities = 8; }), "");
  EXPECT_THAT(error([](Architecture& a) { a.identities = 0; }), HasSubstr("identities is 0"));
  EXPECT_THAT(error([](Architecture& a) { a.identity = IdentityConditioning::kOneHot; }), HasSubstr("there is one"));
  const auto two = [&](auto change) {
    return error([&](Architecture& a) {
      a.identities = 2;
      change(a);
    });
  };
  EXPECT_EQ(two([](Architecture& a) { a.identity = IdentityConditioning::kOneHot; }), "");
  EXPECT_THAT(two([](Architecture& a) { a.identity = IdentityConditioning::kLearned; }), HasSubstr("identity size"));
  EXPECT_THAT(two([](Architecture& a) { a.identity_size = 4; }), HasSubstr("identity size"));
  EXPECT_EQ(error([](Architecture& a) { a.conditions = {{"gaze", 6}}; }), "");
  EXPECT_THAT(error([](Architecture& a) { a.conditions = {{"../gaze", 6}}; }), HasSubstr("letters, digits"));
  EXPECT_THAT(error([](Architecture& a) { a.conditions = {{"gaze", 6}, {"gaze", 2}}; }), HasSubstr("named twice"));
  EXPECT_THAT(error([](Architecture& a) { a.conditions = {{"gaze", 0}}; }), HasSubstr("size of gaze"));
}

TEST(Architecture, BadJsonIsAnError) {
  const std::string good = ArchitectureToJson(Paper(256));
  const auto error = [](const std::string& text) { return ErrorOf([&] { ArchitectureFromJson(text); }); };
  EXPECT_EQ(error(good), "");
  for (const std::string& text : {std::string(), std::string("{}"), std::string("[]"), std::string("null"),
                                  good.substr(0, good.size() / 2), std::string("\xff\xfe")}) {
    EXPECT_NE(error(text), "") << text;
  }
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_THAT(error(with("256", "-256")), HasSubstr("texture_size"));
  EXPECT_THAT(error(with("256", "256.5")), HasSubstr("texture_size"));
  EXPECT_THAT(error(with("256", "1e300")), HasSubstr("texture_size"));
  EXPECT_THAT(error(with("256", "\"256\"")), HasSubstr("texture_size"));
  EXPECT_THAT(error(with("\"deep\"", "\"shallow\"")), HasSubstr("model is 'shallow'"));
  EXPECT_THAT(error(with("\"deep\"", "7")), HasSubstr("not understood"));
  for (const char* conditions : {"7", "[7]", "[[]]", "[[\"gaze\"]]", "[[7, 7]]", "{\"a\": 1}"}) {
    EXPECT_NE(error(with("[]", conditions)), "") << conditions;
  }
  EXPECT_THAT(error(with("[]", "[[\"gaze\", 1e300]]")), HasSubstr("whole number"));
}

}  // namespace
}  // namespace likeness
