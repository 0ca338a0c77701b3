// likeness import KIND SOURCE OUT, and likeness export-capture CAPTURE OUT

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/import_multiface.h"
#include "likeness/app/verbs.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"
#include "likeness/capture/import/export_capture.h"
#include "likeness/capture/import/import_capture.h"
#include "likeness/capture/import/read_calibration.h"

namespace likeness {
namespace {

// Kinds with options of their own.
struct OwnVerb {
  const char* kind;
  Verb run;
  const char* help;
};
constexpr OwnVerb kOwnVerbs[] = {
    {"ava256", RunConvert, "the same as likeness convert SOURCE OUT, whose options it takes"},
    {"multiface", RunImportMultiface, "a published checkpoint to an avatar; likeness import multiface --help"},
};

// Those, after the kinds that ImportCapture reads.
std::vector<std::string> Kinds() {
  std::vector<std::string> kinds = CalibrationKinds();
  for (const OwnVerb& own : kOwnVerbs) kinds.emplace_back(own.kind);
  return kinds;
}

std::string KindHelp() {
  std::string help = fmt::format("of the calibration: {}", fmt::join(CalibrationKinds(), ", "));
  for (const OwnVerb& own : kOwnVerbs) help += fmt::format("; or {} ({})", own.kind, own.help);
  return help;
}

void PrintResult(const ImportOptions& options, const ImportResult& result) {
  fmt::print("{}: {} cameras, {} frames; {} images written, {} copied, {} kept; valid masks of {} cameras\n",
             options.out.string(), result.cameras, result.frames, result.images_written, result.images_copied,
             result.images_kept, result.valid_masks);
  if (result.meshes > 0) fmt::print("tracked meshes of {} frames\n", result.meshes);
  if (result.distance_to_focus_mm > 0) {
    fmt::print("cameras stand {:.0f} mm from what they look at\n", result.distance_to_focus_mm);
  }
  for (const std::string& remark : result.remarks) fmt::print("  - {}\n", remark);
  if (result.meshes > 0) fmt::print("next: likeness inspect {}\n", options.out.string());
}

}  // namespace

int RunImport(int argc, const char* const* argv) {
  for (const OwnVerb& own : kOwnVerbs) {
    if (argc > 1 && std::string_view(argv[1]) == own.kind) return own.run(argc - 1, argv + 1);
  }
  ImportOptions options;
  bool json = false;
  Command command("import", "Makes a capture in our layout from other tools' calibrations and your files.",
                  "likeness import colmap scan/sparse/0 captures/mine --unit m "
                  "--images 'scan/{segment}/{camera}/{frame}.jpg'");
  command.Positional("KIND", &options.kind, KindHelp());
  command.Positional("SOURCE", &options.source, "file or folder of the calibration");
  command.Positional("OUT", &options.out, "folder of the capture");
  command.Choice("unit", &options.unit, {"m", "cm", "mm", "inch"}, "of the calibration's lengths");
  command.Option("scale", &options.scale, "multiplies them further, for calibrations without a unit");
  command.Option("fisheye", &options.fisheye, "OpenCV files that do not say so hold fisheye lenses");
  command.Option("images", &options.images,
                 "pattern with {segment}, {camera}, {frame}; else the images that the calibration names, as one frame");
  command.Option("masks", &options.masks, "pattern of head masks, white = head");
  command.Option("shrink", &options.shrink, "make images this many times smaller");
  command.Option("meshes", &options.meshes, "pattern of tracked meshes, .obj or .bin (float32 x y z)");
  command.Choice("mesh-space", &options.mesh_space, {"head", "world"}, "that the meshes stand in");
  command.Choice("mesh-unit", &options.mesh_unit, {"same", "m", "cm", "mm", "inch"},
                 "of meshes and poses; same: the calibration's");
  command.Option("poses", &options.poses, "pattern of head poses (3 x 4, head to world) for meshes in head space");
  command.Option("up", &options.up,
                 "direction that is up for the first frame's head, x,y,z in the world; else the "
                 "mean camera's (for meshes in world space)");
  command.Option("topology", &options.topology, "OBJ with faces and texture coordinates (default: the first mesh)");
  command.Option("json", &json, "result as JSON");
  if (!command.Parse(argc, argv)) return 0;
  const std::vector<std::string> kinds = Kinds();
  if (std::find(kinds.begin(), kinds.end(), options.kind) == kinds.end()) {
    const std::string nearest = NearestWord(options.kind, kinds);
    throw UsageError(fmt::format("there is no kind '{}'{}; known are {}", options.kind,
                                 nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest),
                                 fmt::join(kinds, ", ")));
  }

  const ImportResult result = ImportCapture(options);
  WriteFile(options.out / "import.toml", command.ResolvedToml());
  if (json) {
    const nlohmann::ordered_json description = {{"capture", options.out.string()},
                                                {"cameras", result.cameras},
                                                {"frames", result.frames},
                                                {"images_written", result.images_written},
                                                {"images_copied", result.images_copied},
                                                {"images_kept", result.images_kept},
                                                {"images_absent", result.images_absent},
                                                {"meshes", result.meshes},
                                                {"valid_masks", result.valid_masks},
                                                {"distance_to_focus_mm", result.distance_to_focus_mm},
                                                {"remarks", result.remarks}};
    fmt::print("{}\n", description.dump(2));
  } else {
    PrintResult(options, result);
  }
  return 0;
}

int RunExportCapture(int argc, const char* const* argv) {
  std::filesystem::path root;
  CaptureOptions capture_options;
  ExportOptions options;
  bool json = false;
  Command command("export-capture", "Writes one frame of a capture for nerfstudio or COLMAP.",
                  "likeness export-capture captures/demo scenes/demo --format colmap --unit m");
  command.Positional("CAPTURE", &root, "folder of the capture");
  command.Positional("OUT", &options.out, "folder to write to");
  command.Choice("format", &options.format, {"nerfstudio", "colmap"}, "of what is written");
  command.Option("frame", &options.frame, "SEGMENT/FRAME; else the first");
  command.Choice("unit", &options.unit, {"m", "cm", "mm", "inch"}, "of what is written");
  command.Option("text", &options.text, "COLMAP's model as text, not binary");
  command.Option("link", &options.link, "link to the capture's images instead of copying them");
  command.Option("json", &json, "result as JSON");
  AddCaptureFlags(&command, &capture_options);
  if (!command.Parse(argc, argv)) return 0;

  const ExportResult result = ExportCapture(*OpenCapture(root, capture_options), options);
  WriteFile(options.out / "export.toml", command.ResolvedToml());
  if (json) {
    const nlohmann::ordered_json description = {{"written", result.written.string()},
                                                {"segment", result.frame.segment},
                                                {"frame", result.frame.frame},
                                                {"cameras", result.cameras},
                                                {"masks", result.masks},
                                                {"points", result.points},
                                                {"without_image", result.without_image}};
    fmt::print("{}\n", description.dump(2));
  } else {
    fmt::print("{}: frame {}/{}, {} cameras, {} masks, {} points\n", result.written.string(), result.frame.segment,
               result.frame.frame, result.cameras, result.masks, result.points);
    if (!result.without_image.empty()) {
      fmt::print("  - without an image of this frame: {}\n", fmt::join(result.without_image, ", "));
    }
  }
  return 0;
}

}  // namespace likeness
