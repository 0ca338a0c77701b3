// Tests' tensors are tiny: LibTorch's threads would wait for each other longer than they work.

#include <ATen/Parallel.h>
#include <gtest/gtest.h>

#include "likeness/base/parallel.h"

namespace likeness {
namespace {

class OneThread : public testing::Environment {
 public:
  void SetUp() override {
    SetThreadCount(1);
    at::set_num_threads(1);
  }
};

const testing::Environment* const kOneThread = testing::AddGlobalTestEnvironment(new OneThread);

}  // namespace
}  // namespace likeness
