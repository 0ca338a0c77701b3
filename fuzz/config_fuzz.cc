// --config FILE.toml, for a verb with an option of every kind. A wrong configuration is a UsageError here.

#include "fuzz.h"
#include "likeness/app/command.h"

namespace likeness {
namespace {

struct Example {
  bool masks = true;
  int size = 512;
  int64_t steps = 1000;
  uint64_t seed = 1;
  float image_loss = 0.5f;
  double rate = 3e-4;
  std::string head = "human:1";
  std::string shading = "full";
  std::filesystem::path out;
  std::vector<std::string> cameras;
  Command command{"example", "An example.", "likeness example"};

  Example() {
    command.Option("masks", &masks, "");
    command.Option("size", &size, "");
    command.Option("steps", &steps, "");
    command.Option("seed", &seed, "");
    command.Option("loss.image", &image_loss, "");
    command.Option("rate", &rate, "");
    command.Option("head", &head, "");
    command.Choice("shading", &shading, {"full", "albedo"}, "");
    command.Option("out", &out, "");
    command.Option("cameras", &cameras, "");
  }
};

}  // namespace

void fuzz::Run(std::string_view bytes) {
  Example given;
  try {
    LIKENESS_CHECK(given.command.ParseConfig(kPath, bytes));
  } catch (const UsageError&) {
    return;
  }
  const std::string resolved = given.command.ResolvedToml();
  Example again;
  again.command.ParseConfig(kPath, resolved);
  LIKENESS_CHECK(again.command.ResolvedToml() == resolved);
}

}  // namespace likeness
