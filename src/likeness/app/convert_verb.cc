// likeness convert CAPTURE OUT

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/file.h"
#include "likeness/capture/convert.h"

namespace likeness {
namespace {

std::string ToText(const ConvertOptions& options, const ConvertReport& r) {
  std::string text = fmt::format(
      "{}: {} cameras, {} segments, {} frames\nimages     {} written as PNG, {} copied byte for "
      "byte, {} hard-linked, {} kept from before",
      options.out.string(), r.cameras, r.segments, r.frames, r.images_encoded, r.images_copied, r.images_linked,
      r.images_kept);
  if (r.images_absent > 0) text += fmt::format(", {} absent in the source", r.images_absent);
  text += fmt::format("\nmasks      {} written\ntextures   {} files carried\n", r.masks, r.textures);
  for (const std::string& what : r.dropped) text += fmt::format("dropped    {}\n", what);
  for (const std::string& what : r.unreadable) text += fmt::format("unreadable {}\n", what);
  return text;
}

nlohmann::ordered_json ToJson(const ConvertOptions& options, const ConvertReport& r) {
  return {{"capture", options.out.string()},
          {"cameras", r.cameras},
          {"segments", r.segments},
          {"frames", r.frames},
          {"images_encoded", r.images_encoded},
          {"images_copied", r.images_copied},
          {"images_linked", r.images_linked},
          {"images_kept", r.images_kept},
          {"images_absent", r.images_absent},
          {"masks", r.masks},
          {"textures", r.textures},
          {"dropped", r.dropped},
          {"unreadable", r.unreadable}};
}

}  // namespace

int RunConvert(int argc, const char* const* argv) {
  std::filesystem::path root;
  CaptureOptions capture_options;
  ConvertOptions options;
  SelectionFlags selection;
  bool json = false;
  Command command(
      "convert",
      "Copies a capture, or a part of it, into the Multiface layout. Only what is asked for is read; the source "
      "is not touched.",
      "likeness convert captures/ava256/20210831--0814--ABC123 captures/abc --segments 'EXP_*' --count 200 "
      "--scale 0.5");
  command.Positional("CAPTURE", &root, "folder of the capture, in any layout that is read");
  command.Positional("OUT", &options.out, "folder to make");
  AddSelectionFlags(&command, &selection);
  command.Option("width", &options.width, "pixels of the new images; their height follows (0: as they are)");
  command.Option("scale", &options.scale, "of the images, up to 1");
  command.Option("masks", &options.masks, "take head masks along");
  command.Option("textures", &options.textures, "take textures and statistics along, as far as they stay true");
  command.Option("link", &options.link,
                 "hard-link images that need not change, instead of copying them: editing one in place edits both");
  command.Option("json", &json, "write the result as JSON");
  AddCaptureFlags(&command, &capture_options);
  if (!command.Parse(argc, argv)) return 0;
  options.selection = selection.Selection();

  const ConvertReport report = ConvertCapture(*OpenCapture(root, capture_options), options);
  WriteFile(options.out / "convert.toml", command.ResolvedToml());
  if (json) {
    fmt::print("{}\n", ToJson(options, report).dump(2));
  } else {
    fmt::print("{}", ToText(options, report));
  }
  return report.unreadable.empty() ? 0 : 1;
}

}  // namespace likeness
