// likeness unwrap CAPTURE

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/shard_flag.h"
#include "likeness/app/verbs.h"
#include "likeness/base/file.h"
#include "likeness/capture/capture.h"
#include "likeness/capture/layout.h"
#include "likeness/texture/unwrap_capture.h"

namespace likeness {

int RunUnwrap(int argc, const char* const* argv) {
  std::filesystem::path root;
  CaptureOptions capture_options;
  UnwrapOptions options;
  bool training_only = false, json = false;
  Command command("unwrap", "Turns camera images into textures, their averages and statistics.",
                  "likeness unwrap captures/demo --size 512");
  command.Positional("CAPTURE", &root, "folder of the capture");
  command.Option("size", &options.size, "texels a side");
  command.Option("grazing", &options.grazing_deg,
                 "degrees between a triangle's normal and the camera up to which its texels count as seen");
  command.Option("masks", &options.use_masks, "take colours from head pixels alone where the capture has masks");
  command.Option("training-only", &training_only, "skip held-out cameras, which only evaluation needs");
  command.Option("redo", &options.redo, "remove textures of this size and make them anew");
  command.Option("json", &json, "write the result as JSON");
  std::string shard_text;
  AddShardFlag(&command, &shard_text,
               "unwraps only the i-th of n parts of the frames; the last to finish writes the statistics");
  AddCaptureFlags(&command, &capture_options);
  if (!command.Parse(argc, argv)) return 0;
  const Shard shard = TakeShard(&shard_text);
  options.held_out = !training_only;

  const auto capture = OpenCapture(root, capture_options);
  const UnwrapReport report = UnwrapCapture(*capture, options, shard);
  const std::filesystem::path folder = CaptureLayout(root).TextureFolder(options.size);
  WriteFile(folder / "unwrap.toml", command.ResolvedToml());
  if (json) {
    nlohmann::ordered_json result = {{"folder", folder.string()},
                                     {"views", report.views},
                                     {"views_kept", report.views_kept},
                                     {"views_absent", report.views_absent},
                                     {"training_views", report.training_views}};
    if (!report.shards_missing.empty()) {
      result["shards_missing"] = report.shards_missing;
    } else {
      result["texture_variance"] = report.texture_variance;
      result["vertex_variance_mm2"] = report.vertex_variance;
    }
    fmt::print("{}\n", result.dump(2));
  } else {
    fmt::print("{}: {} views unwrapped, {} kept from before", folder.string(), report.views, report.views_kept);
    if (report.views_absent > 0) fmt::print(", {} without an image", report.views_absent);
    if (!report.shards_missing.empty()) {
      fmt::print("\nshard {} of {} is done; no statistics before shards {} are\n", shard.index, shard.count,
                 fmt::join(report.shards_missing, ", "));
      return 0;
    }
    fmt::print("\nstatistics of {} training views: texture variance {:.1f}, vertex variance {:.3f} mm^2\n",
               report.training_views, report.texture_variance, report.vertex_variance);
  }
  return 0;
}

}  // namespace likeness
