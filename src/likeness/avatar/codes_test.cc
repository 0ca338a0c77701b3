#include "likeness/avatar/codes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Avatar MakeAvatar() {
  Avatar avatar;
  avatar.architecture.latent = 3;
  avatar.codes = {{"smile", "000001", {1, 2, 3}}, {"talk", "000007", {3, 2, -1}}};
  return avatar;
}

TEST(CodesTest, AreFoundByNumberAndName) {
  const Avatar avatar = MakeAvatar();
  EXPECT_THAT(FindCode(avatar, "mean").mu, ElementsAre(2, 2, 1));
  EXPECT_EQ(FindCode(avatar, "mean").frame, nullptr);
  EXPECT_THAT(FindCode(avatar, "1").mu, ElementsAre(3, 2, -1));
  EXPECT_EQ(FindCode(avatar, "smile/000001").frame, &avatar.codes[0]);
  EXPECT_THAT(ErrorOf([&] { FindCode(avatar, "2"); }), HasSubstr("2 frames"));
  EXPECT_THAT(ErrorOf([&] { FindCode(avatar, "smile/000002"); }), HasSubstr("did you mean 'smile/000001'"));
  EXPECT_THAT(ErrorOf([&] { FindCode(avatar, "-1"); }), HasSubstr("expected mean"));
  EXPECT_THAT(ErrorOf([&] { FindCode(avatar, ""); }), HasSubstr("expected mean"));
  Avatar without_codes = avatar;
  without_codes.codes.clear();
  EXPECT_THAT(MeanCode(without_codes), ElementsAre(0, 0, 0));
}

TEST(CodesTest, OfSeveralPeople) {
  Avatar avatar = MakeAvatar();
  avatar.architecture.identities = 2;
  avatar.identities = {{"anna", {}, {}}, {"ben", {}, {}}};
  avatar.codes.push_back({"smile", "000001", {7, 8, 9}, 1});
  EXPECT_EQ(FindCode(avatar, "smile/000001").frame, &avatar.codes[0]);
  EXPECT_EQ(FindCode(avatar, "smile/000001", 1).frame, &avatar.codes[2]);
  EXPECT_EQ(FindCode(avatar, "talk/000007", 1).frame, &avatar.codes[1]);
  EXPECT_EQ(FindCode(avatar, "ben/smile/000001").frame, &avatar.codes[2]);
  EXPECT_THAT(FindCode(avatar, "mean", 1).mu, ElementsAre(7, 8, 9));
  EXPECT_THAT(FindCode(avatar, "mean", 0).mu, ElementsAre(2, 2, 1));
  EXPECT_THAT(ErrorOf([&] { FindCode(avatar, "bem/smile/000001"); }), HasSubstr("did you mean 'ben/smile/000001'"));
}

TEST(CodesTest, AreReadFromText) {
  const ScratchFolder scratch;
  const auto read = [&](const std::string& text) {
    WriteFile(scratch / "code.txt", text);
    return ReadCode(scratch / "code.txt", 3);
  };
  EXPECT_THAT(read("1, 2.5 -3e-1\n"), ElementsAre(1, 2.5, -0.3f));
  EXPECT_THAT(read("1\n2\n3"), ElementsAre(1, 2, 3));
  for (const char* wrong : {"", "1 2", "1 2 3 4", "1 2 nan", "1 2 x", "1 2 1e999", "1 2 1e73"}) {
    EXPECT_THAT(ErrorOf([&] { read(wrong); }), HasSubstr("code.txt")) << wrong;
  }
}

TEST(CodesTest, SequencesAreReadFromText) {
  EXPECT_THAT(ParseCodeSequence("codes.txt", "1 2 3\n4,5\n6", 3),
              ElementsAre(ElementsAre(1, 2, 3), ElementsAre(4, 5, 6)));
  for (const char* wrong : {"", "1 2 3 4 5", "1 2 3 x 5 6"}) {
    EXPECT_THAT(ErrorOf([&] { ParseCodeSequence("codes.txt", wrong, 3); }), HasSubstr("codes.txt")) << wrong;
  }
}

}  // namespace
}  // namespace likeness
