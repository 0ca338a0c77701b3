// The verbs of the program, one file each. They return the exit status and throw Error or UsageError.

#pragma once

namespace likeness {

using Verb = int (*)(int argc, const char* const* argv);

int RunSimulate(int argc, const char* const* argv);
int RunImport(int argc, const char* const* argv);
int RunExportCapture(int argc, const char* const* argv);
int RunInspect(int argc, const char* const* argv);
int RunConvert(int argc, const char* const* argv);
int RunProxy(int argc, const char* const* argv);
int RunValidate(int argc, const char* const* argv);
int RunUnwrap(int argc, const char* const* argv);
int RunTrain(int argc, const char* const* argv);
int RunEvaluate(int argc, const char* const* argv);
int RunRender(int argc, const char* const* argv);
int RunEncode(int argc, const char* const* argv);
int RunFitArkit(int argc, const char* const* argv);
int RunDrive(int argc, const char* const* argv);
int RunExport(int argc, const char* const* argv);
int RunView(int argc, const char* const* argv);
int RunBench(int argc, const char* const* argv);

}  // namespace likeness
