#include "likeness/simulate/simulate.h"

#include <atomic>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/json.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/base/random.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/obj.h"
#include "likeness/simulate/live_link.h"
#include "likeness/simulate/open_head.h"
#include "likeness/simulate/performance.h"

namespace likeness {
namespace {

// All that the files depend on.
nlohmann::json DescribeOptions(const SimulateOptions& o, const OpenedHead& head) {
  nlohmann::json description = {
      {"head", o.head},
      {"head-recipe", head.recipe},
      {"performance", o.performance.empty() ? "built-in" : fmt::format("{:016x}", Hash(ReadFile(o.performance)))},
      {"frames", o.frames},
      {"cameras", o.rig.cameras},
      {"held-out-cameras", o.rig.held_out_cameras},
      {"width", o.rig.width},
      {"height", o.rig.height},
      {"distance-mm", o.rig.distance_mm},
      {"most-azimuth", o.rig.most_azimuth},
      {"lowest-elevation", o.rig.lowest_elevation},
      {"highest-elevation", o.rig.highest_elevation},
      {"shading", o.render.shading == Shading::kFull ? "full" : "albedo"},
      {"samples", o.render.samples},
      {"lights", o.lights},
      {"exposure", o.exposure},
      {"seed", o.seed},
  };
  return description;
}

// Throws Error when the folder holds a capture that was made with other options.
void CheckSameOptions(const std::filesystem::path& path, const nlohmann::json& now) {
  if (!std::filesystem::exists(path)) return;
  const nlohmann::json before = ParseJson(path, ReadFile(path, 1 << 20));
  if (!before.is_object()) throw FileError(path, "holds no options; remove the capture or name another folder");
  std::string differences;
  for (const auto& [key, value] : now.items()) {
    const auto found = before.find(key);
    if (found != before.end() && *found == value) continue;
    if (!differences.empty()) differences += ", ";
    differences += key == "head-recipe" || found == before.end()
                       ? key
                       : fmt::format("{} was {}, now {}", key, found->dump(), value.dump());
  }
  if (differences.empty()) return;
  throw Error("{}: the capture there was made with other options ({}); remove it or name another folder",
              path.parent_path().parent_path().string(), differences);
}

struct Shot {
  FrameId id;
  const PerformanceFrame* frame;
};

std::vector<Shot> ListShots(const Performance& performance) {
  std::vector<Shot> shots;
  for (const PerformanceSegment& segment : performance.segments) {
    for (const PerformanceFrame& frame : segment.frames) {
      shots.push_back({{segment.name, fmt::format("{:06}", frame.number)}, &frame});
    }
  }
  return shots;
}

Split MakeSplit(const Rig& rig, const Performance& performance) {
  Split split;
  split.held_out_cameras = rig.held_out;
  for (const Camera& camera : rig.cameras) {
    if (!split.IsHeldOutCamera(camera.name)) split.training_cameras.push_back(camera.name);
  }
  for (const PerformanceSegment& segment : performance.segments) {
    if (segment.held_out) split.held_out_segments.push_back(segment.name);
  }
  return split;
}

std::string DescribePerformance(const std::vector<Shot>& shots) {
  std::string text = "segment,frame,time_s,r00,r01,r02,tx,r10,r11,r12,ty,r20,r21,r22,tz";
  for (const std::string& name : ExpressionNames()) text += "," + name;
  text += "\n";
  for (const Shot& shot : shots) {
    text += fmt::format("{},{},{:.6f}", shot.id.segment, shot.id.frame, shot.frame->time_s);
    const RigidTransform pose = shot.frame->WorldFromHead();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) text += fmt::format(",{}", pose.rotation(row, column));
      text += fmt::format(",{}", pose.translation[row]);
    }
    for (const float weight : shot.frame->weights) text += fmt::format(",{}", weight);
    text += "\n";
  }
  return text;
}

std::string DescribeLights(const LightRig& rig) {
  std::string text = "x,y,z,irradiance\n";
  for (const Light& light : rig.lights) {
    text +=
        fmt::format("{},{},{},{}\n", light.direction.x(), light.direction.y(), light.direction.z(), light.irradiance);
  }
  return text;
}

bool HasTracked(const CaptureLayout& layout, const FrameId& id) {
  return std::filesystem::exists(layout.MeshBinary(id)) && std::filesystem::exists(layout.MeshObj(id)) &&
         std::filesystem::exists(layout.HeadPose(id));
}

std::vector<const Camera*> MissingCameras(const CaptureLayout& layout, const FrameId& id, const Rig& rig) {
  std::vector<const Camera*> missing;
  for (const Camera& camera : rig.cameras) {
    if (!std::filesystem::exists(layout.Image(id, camera.name)) ||
        !std::filesystem::exists(layout.HeadMask(id, camera.name))) {
      missing.push_back(&camera);
    }
  }
  return missing;
}

}  // namespace

void SimulateOptions::Check() const {
  if (out.empty()) throw Error("a simulated capture needs a folder to go to");
  if (frames < 2) throw Error("a capture takes 2 frames or more, not {}", frames);
  if (!(exposure > 0 && exposure < 100)) throw Error("the exposure lies between 0 and 100, not at {}", exposure);
  rig.Check();
  render.Check();
}

SimulateResult Simulate(const SimulateOptions& options) {
  options.Check();
  const CaptureWriter writer(options.out);
  const CaptureLayout& layout = writer.layout();
  const OpenedHead opened = OpenHead(options.head, options.head_data, options.shape_map);
  const Head& head = *opened.head;
  const nlohmann::json description = DescribeOptions(options, opened);
  const std::filesystem::path description_path = layout.Truth() / "options.json";
  CheckSameOptions(description_path, description);

  const Performance performance =
      options.performance.empty()
          ? BuiltInPerformance(options.frames, options.seed)
          : PerformanceFromRecording(ReadLiveLink(options.performance), options.frames, options.seed);
  const std::vector<Shot> shots = ListShots(performance);
  const PosedHead neutral = head.Pose(std::array<float, kExpressionCount>{});
  const Rig rig = MakeRig(options.rig, neutral.tracked);
  const LightRig lights = EvenLights(options.lights, options.exposure);

  WriteFile(description_path, description.dump(2) + "\n");
  WriteFile(layout.Truth() / "performance.csv", DescribePerformance(shots));
  WriteFile(layout.Truth() / "lights.csv", DescribeLights(lights));
  if (!opened.recipe.empty()) WriteFile(layout.Truth() / "head.toml", opened.recipe);
  WriteFileWith(layout.Truth() / "neutral.obj",
                [&](const std::filesystem::path& path) { WriteObj(path, neutral.tracked, head.tracked_topology()); });
  writer.WriteCalibration(rig.cameras);
  writer.WriteSplit(MakeSplit(rig, performance));
  std::vector<FrameId> ids;
  for (const Shot& shot : shots) ids.push_back(shot.id);
  writer.WriteFrameList(ids);

  SimulateResult result;
  result.cameras = static_cast<int>(rig.cameras.size());
  result.segments = static_cast<int>(performance.segments.size());
  result.frames = static_cast<int>(shots.size());
  const HeadRenderer renderer(head, lights, options.render);
  Progress progress("simulate " + options.head, static_cast<int64_t>(shots.size() * rig.cameras.size()), "images");
  for (const Shot& shot : shots) {
    const std::vector<const Camera*> missing = MissingCameras(layout, shot.id, rig);
    const int kept = result.cameras - static_cast<int>(missing.size());
    progress.Skip(kept);
    result.images_kept += kept;
    if (missing.empty() && HasTracked(layout, shot.id)) continue;
    const PosedHead posed = head.Pose(shot.frame->weights);
    const RigidTransform world_from_head = shot.frame->WorldFromHead();
    if (!missing.empty()) {
      const LitHead lit = renderer.Light(posed, world_from_head);
      ParallelFor(static_cast<int64_t>(missing.size()), [&](int64_t i) {
        const HeadPicture picture = renderer.Render(lit, *missing[i]);
        writer.WriteHeadMask(shot.id, missing[i]->name, picture.mask);
        writer.WriteImage(shot.id, missing[i]->name, picture.rgb);
        progress.Advance();
      });
      result.images_written += static_cast<int>(missing.size());
    }
    writer.WriteObj(shot.id, posed.tracked, head.tracked_topology());
    writer.WriteTracked(shot.id, {posed.tracked, world_from_head});
  }
  progress.Finish();
  return result;
}

}  // namespace likeness
