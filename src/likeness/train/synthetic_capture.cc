#include "likeness/train/synthetic_capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "likeness/base/file.h"
#include "likeness/capture/condition_file.h"
#include "likeness/capture/writer.h"
#include "likeness/image/image_io.h"
#include "likeness/render/rasterizer.h"

namespace likeness {

namespace {

MeshTopology Grid(int side) {
  MeshTopology topology;
  topology.vertex_count = side * side;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      topology.uvs.emplace_back(static_cast<float>(x) / (side - 1), static_cast<float>(y) / (side - 1));
    }
  }
  for (int y = 0; y + 1 < side; ++y) {
    for (int x = 0; x + 1 < side; ++x) {
      const int i = y * side + x;
      topology.triangles.emplace_back(i, i + 1, i + side);
      topology.triangles.emplace_back(i + side, i + 1, i + side + 1);
    }
  }
  topology.triangle_uvs = topology.triangles;
  return topology;
}

}  // namespace

void SyntheticCapture::Write(const std::filesystem::path& root) const {
  const CaptureWriter writer(root);
  const CaptureLayout& layout = writer.layout();
  const MeshTopology topology = Grid(grid);

  std::vector<Camera> rig;
  Split split;
  for (int c = 0; c < cameras; ++c) {
    const double angle = (c - 0.5 * (cameras - 1)) * 1.2 / std::max(1, cameras - 1);
    const Eigen::Vector3d centre = 1000 * Eigen::Vector3d(std::sin(angle), 0.2, std::cos(angle));
    const int pixels = picture > 0 ? picture : 8;
    Camera camera = LookAt(centre, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitY(), 8 * pixels, pixels, pixels);
    camera.name = fmt::format("c{}", c);
    rig.push_back(camera);
    (c < cameras - held_out_cameras ? split.training_cameras : split.held_out_cameras).push_back(camera.name);
  }
  split.held_out_segments = {"held"};
  std::vector<FrameId> ids;
  for (int f = 0; f < frames; ++f) ids.push_back({"a", fmt::format("{:06d}", f)});
  for (int f = 0; f < 2; ++f) ids.push_back({"held", fmt::format("{:06d}", f)});
  writer.WriteCalibration(rig);
  writer.WriteFrameList(ids);
  writer.WriteSplit(split);

  const size_t values = static_cast<size_t>(size) * size * 3;
  std::vector<double> sums(values), squares(values), seen(values), vertex_sum(3 * topology.vertex_count);
  std::vector<Vertices> meshes;
  const double vigour = 1 + 0.8 * person;  // of what the frame's state does
  for (size_t f = 0; f < ids.size(); ++f) {
    const double state = std::sin(1.7 * static_cast<double>(f)), other = std::cos(2.9 * static_cast<double>(f));
    TrackedFrame tracked;
    tracked.vertices_in_head = Vertices(topology.vertex_count, 3);
    for (int v = 0; v < topology.vertex_count; ++v) {
      const Eigen::Vector2f uv = topology.uvs[v];
      tracked.vertices_in_head.row(v) << 100 * (uv.x() - 0.5f), 100 * (uv.y() - 0.5f),
          static_cast<float>(30 * person * uv.y() + 10 * vigour * state * uv.x() + 5 * other * uv.y());
    }
    tracked.world_from_head.rotation = RotationFromYawPitchRoll(0.1 * state, 0, 0);
    TrackedFrame seen_by_tracker = tracked;
    seen_by_tracker.vertices_in_head.col(0).array() += tracking_error_mm;
    writer.WriteTracked(ids[f], seen_by_tracker);
    if (f == 0) writer.WriteObj(ids[f], seen_by_tracker.vertices_in_head, topology);
    meshes.push_back(seen_by_tracker.vertices_in_head);

    ImageF average(size, size, 3);
    ImageF count(size, size, 1);
    for (const Camera& camera : rig) {
      const Eigen::Vector3d view = ViewVector(camera, tracked.world_from_head);
      const bool training = !split.IsHeldOutCamera(camera.name);
      ImageU8 texture(size, size, 3), mask(size, size, 1);
      ImageF whole(size, size, 3);
      for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
          const double u = (x + 0.5) / size, v = 1 - (y + 0.5) / size;
          const bool is_seen = (u - 0.5) * view.x() >= -0.25;  // not the far cheek
          if (is_seen) mask.at(x, y)[0] = 255;
          for (int c = 0; c < 3; ++c) {
            const double value = 120 + 40 * std::sin(7 * u + c) + 30 * std::cos(5 * v + 2 * c) +
                                 25 * vigour * state * std::sin(9 * v + c) + 20 * other * u +
                                 15 * person * std::sin(11 * (u + v)) + 25 * view.x() * (u - v);
            const auto byte = static_cast<uint8_t>(std::clamp(std::lround(value), 1L, 255L));
            whole.at(x, y)[c] = byte;
            if (!is_seen) continue;
            texture.at(x, y)[c] = byte;
            if (!training) continue;
            average.at(x, y)[c] += texture.at(x, y)[c];
            if (ids[f].segment == "held") continue;
            const size_t i = (static_cast<size_t>(y) * size + x) * 3 + c;
            sums[i] += texture.at(x, y)[c];
            squares[i] += std::pow(texture.at(x, y)[c], 2);
            seen[i] += 1;
          }
          if (training && is_seen) count.at(x, y)[0] += 1;
        }
      }
      WritePng(layout.Texture(ids[f], camera.name, size), texture);
      WritePng(layout.TextureMask(ids[f], camera.name, size), mask);
      if (picture == 0) continue;
      DrawOptions draw;
      draw.supersample = 1;
      const Rendering drawn =
          DrawMesh(tracked.vertices_in_head, topology, whole, camera, tracked.world_from_head, draw);
      writer.WriteImage(ids[f], camera.name, drawn.colour);
      writer.WriteHeadMask(ids[f], camera.name, drawn.coverage);
    }
    ImageU8 mean(size, size, 3);
    for (size_t i = 0; i < values; ++i) {
      const float n = count.values()[i / 3];
      mean.values()[i] = n > 0 ? static_cast<uint8_t>(std::lround(average.values()[i] / n)) : 0;
    }
    WritePng(layout.AverageTexture(ids[f], size), mean);
  }

  ImageU8 mean(size, size, 3);
  double about_mean = 0, total = 0;
  for (size_t i = 0; i < values; ++i) {
    if (seen[i] == 0) continue;
    mean.values()[i] = static_cast<uint8_t>(std::lround(sums[i] / seen[i]));
    about_mean += squares[i] - sums[i] * sums[i] / seen[i];
    total += seen[i];
  }
  Vertices vertex_mean = Vertices::Zero(topology.vertex_count, 3);
  for (int f = 0; f < frames; ++f) vertex_mean += meshes[f] / static_cast<float>(frames);
  double vertex_variance = 0;
  for (int f = 0; f < frames; ++f) vertex_variance += (meshes[f] - vertex_mean).squaredNorm();
  WritePng(layout.TextureMean(), mean);
  WriteFile(layout.TextureVariance(), fmt::format("{}\n", about_mean / total));
  WriteFloats(layout.VertexMean(), {vertex_mean.data(), static_cast<size_t>(vertex_mean.size())});
  ConditionTable gaze;
  gaze.columns = {"x", "y"};
  for (size_t f = 0; f < ids.size(); ++f) {
    const auto t = static_cast<float>(f);
    gaze.frames[ids[f]] = {std::sin(t), 3 * std::cos(2 * t)};
  }
  WriteFile(layout.Condition("gaze"), ConditionTableText(gaze));
  WriteFile(layout.VertexVariance(), fmt::format("{}\n", vertex_variance / (frames * vertex_mean.size())));
}

}  // namespace likeness
