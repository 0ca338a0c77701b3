// What `likeness bench NAME` measures, one file each. Like verbs.

#pragma once

namespace likeness {

int RunBenchDecode(int argc, const char* const* argv);
int RunBenchFrame(int argc, const char* const* argv);
int RunBenchRenderLoss(int argc, const char* const* argv);  // with LibTorch
int RunBenchSimulate(int argc, const char* const* argv);
int RunBenchTrain(int argc, const char* const* argv);  // with LibTorch
int RunBenchUnwrap(int argc, const char* const* argv);

}  // namespace likeness
