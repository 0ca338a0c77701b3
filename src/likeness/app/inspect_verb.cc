#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/mesh_file.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/avatar.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/capture/contact_sheet.h"
#include "likeness/capture/inspect.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/image/resize.h"
#include "likeness/render/mesh_views.h"

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

constexpr int kViewHeight = 480;  // px

// A texture beside the mesh from three sides.
ImageU8 DrawTexturedViews(const Vertices& vertices, const MeshTopology& topology, const ImageU8& texture,
                          const std::string& label) {
  std::vector<Panel> panels = MeshViews(vertices, topology, &texture, kViewHeight);
  panels.insert(panels.begin(), {FitInto(texture, kViewHeight, kViewHeight), label});
  return SideBySide(panels);
}

// A mesh with its average texture, of the first of some frames that has one; otherwise the first mesh in grey.
ImageU8 DrawCaptureViews(const Capture& capture) {
  constexpr size_t kTried = 6;
  for (const size_t i : EvenlySpread(capture.frames().size(), kTried)) {
    const FrameId& frame = capture.frames()[i];
    try {
      const std::optional<ImageU8> texture = capture.ReadAverageTexture(frame);
      if (!texture) continue;
      return DrawTexturedViews(capture.ReadTracked(frame).vertices_in_head, capture.topology(), *texture,
                               fmt::format("average texture, {} {}", frame.segment, frame.frame));
    } catch (const Error& error) {
      LogWarning("{}", error.what());  // a damaged file must not hide the rest of the capture
    }
  }
  const Vertices vertices = capture.ReadTracked(capture.frames().front()).vertices_in_head;
  return SideBySide(MeshViews(vertices, capture.topology(), nullptr, kViewHeight));
}

struct Description {
  nlohmann::ordered_json json;
  std::string text;
  ImageU8 picture;  // empty where none is to be drawn
};

Description DescribeMesh(const fs::path& path, const fs::path& topology_file, const fs::path& texture_file, bool draw) {
  const MeshFile mesh = ReadMeshFile(path, topology_file);
  if (!texture_file.empty() && !mesh.HasUvs()) {
    throw Error("{}: a texture needs texture coordinates, which {} lacks; name an .obj that has them with --topology",
                texture_file.string(), (topology_file.empty() ? path : topology_file).string());
  }
  const Eigen::RowVector3f low = mesh.vertices.colwise().minCoeff(), high = mesh.vertices.colwise().maxCoeff();
  const MeshTopology& topology = mesh.topology;
  Description d;
  d.json = {{"root", path.string()},
            {"layout", "mesh"},
            {"vertices", topology.vertex_count},
            {"triangles", topology.triangles.size()},
            {"uvs", topology.uvs.size()},
            {"lowest", {low[0], low[1], low[2]}},
            {"highest", {high[0], high[1], high[2]}}};
  d.text = fmt::format(
      "{}: a mesh of {} vertices, {} triangles, {} texture coordinates\n"
      "x {:.1f} ... {:.1f}, y {:.1f} ... {:.1f}, z {:.1f} ... {:.1f}\n",
      path.string(), topology.vertex_count, topology.triangles.size(), topology.uvs.size(), low[0], high[0], low[1],
      high[1], low[2], high[2]);
  if (!draw) return d;
  if (texture_file.empty()) {
    d.picture = SideBySide(MeshViews(mesh.vertices, topology, nullptr, kViewHeight));
  } else {
    d.picture = DrawTexturedViews(mesh.vertices, topology, ReadImage(texture_file), texture_file.filename().string());
  }
  return d;
}

Description DescribeAvatar(const fs::path& path, bool draw) {
  const Avatar avatar = LoadAvatar(path);
  Description d = {AvatarJson(path, avatar), AvatarText(path, avatar), {}};
  if (draw)
    d.picture = DrawTexturedViews(avatar.identities[0].vertex_mean, avatar.topology,
                                  ToU8(avatar.identities[0].texture_mean), "mean texture");
  return d;
}

Description DescribeCapture(const Capture& capture, bool draw, bool views, const ContactSheetOptions& options) {
  const CaptureSummary summary = Summarize(capture);
  Description d = {nlohmann::ordered_json::parse(ToJson(summary)), ToText(summary), {}};
  if (draw) d.picture = DrawContactSheet(capture, options);
  if (draw && views) d.picture = Stacked({d.picture, DrawCaptureViews(capture)});
  return d;
}

}  // namespace

int RunInspect(int argc, const char* const* argv) {
  fs::path path, sheet, texture;
  CaptureOptions capture_options;
  ContactSheetOptions sheet_options;
  bool draw = true, views = true, json = false;
  Command command("inspect",
                  "Says what a capture, a mesh or an avatar file is and what is missing, and draws a sheet of it.",
                  "likeness inspect captures/demo --sheet demo.png\n"
                  "         likeness inspect 021924.bin --topology face.obj --texture 021924.png");
  command.Positional("PATH", &path, "folder of a capture, a mesh (.bin, .ply, .obj), or an avatar file");
  command.Option("sheet", &sheet, "PNG to write the sheet to; default: NAME_sheet.png in the current folder");
  command.Option("draw", &draw, "draw the sheet");
  command.Option("cameras", &sheet_options.cameras, "rows of the sheet");
  command.Option("frames", &sheet_options.frames, "columns of the sheet");
  command.Option("thumbnail", &sheet_options.thumbnail, "pixels of an image's longer side");
  command.Option("mesh", &sheet_options.mesh, "draw the tracked mesh over the images");
  command.Option("views", &views, "draw a capture's first mesh from three sides, with its average texture");
  command.Option("texture", &texture, "of a mesh file: PNG, JPEG or AVIF whose first row is v = 1");
  AddCaptureFlags(&command, &capture_options);
  command.Option("json", &json, "write JSON to stdout");
  if (!command.Parse(argc, argv)) return 0;
  sheet_options.Check();
  if (sheet.empty()) sheet = DefaultSheet(path);

  Description d;
  if (!fs::is_regular_file(path)) {
    if (!texture.empty()) throw UsageError("--texture is for a mesh file; a capture has its own textures");
    d = DescribeCapture(*OpenCapture(path, capture_options), draw, views, sheet_options);
  } else if (IsMeshFile(path)) {
    d = DescribeMesh(path, capture_options.topology_file, texture, draw);
  } else {
    d = DescribeAvatar(path, draw);
  }
  if (draw) {
    WritePng(sheet, d.picture);
    WriteFile(fs::path(sheet).replace_extension(".toml"), command.ResolvedToml());
    d.json["sheet"] = sheet.string();
    d.text += fmt::format("\nsheet      {}\n", sheet.string());
  }
  fmt::print("{}\n", json ? d.json.dump(2) : d.text);
  return 0;
}

}  // namespace likeness
