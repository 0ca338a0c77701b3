// Split files, met by a capture that has every camera they name.

#include "fuzz.h"
#include "likeness/capture/split_file.h"

namespace likeness {
namespace {

Split ParseAndResolve(std::string_view text) {
  const SplitNames names = ParseSplit(fuzz::kPath, text);
  std::vector<Camera> cameras;
  for (const auto* list : {&names.train, &names.test}) {
    for (const std::string& name : *list) {
      cameras.emplace_back();
      cameras.back().name = name;
    }
  }
  return ResolveSplit(fuzz::kPath, names, cameras);
}

}  // namespace

void fuzz::Run(std::string_view bytes) { CheckRoundTrip(bytes, ParseAndResolve, SplitText); }

}  // namespace likeness
