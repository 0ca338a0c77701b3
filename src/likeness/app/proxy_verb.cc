// likeness proxy CAPTURE OUT

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/file.h"
#include "likeness/capture/proxy.h"

namespace likeness {

int RunProxy(int argc, const char* const* argv) {
  std::filesystem::path root;
  CaptureOptions capture_options;
  ProxyOptions options;
  bool json = false;
  Command command("proxy",
                  "Makes a capture with coarser meshes, to find out what good geometry is worth. Its images are links "
                  "to those of CAPTURE, which is not touched. Unwrap and train it like any other.",
                  "likeness proxy captures/demo captures/demo-ellipsoid --kind ellipsoid");
  command.Positional("CAPTURE", &root, "folder of the capture");
  command.Positional("OUT", &options.out, "folder to make");
  command.Choice("kind", &options.kind, ProxyKinds(),
                 "smoothed meshes, one ellipsoid around all of them, or a board that faces the front");
  command.Option("iterations", &options.iterations, "of Taubin smoothing");
  command.Option("json", &json, "write the result as JSON");
  AddCaptureFlags(&command, &capture_options);
  if (!command.Parse(argc, argv)) return 0;

  const ProxyReport report = MakeProxy(*OpenCapture(root, capture_options), options);
  WriteFile(options.out / "proxy.toml", command.ResolvedToml());
  if (json) {
    const nlohmann::ordered_json result = {{"capture", options.out.string()}, {"geometry", ToString(report.geometry)},
                                           {"frames", report.frames},         {"vertices", report.vertices},
                                           {"triangles", report.triangles},   {"files_linked", report.files_linked},
                                           {"files_kept", report.files_kept}};
    fmt::print("{}\n", result.dump(2));
  } else {
    fmt::print("{}: {} frames of {} geometry, {} vertices, {} triangles\nimages and masks: {} linked, {} kept\n",
               options.out.string(), report.frames, ToString(report.geometry), report.vertices, report.triangles,
               report.files_linked, report.files_kept);
    fmt::print("next: likeness unwrap {}\n", options.out.string());
  }
  return 0;
}

}  // namespace likeness
