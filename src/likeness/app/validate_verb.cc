// likeness validate CAPTURE

#include <fmt/format.h>

#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/file.h"
#include "likeness/validate/validate.h"

namespace likeness {

int RunValidate(int argc, const char* const* argv) {
  std::filesystem::path root;
  ValidateOptions options;
  bool json = false;
  Command command("validate",
                  "Finds what is wrong with a capture, by evidence, and says what to do. Exits with 1 when something "
                  "must be fixed.",
                  "likeness validate captures/demo --overlay evidence");
  command.Positional("CAPTURE", &root, "folder of the capture");
  command.Option("all", &options.all, "look at every image and mesh, not at a sample");
  command.Option("overlay", &options.overlay, "folder to draw pictures of the evidence into");
  command.Option("json", &json, "write the findings as JSON");
  AddCaptureFlags(&command, &options.capture);
  if (!command.Parse(argc, argv)) return 0;

  const ValidationReport report = ValidateCapture(root, options);
  if (!options.overlay.empty()) WriteFile(options.overlay / "validate.toml", command.ResolvedToml());
  fmt::print("{}\n", json ? ToJson(report) : ToText(report));
  return report.MustFix() ? 1 : 0;
}

}  // namespace likeness
