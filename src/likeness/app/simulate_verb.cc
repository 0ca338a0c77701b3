#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/file.h"
#include "likeness/simulate/simulate.h"

namespace likeness {

int RunSimulate(int argc, const char* const* argv) {
  SimulateOptions options;
  std::string shading = "full";
  bool json = false;
  Command command("simulate", "Makes a multi-camera capture of a simulated head, with known truth.",
                  "likeness simulate captures/demo --head human:7 --cameras 14 --frames 48");
  command.Positional("OUT", &options.out, "folder of the capture");
  command.Option("head", &options.head, "human:SEED, human:FILE.toml, FILE.glb, procedural[:SEED], or plain (for tests)");
  command.Option("head-data", &options.head_data, "folder of the MakeHuman data, if not found by itself");
  command.Option("shape-map", &options.shape_map, "JSON: which morph targets of FILE.glb make which ARKit expression");
  command.Option("performance", &options.performance, "Live Link Face recording (CSV) to perform; else a built-in one");
  command.Option("frames", &options.frames, "frames over all segments");
  command.Option("cameras", &options.rig.cameras, "cameras in all");
  command.Option("held-out-cameras", &options.rig.held_out_cameras, "how many of them the split holds out");
  command.Option("width", &options.rig.width, "pixels");
  command.Option("height", &options.rig.height, "pixels");
  command.Option("distance-mm", &options.rig.distance_mm, "from the head to the cameras");
  command.Option("most-azimuth", &options.rig.most_azimuth, "how far to each side cameras stand, degrees");
  command.Option("lowest-elevation", &options.rig.lowest_elevation, "of cameras, degrees");
  command.Option("highest-elevation", &options.rig.highest_elevation, "of cameras, degrees");
  command.Choice("shading", &shading, {"full", "albedo"}, "lit, or the albedo as it is");
  command.Option("samples", &options.render.samples, "rays a pixel");
  command.Option("lights", &options.lights, "lights around the head");
  command.Option("exposure", &options.exposure, "linear value of a white surface that faces forwards");
  command.Option("seed", &options.seed, "of the motion");
  command.Option("json", &json, "result as JSON");
  if (!command.Parse(argc, argv)) return 0;
  options.render.shading = shading == "full" ? Shading::kFull : Shading::kAlbedo;

  const SimulateResult result = Simulate(options);
  WriteFile(options.out / "simulate.toml", command.ResolvedToml());
  if (json) {
    fmt::print("{}\n", nlohmann::json{{"capture", options.out.string()},
                                      {"cameras", result.cameras},
                                      {"segments", result.segments},
                                      {"frames", result.frames},
                                      {"images_written", result.images_written},
                                      {"images_kept", result.images_kept}}
                           .dump());
  } else {
    fmt::print("{}: {} cameras, {} segments, {} frames; {} images written, {} kept\n", options.out.string(),
               result.cameras, result.segments, result.frames, result.images_written, result.images_kept);
  }
  return 0;
}

}  // namespace likeness
