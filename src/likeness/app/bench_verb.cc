// likeness bench NAME: a table of the benchmarks.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "likeness/app/benches.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

struct BenchEntry {
  const char* name;
  Verb run;
  const char* summary;
};

const std::vector<BenchEntry> kBenches = {
    {"decode", RunBenchDecode, "codes to textures and meshes at run time, with each kernel"},
    {"frame", RunBenchFrame, "whole stereo frames: decoded and drawn"},
#ifdef LIKENESS_TRAIN
    {"render-loss", RunBenchRenderLoss, "the image loss of 16 crops, forward and backward"},
#endif
    {"simulate", RunBenchSimulate, "a frame of 40 cameras, on one thread"},
#ifdef LIKENESS_TRAIN
    {"train", RunBenchTrain, "training steps"},
#endif
    {"unwrap", RunBenchUnwrap, "one camera image to one texture, on one thread"},
};

void PrintHelp() {
  fmt::print("Measures the speed of one part; medians of several runs.\n\n");
  fmt::print("usage: likeness bench NAME ...        likeness bench NAME --help shows its options\n\n");
  for (const BenchEntry& bench : kBenches) fmt::print("  {:<12} {}\n", bench.name, bench.summary);
  fmt::print("\nexample: likeness bench unwrap --json\n");
}

}  // namespace

int RunBench(int argc, const char* const* argv) {
  const std::string name = argc > 1 ? argv[1] : "";
  if (name.empty() || name == "--help" || name == "-h") {
    PrintHelp();
    return name.empty() ? 2 : 0;
  }
  std::vector<std::string> names;
  for (const BenchEntry& bench : kBenches) {
    if (name == bench.name) return bench.run(argc - 1, argv + 1);
    names.emplace_back(bench.name);
  }
  const std::string nearest = NearestWord(name, names);
  throw UsageError(fmt::format("there is no benchmark '{}'{}; likeness bench --help lists them", name,
                               nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest)));
}

}  // namespace likeness
