// likeness import KIND ...: a table of what can be read.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "likeness/app/command.h"
#include "likeness/app/import_multiface.h"
#include "likeness/app/verbs.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

struct ImportEntry {
  const char* kind;
  Verb run;
  const char* summary;
};

const std::vector<ImportEntry> kImports = {
    {"multiface", RunImportMultiface, "a published Multiface checkpoint to an avatar file"},
};

void PrintHelp() {
  fmt::print("Reads what other programs have made.\n\n");
  fmt::print("usage: likeness import KIND ...        likeness import KIND --help shows its options\n\n");
  for (const ImportEntry& entry : kImports) fmt::print("  {:<12} {}\n", entry.kind, entry.summary);
  fmt::print("\nexample: likeness import multiface best_model.pth avatars/published --capture captures/published\n");
}

}  // namespace

int RunImport(int argc, const char* const* argv) {
  const std::string kind = argc > 1 ? argv[1] : "";
  if (kind.empty() || kind == "--help" || kind == "-h") {
    PrintHelp();
    return kind.empty() ? 2 : 0;
  }
  std::vector<std::string> kinds;
  for (const ImportEntry& entry : kImports) {
    if (kind == entry.kind) return entry.run(argc - 1, argv + 1);
    kinds.emplace_back(entry.kind);
  }
  const std::string nearest = NearestWord(kind, kinds);
  throw UsageError(fmt::format("there is no import '{}'{}; likeness import --help lists them", kind,
                               nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest)));
}

}  // namespace likeness
