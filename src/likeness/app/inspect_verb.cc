#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/avatar.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/capture/contact_sheet.h"
#include "likeness/capture/inspect.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/image/resize.h"
#include "likeness/render/portrait.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

// "captures/demo/" -> "demo_sheet.png", in the current folder: a capture may lie where nothing can be written.
fs::path DefaultSheet(const fs::path& path) {
  fs::path name = fs::absolute(path).lexically_normal();
  if (!name.has_filename()) name = name.parent_path();
  return name.stem().string() + "_sheet.png";
}

nlohmann::ordered_json AvatarJson(const fs::path& path, const Avatar& avatar) {
  nlohmann::ordered_json json;
  json["root"] = path.string();
  json["layout"] = "avatar";
  json["bytes"] = fs::file_size(path);
  json["architecture"] = nlohmann::ordered_json::parse(ArchitectureToJson(avatar.architecture));
  json["parameters"] = ParameterCount(avatar.architecture);
  json["mesh"] = {{"vertices", avatar.topology.vertex_count}, {"triangles", avatar.topology.triangles.size()}};
  json["texture_std"] = std::sqrt(avatar.texture_variance);
  json["vertex_std_mm"] = std::sqrt(avatar.vertex_variance);
  json["codes"] = avatar.codes.size();
  json["training"] = avatar.training;
  return json;
}

std::string AvatarText(const fs::path& path, const Avatar& avatar) {
  const Architecture& a = avatar.architecture;
  std::string text =
      fmt::format("{}: an avatar, {:.1f} MB\n\n", path.string(), static_cast<double>(fs::file_size(path)) / 1e6);
  text += fmt::format("network    preset {}, {}, {:.1f} million parameters, latent code of {}\n", a.preset,
                      ToString(a.model), static_cast<double>(ParameterCount(a)) / 1e6, a.latent);
  text += fmt::format("choices    view {}, normalisation {}, per-texel bias {}\n", ToString(a.conditioning),
                      ToString(a.normalisation), ToString(a.untied_bias));
  text += fmt::format("texture    {0} x {0} texels, standard deviation {1:.1f} of 255\n", a.texture_size,
                      std::sqrt(avatar.texture_variance));
  text +=
      fmt::format("mesh       {} vertices, {} triangles, standard deviation {:.2f} mm\n", avatar.topology.vertex_count,
                  avatar.topology.triangles.size(), std::sqrt(avatar.vertex_variance));
  text += fmt::format("codes      of {} training frames\n", avatar.codes.size());
  for (const auto& [key, value] : avatar.training) text += fmt::format("{:<10} {}\n", key, value);
  return text;
}

// The mean texture beside the mean head from three sides.
ImageU8 DrawAvatarSheet(const Avatar& avatar) {
  constexpr int kHeight = 480;
  std::vector<Panel> panels = {{FitInto(ToU8(avatar.texture_mean), kHeight, kHeight), "mean texture"}};
  for (const double azimuth : {-50.0, 0.0, 50.0}) {
    PortraitOptions view;
    view.azimuth_deg = azimuth;
    view.width = 360;
    view.height = kHeight;
    const Camera camera = PortraitCamera(avatar.vertex_mean, avatar.topology, view);
    panels.push_back({DrawMesh(avatar.vertex_mean, avatar.topology, avatar.texture_mean, camera, {}).colour,
                      fmt::format("mean head, azimuth {:g}", azimuth)});
  }
  return SideBySide(panels);
}

}  // namespace

int RunInspect(int argc, const char* const* argv) {
  fs::path path, sheet;
  CaptureOptions capture_options;
  ContactSheetOptions sheet_options;
  bool draw = true, json = false;
  Command command("inspect", "Says what a capture (or an avatar file) is and what is missing, and draws a sheet of it.",
                  "likeness inspect captures/demo --sheet demo.png");
  command.Positional("PATH", &path, "folder of a capture, or an avatar file");
  command.Option("sheet", &sheet, "PNG to write the sheet to; default: NAME_sheet.png in the current folder");
  command.Option("draw", &draw, "draw the sheet");
  command.Option("cameras", &sheet_options.cameras, "rows of the sheet");
  command.Option("frames", &sheet_options.frames, "columns of the sheet");
  command.Option("thumbnail", &sheet_options.thumbnail, "pixels of an image's longer side");
  command.Option("mesh", &sheet_options.mesh, "draw the tracked mesh over the images");
  command.Option("split", &capture_options.split_file, "JSON that names training and held-out cameras");
  command.Option("topology", &capture_options.topology_file, "OBJ with faces and texture coordinates");
  command.Option("json", &json, "write JSON to stdout");
  if (!command.Parse(argc, argv)) return 0;
  sheet_options.Check();
  if (sheet.empty()) sheet = DefaultSheet(path);

  nlohmann::ordered_json description;
  std::string text;
  ImageU8 picture;
  if (fs::is_regular_file(path)) {
    const Avatar avatar = LoadAvatar(path);
    description = AvatarJson(path, avatar);
    text = AvatarText(path, avatar);
    if (draw) picture = DrawAvatarSheet(avatar);
  } else {
    const std::unique_ptr<Capture> capture = OpenCapture(path, capture_options);
    const CaptureSummary summary = Summarize(*capture);
    description = nlohmann::ordered_json::parse(ToJson(summary));
    text = ToText(summary);
    if (draw) picture = DrawContactSheet(*capture, sheet_options);
  }
  if (draw) {
    WritePng(sheet, picture);
    WriteFile(fs::path(sheet).replace_extension(".toml"), command.ResolvedToml());
    description["sheet"] = sheet.string();
    text += fmt::format("\nsheet      {}\n", sheet.string());
  }
  fmt::print("{}\n", json ? description.dump(2) : text);
  return 0;
}

}  // namespace likeness
