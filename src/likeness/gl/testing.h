// What tests of OpenGL share: a context for each test, or a test that is skipped where there is none.

#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "likeness/base/error.h"
#include "likeness/gl/offscreen.h"

namespace likeness {

//   Base  testing::Test, or testing::TestWithParam<...>
// A test also fails that leaves an error behind in OpenGL.
template <typename Base, int kMajor = 3, int kMinor = 3>
class WithContext : public Base {
 protected:
  void SetUp() override {
    try {
      context_ = std::make_unique<OffscreenContext>(kMajor, kMinor);
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }
  void TearDown() override {
    if (context_ != nullptr) {
      EXPECT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR));
    }
  }
  const GlFunctions& gl() const { return context_->gl(); }

  std::unique_ptr<OffscreenContext> context_;
};

}  // namespace likeness
