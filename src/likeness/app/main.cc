// likeness VERB ...: a table of the verbs.

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

struct VerbEntry {
  const char* name;
  Verb run;
  const char* summary;
};

// In the order of the pipeline.
const std::vector<VerbEntry> kVerbs = {
    {"simulate", RunSimulate, "makes a multi-camera capture of a simulated head"},
    {"import", RunImport, "makes captures from other tools' files, avatars from published checkpoints"},
    {"convert", RunConvert, "copies a capture, or a part of it, into the layout that is written"},
    {"inspect", RunInspect, "says what a capture, a mesh or an avatar is, and draws a sheet of it"},
    {"validate", RunValidate, "finds what is wrong with a capture, and says what to do"},
    {"proxy", RunProxy, "makes a capture with coarser meshes: smoothed, an ellipsoid, a board"},
    {"unwrap", RunUnwrap, "turns camera images into textures, their averages and statistics"},
#ifdef LIKENESS_TRAIN
    {"train", RunTrain, "trains an avatar on unwrapped textures"},
    {"evaluate", RunEvaluate, "compares an avatar with what it has not seen"},
    {"encode", RunEncode, "turns frames of a capture into a performance: codes, head poses, times"},
    {"fit-arkit", RunFitArkit, "fits a map from ARKit coefficients to an avatar's codes"},
#endif
    {"render", RunRender, "draws an avatar: pictures and videos"},
    {"drive", RunDrive, "turns a Live Link Face recording into a performance"},
    {"export", RunExport, "writes an avatar's frame or performance as glTF, OBJ or PLY"},
#ifdef LIKENESS_VIEWER
    {"view", RunView, "shows an avatar in a window"},
#endif
    {"export-capture", RunExportCapture, "writes one frame of a capture for nerfstudio or COLMAP"},
    {"bench", RunBench, "measures the speed of one part"},
};

void PrintHelp() {
  fmt::print("likeness {}: from a multi-camera capture of a face to an avatar\n\n", LIKENESS_VERSION);
  fmt::print("usage: likeness VERB ...        likeness VERB --help shows a verb's options\n\n");
  for (const VerbEntry& verb : kVerbs) fmt::print("  {:<14} {}\n", verb.name, verb.summary);
  fmt::print("\nexample: likeness simulate captures/demo && likeness unwrap captures/demo\n");
}

int Run(int argc, const char* const* argv) {
  const std::string name = argc > 1 ? argv[1] : "";
  if (name == "--version") {
    fmt::print("likeness {}\n", LIKENESS_VERSION);
    return 0;
  }
  if (name.empty() || name == "--help" || name == "-h" || name == "help") {
    PrintHelp();
    return name.empty() ? 2 : 0;
  }
  std::vector<std::string> names;
  for (const VerbEntry& verb : kVerbs) {
    if (name == verb.name) return verb.run(argc - 1, argv + 1);
    names.emplace_back(verb.name);
  }
  const std::string nearest = NearestWord(name, names);
  throw UsageError(fmt::format("there is no verb '{}'{}; likeness --help lists them", name,
                               nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest)));
}

}  // namespace
}  // namespace likeness

int main(int argc, char** argv) {
  try {
    return likeness::Run(argc, argv);
  } catch (const likeness::UsageError& error) {
    fmt::print(stderr, "usage error: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return 1;
  }
}
