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
  std::filesystem::path out;
  int size = 512;
  uint64_t seed = 0;
  double rate = 3e-4;
  bool masks = true;
  std::string head = "human:1";
  std::string shading = "full";
  std::vector<std::string> cameras;
  float image_loss = 0;
  Command command{"example", "An example.", "likeness example x"};

  Example() {
    command.Positional("CAPTURE", &capture, "a capture", false);
    command.Option("out", &out, "folder");
    command.Option("seed", &seed, "seed");
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
  ASSERT_TRUE(e.Parse(
      {"in", "--size", "64", "--rate=0.5", "--no-masks", "--cameras", "a", "--cameras", "b", "--loss.image", "2"}));
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
  Example strict;
  strict.command.Positional("OUT", &strict.out, "where to");
  EXPECT_THAT(strict.UsageErrorOf({"in"}), HasSubstr("OUT is missing"));
  EXPECT_THAT(Example().UsageErrorOf({"in", "more"}), HasSubstr("unknown argument 'more'"));
  // A list takes one value for each time that it is named, so that it swallows no argument behind it.
  EXPECT_THAT(Example().UsageErrorOf({"--cameras", "a", "in", "more"}), HasSubstr("unknown argument 'more'"));
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

// Found by fuzz/config_fuzz.cc: values once went through the command line, where an empty one took the next option.
TEST(CommandTest, NoTextIsTakenForAnOption) {
  Example e;
  ASSERT_TRUE(
      e.command.ParseConfig("c.toml", "out = ''\nhead = '--rate=5'\ncameras = ['--size=3', '', '-']\nrate = 1"));
  EXPECT_EQ(e.out, "");
  EXPECT_EQ(e.head, "--rate=5");
  EXPECT_THAT(e.cameras, ElementsAre("--size=3", "", "-"));
  EXPECT_EQ(e.size, 512);
  EXPECT_EQ(e.rate, 1);
}

TEST(CommandTest, DefaultsAndOddValuesReadBack) {
  for (const char* config : {"", "head = \"a\\u0001\\t\\n\\u007f\\u00e9\"", "seed = '18446744073709551615'",
                             "rate = inf", "loss.image = 1e-45", "cameras = []", "cameras = 400069"}) {
    Example given, again;
    ASSERT_TRUE(given.command.ParseConfig("c.toml", config)) << config;
    ASSERT_TRUE(again.command.ParseConfig("c.toml", given.command.ResolvedToml())) << config;
    EXPECT_EQ(again.command.ResolvedToml(), given.command.ResolvedToml());
    EXPECT_EQ(again.head, given.head);
    EXPECT_EQ(again.seed, given.seed);
  }
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
  EXPECT_THAT(error("\nsize = 1979-05-27\n"), HasSubstr("b.toml:2: 'size' needs a whole number"));
  for (const char* text : {"size = 'x'", "size = 1.5", "size = 3000000000", "size = [1]", "seed = -1", "rate = '1'",
                           "loss.image = 1e300", "masks = 1", "head = ['a']", "cameras = [['a']]", "out = 3"}) {
    EXPECT_THAT(error(text), HasSubstr(" needs ")) << text;
  }
  EXPECT_THAT(error("head = true"), HasSubstr("'head' needs text"));
  EXPECT_THAT(error("masks = 'yes'"), HasSubstr("'masks' needs true or false"));
  EXPECT_THAT(error("shading = 'phong'"), HasSubstr("'shading' is 'phong', expected one of full, albedo"));
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
