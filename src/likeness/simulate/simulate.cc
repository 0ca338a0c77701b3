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
#include "likeness/capture/condition_file.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/obj.h"
#include "likeness/simulate/gaze_condition.h"
#include "likeness/simulate/live_link.h"
#include "likeness/simulate/performance.h"

namespace likeness {
namespace {

// All that the files depend on.
nlohmann::json DescribeOptions(const SimulateOptions& o, const OpenedHead& head, const std::string& rig_for) {
  const std::string performance = !o.performance.empty()      ? fmt::format("{:016x}", Hash(ReadFile(o.performance)))
                                  : o.script == Script::kFull ? "built-in, full"
                                                              : "built-in";
  const ImperfectionOptions& i = o.imperfections;
  nlohmann::json description = {
      {"head", o.head},
      {"head-recipe", head.recipe},
      {"performance", performance},
      {"frames", o.frames},
      {"cameras", o.rig.cameras},
      {"held-out-cameras", o.rig.held_out_cameras},
      {"width", o.rig.width},
      {"height", o.rig.height},
      {"lens-mm", o.rig.lens_mm},
      {"rig-for", rig_for},
      {"distance-mm", o.rig.distance_mm},
      {"most-azimuth", o.rig.most_azimuth},
      {"lowest-elevation", o.rig.lowest_elevation},
      {"highest-elevation", o.rig.highest_elevation},
      {"shading", o.render.shading == Shading::kFull ? "full" : "albedo"},
      {"samples", o.render.samples},
      {"lights", o.lights},
      {"exposure", o.exposure},
      {"seed", o.seed},
      {"tracking-noise-mm", i.tracking_noise_mm},
      {"tracking-smoothing", i.tracking_smoothing},
      {"calibration-error-px", i.calibration_error_px},
      {"lens-blur-px", i.lens_blur_px},
      {"exposure-flicker", i.exposure_flicker},
      {"sensor-noise", i.sensor_noise},
      {"colour-gain", i.colour_gain},
      {"colour-bias", i.colour_bias},
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

std::vector<Shot> ListShots(const SimulatedPerformance& performance) {
  std::vector<Shot> shots;
  for (const PerformanceSegment& segment : performance.segments) {
    for (const PerformanceFrame& frame : segment.frames) {
      shots.push_back({{segment.name, fmt::format("{:06}", frame.number)}, &frame});
    }
  }
  return shots;
}

Split MakeSplit(const Rig& rig, const SimulatedPerformance& performance) {
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

std::string DescribeGaze(const std::vector<Shot>& shots) {
  ConditionTable gaze;
  gaze.columns = kGazeColumns;
  for (const Shot& shot : shots) {
    const std::array<float, 6> directions = GazeDirections(shot.frame->weights);
    gaze.frames[shot.id].assign(directions.begin(), directions.end());
  }
  return ConditionTableText(gaze);
}

std::string DescribeLights(const LightRig& rig) {
  std::string text = "x,y,z,irradiance\n";
  for (const Light& light : rig.lights) {
    text +=
        fmt::format("{},{},{},{}\n", light.direction.x(), light.direction.y(), light.direction.z(), light.irradiance);
  }
  return text;
}

std::string DescribeImperfections(const Imperfections& imperfections, const Rig& rig, const std::vector<Shot>& shots) {
  nlohmann::ordered_json json = {{"cameras", nlohmann::ordered_json::object()},
                                 {"exposures", nlohmann::ordered_json::array()}};
  for (const Camera& camera : rig.cameras) {
    Eigen::Array3d gain, bias;
    imperfections.Colours(camera.name, &gain, &bias);
    json["cameras"][camera.name] = {{"gain", {gain[0], gain[1], gain[2]}}, {"bias", {bias[0], bias[1], bias[2]}}};
  }
  for (const Shot& shot : shots) {
    json["exposures"].push_back({shot.id.segment, shot.id.frame, imperfections.Exposure(shot.id)});
  }
  return json.dump() + "\n";
}

bool HasTracked(const CaptureLayout& layout, const FrameId& id) {
  return std::filesystem::exists(layout.MeshBinary(id)) && std::filesystem::exists(layout.MeshObj(id)) &&
         std::filesystem::exists(layout.HeadPose(id));
}

bool HasTrackedTruth(const CaptureLayout& truth, const FrameId& id) {
  return std::filesystem::exists(truth.MeshBinary(id)) && std::filesystem::exists(truth.HeadPose(id));
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

// Whether memory suffices for an image on every thread.
bool FitAtOnce(const RigOptions& rig) {
  constexpr int64_t kMostBytes = int64_t{1} << 30, kBytesPerPixel = 10;  // image and mask, and those as PNG
  return int64_t{rig.width} * rig.height * kBytesPerPixel * ThreadCount() <= kMostBytes;
}

SimulatedPerformance Perform(const SimulateOptions& options) {
  if (!options.performance.empty()) {
    return PerformanceFromRecording(ReadLiveLink(options.performance), options.frames, options.seed);
  }
  return options.script == Script::kFull ? FullPerformance(options.frames, options.seed)
                                         : BuiltInPerformance(options.frames, options.seed);
}

}  // namespace

void SimulateOptions::Check() const {
  if (out.empty()) throw Error("a simulated capture needs a folder to go to");
  if (frames < 2) throw Error("a capture takes 2 frames or more, not {}", frames);
  if (!(exposure > 0 && exposure < 100)) throw Error("the exposure lies between 0 and 100, not at {}", exposure);
  if (shards < 1 || shard < 1 || shard > shards) throw Error("there is no shard {} of {}", shard, shards);
  rig.Check();
  render.Check();
  imperfections.Check();
}

SimulateOptions SimulatePreset(const std::string& name) {
  SimulateOptions options;
  if (name == "demo") return options;
  if (name == "small") {
    options.frames = 12;
    options.rig.cameras = 6;
    options.rig.held_out_cameras = 2;
    options.rig.width = 256;
    options.rig.height = 384;
    options.lights = 60;
    return options;
  }
  if (name == "paper") {
    options.script = Script::kFull;
    options.frames = 3460;  // 20 for each segment
    options.rig.cameras = 40;
    options.rig.held_out_cameras = 8;
    options.rig.width = 5120;
    options.rig.height = 3840;
    options.rig.lens_mm = 50;
    options.rig.most_azimuth = 90;
    options.rig.lowest_elevation = -40;
    options.rig.highest_elevation = 60;
    return options;
  }
  throw Error("there is no preset '{}', expected demo, small or paper", name);
}

SimulateResult Simulate(const SimulateOptions& options) {
  options.Check();
  const OpenedHead opened = OpenHead(options.head, options.head_data, options.shape_map);
  const PosedHead neutral = opened.head->Pose(std::array<float, kExpressionCount>{});
  return SimulateHead(options, opened, MakeRig(options.rig, neutral.tracked), "");
}

SimulateResult SimulateHead(const SimulateOptions& options, const OpenedHead& opened, const Rig& rig,
                            const std::string& rig_for) {
  options.Check();
  const CaptureWriter writer(options.out);
  const CaptureLayout& layout = writer.layout();
  const CaptureWriter truth(layout.Truth());
  const Head& head = *opened.head;
  const nlohmann::json description = DescribeOptions(options, opened, rig_for);
  const std::filesystem::path description_path = layout.Truth() / "options.json";
  CheckSameOptions(description_path, description);

  const SimulatedPerformance performance = Perform(options);
  const std::vector<Shot> shots = ListShots(performance);
  const PosedHead neutral = head.Pose(std::array<float, kExpressionCount>{});
  const LightRig lights = EvenLights(options.lights, options.exposure);
  const ImperfectionOptions& flaws = options.imperfections;
  const Imperfections imperfections(flaws, options.seed, head.tracked_topology(), neutral.tracked);

  WriteFile(description_path, description.dump(2) + "\n");
  WriteFile(layout.Truth() / "performance.csv", DescribePerformance(shots));
  WriteFile(layout.Truth() / "lights.csv", DescribeLights(lights));
  if (!opened.recipe.empty()) WriteFile(layout.Truth() / "head.toml", opened.recipe);
  WriteFileWith(layout.Truth() / "neutral.obj",
                [&](const std::filesystem::path& path) { WriteObj(path, neutral.tracked, head.tracked_topology()); });
  if (flaws.OfImages()) {
    WriteFile(layout.Truth() / "imperfections.json", DescribeImperfections(imperfections, rig, shots));
  }
  std::vector<Camera> calibrated;
  for (const Camera& camera : rig.cameras) calibrated.push_back(imperfections.Calibrated(camera));
  writer.WriteCalibration(calibrated);
  if (flaws.calibration_error_px > 0) truth.WriteCalibration(rig.cameras);
  writer.WriteSplit(MakeSplit(rig, performance));
  std::vector<FrameId> ids;
  for (const Shot& shot : shots) ids.push_back(shot.id);
  writer.WriteFrameList(ids);
  WriteFile(layout.Condition("gaze"), DescribeGaze(shots));

  SimulateResult result;
  result.cameras = static_cast<int>(rig.cameras.size());
  result.segments = static_cast<int>(performance.segments.size());
  std::vector<Shot> mine;
  for (size_t i = static_cast<size_t>(options.shard) - 1; i < shots.size(); i += static_cast<size_t>(options.shards)) {
    mine.push_back(shots[i]);
  }
  result.frames = static_cast<int>(mine.size());
  const HeadRenderer renderer(head, lights, options.render);
  Progress progress("simulate " + options.head, static_cast<int64_t>(mine.size() * rig.cameras.size()), "images");
  for (const Shot& shot : mine) {
    const std::vector<const Camera*> missing = MissingCameras(layout, shot.id, rig);
    const int kept = result.cameras - static_cast<int>(missing.size());
    progress.Skip(kept);
    result.images_kept += kept;
    if (missing.empty() && HasTracked(layout, shot.id) &&
        (!flaws.OfMeshes() || HasTrackedTruth(truth.layout(), shot.id))) {
      continue;
    }
    const PosedHead posed = head.Pose(shot.frame->weights);
    const RigidTransform world_from_head = shot.frame->WorldFromHead();
    if (!missing.empty()) {
      const LitHead lit = renderer.Light(posed, world_from_head);
      const auto make = [&](int64_t i) {
        HeadPicture picture = renderer.Render(lit, *missing[static_cast<size_t>(i)]);
        const std::string& camera = missing[static_cast<size_t>(i)]->name;
        imperfections.Photograph(shot.id, camera, &picture.rgb);
        writer.WriteHeadMask(shot.id, camera, picture.mask);
        writer.WriteImage(shot.id, camera, picture.rgb);
        progress.Advance();
      };
      const auto count = static_cast<int64_t>(missing.size());
      if (FitAtOnce(options.rig)) {
        ParallelFor(count, make);
      } else {
        for (int64_t i = 0; i < count; ++i) make(i);
      }
      result.images_written += static_cast<int>(missing.size());
    }
    const Vertices tracked = imperfections.Tracked(posed.tracked, shot.frame->time_s);
    if (flaws.OfMeshes()) truth.WriteTracked(shot.id, {posed.tracked, world_from_head});
    writer.WriteObj(shot.id, tracked, head.tracked_topology());
    writer.WriteTracked(shot.id, {tracked, world_from_head});
  }
  progress.Finish();
  return result;
}

}  // namespace likeness
