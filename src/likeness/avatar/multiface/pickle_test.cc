#include "likeness/avatar/multiface/pickle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;
using namespace std::string_literals;  // bytes with zeros among them

std::string ErrorIn(const std::string& bytes) {
  return ErrorOf([&] { Pickle::Parse("a.pth", bytes); });
}

// {"n": -2, "big": 2^40, "x": 0.5, "t": (None, True, "é"), "l": [1, 300]}, as Python writes it (protocol 2).
TEST(Pickle, ReadsPlainValues) {
  const Pickle pickle = Pickle::Parse(
      "a.pth",
      "\x80\x02}q\x00(X\x01\x00\x00\x00nq\x01J\xfe\xff\xff\xffX\x03\x00\x00\x00"
      "bigq\x02\x8a\x06\x00\x00\x00\x00\x00\x01X\x01\x00\x00\x00xq\x03G?\xe0\x00\x00\x00\x00\x00\x00X\x01\x00\x00\x00"
      "tq\x04N\x88X\x02\x00\x00\x00\xc3\xa9q\x05\x87q\x06X\x01\x00\x00\x00lq\x07]q\x08(K\x01M,\x01"
      "eu."s);
  const Pickle::Node& root = pickle.root();
  ASSERT_EQ(root.kind, Pickle::Kind::kDict);
  ASSERT_EQ(root.pairs.size(), 5);
  const auto value = [&](size_t i) { return pickle.at(root.pairs[i].second); };
  EXPECT_EQ(pickle.at(root.pairs[1].first).text, "big");
  EXPECT_EQ(value(0).integer, -2);
  EXPECT_EQ(value(1).integer, int64_t{1} << 40);
  EXPECT_EQ(value(2).real, 0.5);
  ASSERT_EQ(value(3).kind, Pickle::Kind::kTuple);
  EXPECT_EQ(pickle.at(value(3).items[0]).kind, Pickle::Kind::kNone);
  EXPECT_EQ(pickle.at(value(3).items[1]).integer, 1);
  EXPECT_EQ(pickle.at(value(3).items[2]).text, "\xc3\xa9");
  ASSERT_EQ(value(4).items.size(), 2);
  EXPECT_EQ(pickle.at(value(4).items[1]).integer, 300);
}

// What would remove files in Python is a name and its arguments here.
TEST(Pickle, CallsNothing) {
  const Pickle pickle = Pickle::Parse("a.pth", "\x80\x02"s + "cos\nsystem\nX\x04\x00\x00\x00rm -\x85R."s);
  EXPECT_EQ(pickle.root().kind, Pickle::Kind::kCall);
  const auto arguments = pickle.ArgumentsOf(pickle.root(), "os system");
  ASSERT_TRUE(arguments);
  EXPECT_EQ(pickle.at(arguments->front()).text, "rm -");
  EXPECT_FALSE(pickle.ArgumentsOf(pickle.root(), "os remove"));
}

TEST(Pickle, RefusesWhatItDoesNotKnow) {
  EXPECT_THAT(ErrorIn("\x80\x02i__main__\nX\n."s), HasSubstr("a.pth: its pickle, byte 2: holds the opcode 0x69"));
  EXPECT_THAT(ErrorIn("\x80\x09."s), HasSubstr("protocol 9"));
  EXPECT_THAT(ErrorIn("\x80\x02N"s), HasSubstr("cut off"));
  EXPECT_THAT(ErrorIn(""), HasSubstr("cut off"));
  EXPECT_THAT(ErrorIn("X\xff\xff\xff\xff."s), HasSubstr("cut off"));
  EXPECT_THAT(ErrorIn("\x8d\xff\xff\xff\xff\xff\xff\xff\xff."s), HasSubstr("cut off"));
  EXPECT_THAT(ErrorIn("cos\nsystem"s), HasSubstr("cut off"));
  EXPECT_THAT(ErrorIn("."), HasSubstr("none is left"));
  EXPECT_THAT(ErrorIn("N(."), HasSubstr("none is left"));
  EXPECT_THAT(ErrorIn("N(0."), HasSubstr("none is left"));
  EXPECT_THAT(ErrorIn("t."), HasSubstr("a mark where there is none"));
  EXPECT_THAT(ErrorIn("h\x05."s), HasSubstr("recalls value 5"));
  EXPECT_THAT(ErrorIn("NNa."), HasSubstr("no list"));
  EXPECT_THAT(ErrorIn("NNNs."), HasSubstr("no dictionary"));
  EXPECT_THAT(ErrorIn("}(Nu."), HasSubstr("without a value"));
  EXPECT_THAT(ErrorIn("\x8a\x09" + std::string(9, 'x')), HasSubstr("more than 8 bytes"));
  EXPECT_THAT(ErrorIn("c" + std::string(300, 'x') + "\ny\n."), HasSubstr("256 letters"));
  EXPECT_THAT(ErrorIn(std::string(2 << 20, 'N') + "."), HasSubstr("more than 1048576 values"));
}

// Containers that hold themselves, tuples nested without end, and noise end in a value or an Error.
TEST(Pickle, SurvivesHostileBytes) {
  EXPECT_EQ(ErrorIn("]q\x00h\x00"s + "a."), "");
  EXPECT_EQ(ErrorIn("N" + std::string(500'000, '\x85') + "."), "");
  const std::string opcodes =
      "\x80\x95.(01N\x88\x89KMJ\x8aGX\x8c\x8d)\x85\x86\x87t]ae}suqr\x94hjc\x93RbQ\n\x00\x01\x02"s;
  Random random(3);
  for (int trial = 0; trial < 20'000; ++trial) {
    std::string bytes(random.Below(40), ' ');
    for (char& byte : bytes) byte = opcodes[random.Below(static_cast<int64_t>(opcodes.size()))];
    ErrorIn(bytes);
  }
}

}  // namespace
}  // namespace likeness
