#include "likeness/base/npy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string NpyError(const std::string& bytes) {
  return ErrorOf([&] { ParseNpy("m.npy", bytes); });
}

// A file with this header, as NumPy 1 writes it.
std::string Npy(const std::string& header, const std::string& values) {
  return std::string("\x93NUMPY\1\0", 8) + static_cast<char>(header.size()) + '\0' + header + values;
}

TEST(NpyTest, WhatIsWrittenIsReadBack) {
  const NpyArray read = ParseNpy("m.npy", EncodeNpy({2, 3}, {1, 2, 3, 4, 5, 0.1f}));
  EXPECT_THAT(read.shape, ElementsAre(2, 3));
  EXPECT_THAT(read.values, ElementsAre(1, 2, 3, 4, 5, double{0.1f}));
  EXPECT_THAT(ParseNpy("m.npy", EncodeNpy({2}, {7, 8})).shape, ElementsAre(2));
  EXPECT_EQ(EncodeNpy({2, 3}, {1, 2, 3, 4, 5, 6}).size() % 8, 0u);
}

TEST(NpyTest, ReadsOtherPeoplesFiles) {
  const std::string one_two("\x3f\x80\x00\x00\x40\x00\x00\x00", 8);
  EXPECT_THAT(ParseNpy("m", Npy("{'descr': '>f4', 'fortran_order': False, 'shape': (2,), }\n", one_two)).values,
              ElementsAre(1, 2));
  const NpyArray number =
      ParseNpy("m", Npy("{'descr': '>f4', 'fortran_order': False, 'shape': (), }", one_two.substr(4)));
  EXPECT_THAT(number.shape, IsEmpty());
  EXPECT_THAT(number.values, ElementsAre(2));
  std::string columns;
  for (const double value : {1.0, 4.0, 2.0, 5.0, 3.0, 6.0}) {
    columns.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  EXPECT_THAT(ParseNpy("m", Npy("{'shape': (2, 3), 'descr': '<f8', 'fortran_order': True}", columns)).values,
              ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(NpyTest, WrongFilesAreNamed) {
  const auto with = [](const std::string& type, const std::string& shape) {
    return Npy("{'descr': " + type + ", 'fortran_order': False, 'shape': " + shape + "}", std::string(8, '\0'));
  };
  EXPECT_EQ(NpyError(with("'<f4'", "(2,)")), "");
  EXPECT_THAT(NpyError(""), HasSubstr("m.npy: is no .npy file"));
  EXPECT_THAT(NpyError(with("'<i8'", "(1,)")), HasSubstr("'<i8'; expected '<f4'"));
  EXPECT_THAT(NpyError(with("'|O'", "(1,)")), HasSubstr("expected '<f4'"));
  EXPECT_THAT(NpyError(with("'<f4'", "(3,)")), HasSubstr("its shape (3) does not fit"));
  EXPECT_THAT(NpyError(with("'<f4'", "(1,)")), HasSubstr("does not fit"));
  EXPECT_THAT(NpyError(with("'<f4'", "(9223372036854775807, 9223372036854775807)")), HasSubstr("does not fit"));
  EXPECT_THAT(NpyError(with("'<f4'", "(2, -1)")), HasSubstr("not understood"));
  EXPECT_THAT(NpyError(with("'<f4'", "2")), HasSubstr("no shape"));
  EXPECT_THAT(NpyError(Npy("{'descr':", "")), HasSubstr("expected '<f4'"));
  EXPECT_THAT(NpyError(Npy("{}", "")), HasSubstr("does not say 'descr'"));
  EXPECT_THAT(NpyError(std::string("\x93NUMPY\2\0\xff\xff\xff\xff", 12)), HasSubstr("ends inside its header"));
}

TEST(NpyTest, DamagedFilesAreErrorsOrArrays) {
  const std::string good = EncodeNpy({2, 3}, {1, 2, 3, 4, 5, 6});
  for (size_t length = 0; length < good.size(); ++length) EXPECT_NE(NpyError(good.substr(0, length)), "");
  Random random(3);
  for (int round = 0; round < 3000; ++round) {
    std::string bytes = good;
    bytes[static_cast<size_t>(random.Below(static_cast<int64_t>(bytes.size())))] = static_cast<char>(random.Below(256));
    NpyError(bytes);
  }
}

}  // namespace
}  // namespace likeness
