// Split files, met by a capture that has every camera they name.

#include <set>

#include "fuzz.h"
#include "likeness/capture/split_file.h"

namespace likeness {
namespace {

Split ParseAndResolve(std::string_view text) {
  const SplitNames names = ParseSplit(fuzz::kPath, text);
  std::set<std::string> known(names.train.begin(), names.train.end());
  known.insert(names.test.begin(), names.test.end());
  std::vector<Camera> cameras;
  for (const std::string& name : known) {
    cameras.emplace_back();
    cameras.back().name = name;
  }
  return ResolveSplit(fuzz::kPath, names, cameras);
}

}  // namespace

void fuzz::Run(std::string_view bytes) { CheckRoundTrip(bytes, ParseAndResolve, SplitText); }

}  // namespace likeness
