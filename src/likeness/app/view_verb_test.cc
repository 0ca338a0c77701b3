#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

void View(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "view");
  RunView(static_cast<int>(arguments.size()), arguments.data());
}

std::string UsageErrorOf(const std::vector<const char*>& arguments) {
  try {
    View(arguments);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(ViewVerb, WithoutADisplaySaysWhatToDo) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  const std::string error = ErrorOf([] { View({"--screenshot", "unwritten.png"}); });
  EXPECT_THAT(error, HasSubstr("DISPLAY"));
  EXPECT_THAT(error, HasSubstr("xvfb-run"));
  EXPECT_THAT(error, HasSubstr("likeness render"));
}

TEST(ViewVerb, NamesWrongOptions) {
  EXPECT_THAT(UsageErrorOf({"--size", "1280"}), HasSubstr("--size"));
  EXPECT_THAT(UsageErrorOf({"--sliders", "1,,2"}), HasSubstr("--sliders"));
  EXPECT_THAT(UsageErrorOf({"--show", "textures"}), HasSubstr("--show"));
  EXPECT_THAT(UsageErrorOf({"--vr"}), HasSubstr("needs an avatar"));
  EXPECT_THAT(UsageErrorOf({"a", "--vr", "--distance", "0.1"}), HasSubstr("0.3 to 10 metres"));
  EXPECT_THAT(UsageErrorOf({"--stero"}), HasSubstr("did you mean '--stereo'?"));
  EXPECT_THAT(ErrorOf([] { View({"--view", "left"}); }), HasSubstr("AZIMUTH,ELEVATION"));
  EXPECT_THAT(ErrorOf([] { View({"--size", "3x4"}); }), HasSubstr("3 x 4"));
}

}  // namespace
}  // namespace likeness
