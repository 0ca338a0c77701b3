#include "likeness/app/command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/file.h"
#include "likeness/base/parallel.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A verb with one option of each kind.
struct Example {
  std::filesystem::path capture;
  int size = 512;
  double rate = 3e-4;
  bool masks = true;
  std::string head = "human:1";
  std::string shading = "full";
  std::vector<std::string> cameras;
  float image_loss = 0;
  Command command{"example", "An example.", "likeness example x"};

  Example() {
    command.Positional("CAPTURE", &capture, "a capture");
    command.Option("size", &size, "texels");
    command.Option("rate", &rate, "learning rate");
    command.Option("masks", &masks, "use masks");
    command.Option("head", &head, "which head");
    command.Choice("shading", &shading, {"full", "albedo"}, "how");
    command.Option("cameras", &cameras, "which cameras");
    command.Option("loss.image", &image_loss, "weight");
  }

  bool Parse(std::vector<const char*> words) {
    words.insert(words.begin(), "example");
    return command.Parse(static_cast<int>(words.size()), words.data());
  }

  std::string UsageErrorOf(std::vector<const char*> words) {
    try {
      Parse(std::move(words));
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  }
};

TEST(CommandTest, FillsTheStruct) {
  Example e;
  ASSERT_TRUE(e.Parse({"in", "--size", "64", "--rate=0.5", "--no-masks", "--cameras", "a", "b", "--loss.image", "2"}));
  EXPECT_EQ(e.capture, "in");
  EXPECT_EQ(e.size, 64);
  EXPECT_EQ(e.rate, 0.5);
  EXPECT_FALSE(e.masks);
  EXPECT_THAT(e.cameras, ElementsAre("a", "b"));
  EXPECT_EQ(e.image_loss, 2);
}

TEST(CommandTest, MistakesNameTheNearestOption) {
  EXPECT_THAT(Example().UsageErrorOf({"in", "--sise", "3"}), HasSubstr("'--sise', did you mean '--size'?"));
  EXPECT_THAT(Example().UsageErrorOf({"in", "--size", "big"}), HasSubstr("--size"));
  EXPECT_THAT(Example().UsageErrorOf({"in", "--shading", "phong"}), HasSubstr("phong"));
  EXPECT_THAT(Example().UsageErrorOf({}), HasSubstr("CAPTURE is missing"));
  EXPECT_THAT(Example().UsageErrorOf({"in", "more"}), HasSubstr("unknown argument 'more'"));
}

TEST(CommandTest, AConfigurationFillsTheSameStructAndFlagsWin) {
  const ScratchFolder scratch;
  WriteFile(scratch / "c.toml", "size = 128\nrate = 1\nmasks = false\ncameras = ['x', 'y z']\n[loss]\nimage = 0.5\n");
  const std::string config = (scratch / "c.toml").string();
  Example e;
  ASSERT_TRUE(e.Parse({"in", "--config", config.c_str(), "--size", "256"}));
  EXPECT_EQ(e.size, 256);
  EXPECT_EQ(e.rate, 1);
  EXPECT_FALSE(e.masks);
  EXPECT_THAT(e.cameras, ElementsAre("x", "y z"));
  EXPECT_EQ(e.image_loss, 0.5f);
}

TEST(CommandTest, TheResolvedConfigurationReadsBack) {
  const ScratchFolder scratch;
  Example e;
  ASSERT_TRUE(e.Parse({"in", "--rate", "0.25", "--head", "a \"b\" \\c", "--cameras", "p", "--loss.image", "3"}));
  WriteFile(scratch / "r.toml", e.command.ResolvedToml());
  const std::string config = (scratch / "r.toml").string();
  Example again;
  ASSERT_TRUE(again.Parse({"in", "--config", config.c_str()}));
  EXPECT_EQ(again.command.ResolvedToml(), e.command.ResolvedToml());
  EXPECT_EQ(again.head, "a \"b\" \\c");
}

TEST(CommandTest, BadConfigurationsAreErrors) {
  const ScratchFolder scratch;
  const auto error = [&](const std::string& text) {
    WriteFile(scratch / "b.toml", text);
    const std::string config = (scratch / "b.toml").string();
    return Example().UsageErrorOf({"in", "--config", config.c_str()});
  };
  EXPECT_THAT(error("sizes = 3\n"), HasSubstr("b.toml:1: unknown key 'sizes', did you mean 'size'?"));
  EXPECT_THAT(error("\nsize = \n"), HasSubstr("not valid TOML"));
  EXPECT_THAT(error("size = 1979-05-27\n"), HasSubstr("no option takes"));
  EXPECT_THAT(error("size = 'x'\n"), HasSubstr("--size"));
}

TEST(CommandTest, HelpIsWrittenAndNothingElseIsRequired) {
  ::testing::internal::CaptureStdout();
  EXPECT_FALSE(Example().Parse({"--help"}));
  const std::string help = ::testing::internal::GetCapturedStdout();
  EXPECT_THAT(help, HasSubstr("--size N"));
  EXPECT_THAT(help, HasSubstr("example: likeness example x"));
}

}  // namespace
}  // namespace likeness
