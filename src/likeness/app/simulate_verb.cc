#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "likeness/app/command.h"
#include "likeness/app/shard_flag.h"
#include "likeness/app/verbs.h"
#include "likeness/base/file.h"
#include "likeness/simulate/people.h"

namespace likeness {
namespace {

// What the command line says beside the options themselves.
struct Words {
  std::string preset = "demo";
  std::string shading = "full";
  std::string script;
  std::string shard;
  int people = 1;
  bool json = false;
};

Command MakeCommand(SimulateOptions* options, Words* words) {
  Command command("simulate", "Makes a multi-camera capture of a simulated head, with known truth.",
                  "likeness simulate captures/anna --preset small --head human:5 --frames 20");
  command.Positional("OUT", &options->out, "folder of the capture");
  command.Choice("preset", &words->preset, {"demo", "small", "paper"},
                 "options to begin with, which flags change: the demo's, small and quick, or the paper's rig");
  command.Option("head", &options->head,
                 "human:SEED, human:FILE.toml, FILE.glb, procedural[:SEED], or plain (for tests)");
  command.Option("head-data", &options->head_data, "folder of the MakeHuman data, if not found by itself");
  command.Option("shape-map", &options->shape_map, "JSON: which morph targets of FILE.glb make which ARKit expression");
  command.Option(
      "people", &words->people,
      "2 to 64: as many captures OUT/person_1 ... of different people who do the same; --head's seed chooses");
  AddShardFlag(&command, &words->shard, "makes only the i-th of n parts of the frames");
  command.Option("performance", &options->performance,
                 "Live Link Face recording (CSV) to perform; else a built-in one");
  command.Choice("script", &words->script, {"short", "full"},
                 "built-in performance: of any length, or 122 expressions and 50 sentences");
  command.Option("frames", &options->frames, "frames over all segments");
  command.Option("cameras", &options->rig.cameras, "cameras in all");
  command.Option("held-out-cameras", &options->rig.held_out_cameras, "how many of them the split holds out");
  command.Option("width", &options->rig.width, "pixels");
  command.Option("height", &options->rig.height, "pixels");
  command.Option("distance-mm", &options->rig.distance_mm, "from the head to the cameras");
  command.Option("lens-mm", &options->rig.lens_mm, "as on a 36 x 24 mm sensor; 0: the longest that the head fits");
  command.Option("most-azimuth", &options->rig.most_azimuth, "how far to each side cameras stand, degrees");
  command.Option("lowest-elevation", &options->rig.lowest_elevation, "of cameras, degrees");
  command.Option("highest-elevation", &options->rig.highest_elevation, "of cameras, degrees");
  command.Choice("shading", &words->shading, {"full", "albedo"}, "lit, or the albedo as it is");
  command.Option("samples", &options->render.samples, "rays a pixel");
  command.Option("lights", &options->lights, "lights around the head");
  command.Option("exposure", &options->exposure, "linear value of a white surface that faces forwards");
  command.Option("seed", &options->seed, "of motion and imperfections");
  ImperfectionOptions& flaws = options->imperfections;
  command.Option("tracking-noise-mm", &flaws.tracking_noise_mm, "imperfection: error of tracked vertices, RMS");
  command.Option("tracking-smoothing", &flaws.tracking_smoothing, "imperfection: smoothing of tracked meshes, times");
  command.Option("calibration-error-px", &flaws.calibration_error_px, "imperfection: reprojection error, RMS");
  command.Option("lens-blur-px", &flaws.lens_blur_px, "imperfection: Gaussian blur, standard deviation");
  command.Option("exposure-flicker", &flaws.exposure_flicker, "imperfection: of frames; 0.05 is 5%");
  command.Option("sensor-noise", &flaws.sensor_noise, "imperfection: at mid grey, in levels of 255");
  command.Option("colour-gain", &flaws.colour_gain, "imperfection: gain of cameras' channels; 0.05 is 5%");
  command.Option("colour-bias", &flaws.colour_bias, "imperfection: bias of cameras' channels, in levels of 255");
  command.Option("json", &words->json, "result as JSON");
  return command;
}

nlohmann::json ToJson(const std::filesystem::path& capture, const SimulateResult& result) {
  return {{"capture", capture.string()},
          {"cameras", result.cameras},
          {"segments", result.segments},
          {"frames", result.frames},
          {"images_written", result.images_written},
          {"images_kept", result.images_kept}};
}

void Print(const std::filesystem::path& capture, const SimulateResult& result) {
  fmt::print("{}: {} cameras, {} segments, {} frames; {} images written, {} kept\n", capture.string(), result.cameras,
             result.segments, result.frames, result.images_written, result.images_kept);
}

}  // namespace

int RunSimulate(int argc, const char* const* argv) {
  SimulateOptions options;
  Words words;
  // The preset first, then everything again on top of it.
  words.script = "short";
  if (!MakeCommand(&options, &words).Parse(argc, argv)) return 0;
  options = SimulatePreset(words.preset);
  words = Words();
  words.script = options.script == Script::kFull ? "full" : "short";
  Command command = MakeCommand(&options, &words);
  command.Parse(argc, argv);
  options.render.shading = words.shading == "full" ? Shading::kFull : Shading::kAlbedo;
  options.script = words.script == "full" ? Script::kFull : Script::kShort;
  const Shard shard = TakeShard(&words.shard);
  options.shard = shard.index;
  options.shards = shard.count;

  if (words.people == 1) {
    const SimulateResult result = Simulate(options);
    WriteFile(options.out / "simulate.toml", command.ResolvedToml());
    if (words.json) {
      fmt::print("{}\n", ToJson(options.out, result).dump());
    } else {
      Print(options.out, result);
    }
    return 0;
  }
  const std::vector<Person> people = SimulatePeople(options, words.people);
  WriteFile(options.out / "simulate.toml", command.ResolvedToml());
  nlohmann::json all = nlohmann::json::array();
  for (const Person& person : people) {
    all.push_back(ToJson(options.out / person.name, person.result));
    all.back()["head"] = person.head;
    if (!words.json) Print(options.out / person.name, person.result);
  }
  if (words.json) fmt::print("{}\n", all.dump());
  return 0;
}

}  // namespace likeness
