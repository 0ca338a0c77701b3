#include "likeness/capture/inspect.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <nlohmann/json.hpp>

#include "likeness/base/file.h"
#include "likeness/base/parallel.h"
#include "likeness/capture/layout.h"
#include "likeness/capture/proxy_record.h"

namespace likeness {
namespace {

void CountFiles(const Capture& capture, CaptureSummary* summary) {
  ParallelFor(static_cast<int64_t>(capture.cameras().size()), [&](int64_t i) {
    for (const FrameId& frame : capture.frames()) {
      summary->cameras[i].images += capture.HasCameraImage(frame, capture.cameras()[i]);
      summary->cameras[i].masks += capture.HasHeadMask(frame, capture.cameras()[i]);
    }
  });
}

void SummarizeMesh(const Capture& capture, CaptureSummary* summary) {
  const MeshTopology& topology = capture.topology();
  std::vector<bool> used(topology.vertex_count, false);
  for (const Eigen::Vector3i& triangle : topology.triangles) {
    for (const int vertex : triangle) used[vertex] = true;
  }
  summary->vertices = topology.vertex_count;
  summary->vertices_in_triangles = static_cast<int>(std::count(used.begin(), used.end(), true));
  summary->uvs = static_cast<int>(topology.uvs.size());
  summary->triangles = static_cast<int>(topology.triangles.size());
  const TrackedFrame tracked = capture.ReadTracked(capture.frames().front());
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (int i = 0; i < topology.vertex_count; ++i) {
    if (!used[i]) continue;
    low = low.min(tracked.vertices_in_head.row(i).transpose().array());
    high = high.max(tracked.vertices_in_head.row(i).transpose().array());
  }
  summary->mesh_width_mm = high.x() - low.x();
  summary->mesh_height_mm = high.y() - low.y();
  for (size_t i = 0; i < capture.cameras().size(); ++i) {
    const Eigen::Vector3d centre = capture.cameras()[i].CentreInWorld();
    summary->cameras[i].distance_mm = (centre - tracked.world_from_head.translation).norm();
  }
}

void FindTextures(const Capture& capture, CaptureSummary* summary) {
  const CaptureLayout layout(capture.root());
  for (const int size : TextureSizes(capture.root())) {
    TextureSummary texture;
    texture.size = size;
    for (const FrameId& frame : capture.frames()) texture.averages += Exists(layout.AverageTexture(frame, size));
    summary->textures.push_back(texture);
  }
  summary->has_statistics = Exists(layout.TextureMean()) && Exists(layout.TextureVariance()) &&
                            Exists(layout.VertexMean()) && Exists(layout.VertexVariance());
}

// "a, b, c and 5 more"
std::string SomeOf(const std::vector<std::string>& names) {
  constexpr size_t kShown = 4;
  if (names.size() <= kShown + 1) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + kShown, ", "), names.size() - kShown);
}

void FindMissing(const Capture& capture, CaptureSummary* summary) {
  std::vector<std::string>& missing = summary->missing;
  if (!capture.skipped_frames().empty()) {
    const SkippedFrame& first = capture.skipped_frames().front();
    missing.push_back(fmt::format("{} listed frame(s) are left out; the first, {} {}: {}",
                                  capture.skipped_frames().size(), first.frame.segment, first.frame.frame,
                                  first.reason));
  }
  std::vector<std::string> without_images, with_gaps, without_masks;
  for (const CameraSummary& camera : summary->cameras) {
    if (camera.images == 0) {
      without_images.push_back(camera.name);
    } else if (camera.images < summary->frames) {
      with_gaps.push_back(fmt::format("{} ({} of {})", camera.name, camera.images, summary->frames));
    }
    if (camera.images > 0 && camera.masks == 0) without_masks.push_back(camera.name);
  }
  if (!without_images.empty()) {
    missing.push_back(fmt::format("no images of {} camera(s): {}", without_images.size(), SomeOf(without_images)));
  }
  if (!with_gaps.empty()) missing.push_back(fmt::format("frames without an image: {}", SomeOf(with_gaps)));
  if (!without_masks.empty()) {
    missing.push_back(fmt::format("no head masks of {} camera(s): {}; the mesh's outline stands in for them",
                                  without_masks.size(), SomeOf(without_masks)));
  }
  if (capture.split().held_out_cameras.empty())
    missing.emplace_back("no camera is held out: nothing to judge views by");
  if (capture.split().held_out_segments.empty()) {
    missing.emplace_back("no segment is held out: nothing to judge expressions by");
  }
  // Other layouts are their publishers', and often read-only.
  const std::string how = summary->layout == "Multiface"
                              ? fmt::format("; run: likeness unwrap {}", summary->root)
                              : fmt::format("; run: likeness convert {} OUT && likeness unwrap OUT", summary->root);
  if (summary->textures.empty()) missing.push_back("no unwrapped textures" + how);
  for (const TextureSummary& texture : summary->textures) {
    if (texture.averages == summary->frames) continue;
    missing.push_back(fmt::format("average textures of {} texels for {} of {} frames only{}", texture.size,
                                  texture.averages, summary->frames, how));
  }
  if (!summary->has_statistics) missing.push_back("no statistics (tex_mean.png, vert_mean.bin and variances)" + how);
}

}  // namespace

std::string ToString(CameraRole role) {
  switch (role) {
    case CameraRole::kTraining:
      return "training";
    case CameraRole::kHeldOut:
      return "held out";
    case CameraRole::kUnused:
      return "unused";
  }
  return "";
}

CameraRole RoleOf(const Split& split, const std::string& camera) {
  if (split.IsHeldOutCamera(camera)) return CameraRole::kHeldOut;
  const auto& training = split.training_cameras;
  return std::find(training.begin(), training.end(), camera) != training.end() ? CameraRole::kTraining
                                                                               : CameraRole::kUnused;
}

CaptureSummary Summarize(const Capture& capture) {
  CaptureSummary summary;
  summary.root = capture.root().string();
  summary.layout = capture.layout_name();
  summary.geometry = ToString(GeometryOf(capture.root()));
  summary.frames = static_cast<int>(capture.frames().size());
  summary.skipped_frames = static_cast<int>(capture.skipped_frames().size());
  for (const Camera& camera : capture.cameras()) {
    summary.cameras.push_back({camera.name, camera.width, camera.height, camera.intrinsics(0, 0), 0,
                               RoleOf(capture.split(), camera.name), 0, 0});
  }
  for (const FrameId& frame : capture.frames()) {
    auto segment = std::find_if(summary.segments.begin(), summary.segments.end(),
                                [&](const SegmentSummary& s) { return s.name == frame.segment; });
    if (segment == summary.segments.end()) {
      summary.segments.push_back({frame.segment, 0, capture.split().IsHeldOutSegment(frame.segment)});
      segment = std::prev(summary.segments.end());
    }
    ++segment->frames;
  }
  CountFiles(capture, &summary);
  SummarizeMesh(capture, &summary);
  FindTextures(capture, &summary);
  FindMissing(capture, &summary);
  return summary;
}

std::string ToText(const CaptureSummary& s) {
  std::string text = fmt::format("{}: a capture in the {} layout\n\n", s.root, s.layout);
  size_t widest = 6;
  for (const CameraSummary& camera : s.cameras) widest = std::max(widest, camera.name.size());
  text += fmt::format("cameras ({})\n  {:<{}}  {:>11}  {:>8}  {:>8}  {:>6}  {:>6}  role\n", s.cameras.size(), "name",
                      widest, "pixels", "focal px", "distance", "images", "masks");
  for (const CameraSummary& c : s.cameras) {
    text += fmt::format("  {:<{}}  {:>11}  {:>8.1f}  {:>5.2f} m  {:>7}  {:>6}  {}\n", c.name, widest,
                        c.width > 0 ? fmt::format("{} x {}", c.width, c.height) : "unknown", c.focal_px,
                        c.distance_mm / 1000, c.images, c.masks, ToString(c.role));
  }
  widest = 6;
  for (const SegmentSummary& segment : s.segments) widest = std::max(widest, segment.name.size());
  text += fmt::format("\nsegments ({}), {} frames\n", s.segments.size(), s.frames);
  for (const SegmentSummary& segment : s.segments) {
    text += fmt::format("  {:<{}}  {:>6} frames  {}\n", segment.name, widest, segment.frames,
                        segment.held_out ? "held out" : "training");
  }
  text += fmt::format(
      "\nmesh       {}: {} vertices ({} in triangles), {} triangles, {} texture coordinates, {:.0f} x {:.0f} mm\n",
      s.geometry, s.vertices, s.vertices_in_triangles, s.triangles, s.uvs, s.mesh_width_mm, s.mesh_height_mm);
  std::vector<std::string> textures;
  for (const TextureSummary& texture : s.textures) {
    textures.push_back(fmt::format("{0} x {0} ({1} of {2} averages)", texture.size, texture.averages, s.frames));
  }
  text += fmt::format("textures   {}\n",
                      textures.empty() ? "none unwrapped" : fmt::format("{}", fmt::join(textures, ", ")));
  text += fmt::format("statistics {}\n", s.has_statistics ? "complete" : "none");
  text += s.missing.empty() ? "\nnothing is missing\n" : "\nmissing\n";
  for (const std::string& sentence : s.missing) text += fmt::format("  - {}\n", sentence);
  return text;
}

std::string ToJson(const CaptureSummary& s) {
  nlohmann::ordered_json json;
  json["root"] = s.root;
  json["layout"] = s.layout;
  json["geometry"] = s.geometry;
  json["frames"] = s.frames;
  json["skipped_frames"] = s.skipped_frames;
  json["cameras"] = nlohmann::ordered_json::array();
  for (const CameraSummary& c : s.cameras) {
    json["cameras"].push_back({{"name", c.name},
                               {"width", c.width},
                               {"height", c.height},
                               {"focal_px", c.focal_px},
                               {"distance_mm", c.distance_mm},
                               {"role", ToString(c.role)},
                               {"images", c.images},
                               {"masks", c.masks}});
  }
  json["segments"] = nlohmann::ordered_json::array();
  for (const SegmentSummary& segment : s.segments) {
    json["segments"].push_back({{"name", segment.name}, {"frames", segment.frames}, {"held_out", segment.held_out}});
  }
  json["mesh"] = {{"vertices", s.vertices},      {"vertices_in_triangles", s.vertices_in_triangles},
                  {"triangles", s.triangles},    {"uvs", s.uvs},
                  {"width_mm", s.mesh_width_mm}, {"height_mm", s.mesh_height_mm}};
  json["textures"] = nlohmann::ordered_json::array();
  for (const TextureSummary& texture : s.textures) {
    json["textures"].push_back({{"size", texture.size}, {"averages", texture.averages}});
  }
  json["has_statistics"] = s.has_statistics;
  json["missing"] = s.missing;
  return json.dump(2);
}

}  // namespace likeness
