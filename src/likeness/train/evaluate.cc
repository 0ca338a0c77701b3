#include "likeness/train/evaluate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/geometry/mesh_distance.h"
#include "likeness/image/resize.h"
#include "likeness/render/rasterizer.h"
#include "likeness/train/evaluation_tasks.h"

namespace likeness {
namespace {

// 255 where at least half of a pixel counts.
void Binarise(ImageU8* mask) {
  for (uint8_t& value : mask->values()) value = value >= 128 ? 255 : 0;
}

class Evaluator {
 public:
  Evaluator(const Capture& capture, const FrameDecoder& decoder, const EvaluationOptions& options,
            const TextureSet* textures)
      : capture_(capture),
        decoder_(decoder),
        textures_(textures),
        used_vertices_(VerticesInTriangles(capture.topology())) {
    draw_options_.supersample = options.supersample;
  }

  ImageMeasurement Measure(const EvaluationTask& task, const TrackedFrame& tracked, const EncodedFrame& encoded) const {
    const Camera& camera = *task.camera;
    const MeshTopology& topology = capture_.topology();
    const DecodedFrame decoded =
        decoder_.Decode(encoded.code, ViewVector(camera, tracked.world_from_head), encoded.conditions);
    if (decoded.vertices_in_head.rows() != topology.vertex_count) {
      throw Error("the avatar has {} vertices, but the capture {} has {}", decoded.vertices_in_head.rows(),
                  capture_.root().string(), topology.vertex_count);
    }
    const Rendering ours = Draw(decoded.vertices_in_head, decoded.texture, camera, tracked);
    const ImageU8 truth = capture_.ReadCameraImage(*task.frame, camera);
    ImageMeasurement m;
    std::optional<ImageU8> mask = capture_.ReadHeadMask(*task.frame, camera);
    m.unmasked = !mask.has_value();
    // The tracked mesh, not the avatar's: the pixels that count must not depend on what is judged.
    if (!mask) mask = Draw(tracked.vertices_in_head, decoded.texture, camera, tracked).coverage;
    Binarise(&*mask);
    // Where the camera shows nothing there is nothing to compare with.
    if (const std::optional<ImageU8> valid = capture_.ReadValidMask(camera)) {
      for (size_t i = 0; i < mask->values().size(); ++i) mask->values()[i] &= valid->values()[i];
    }
    m.error = MaskedSquaredError(truth, ours.colour, *mask);
    m.ssim = MaskedSsim(truth, ours.colour, *mask);
    if (textures_ != nullptr && textures_->HasTexture(*task.frame, camera.name)) {
      const ImageU8 unwrapped = textures_->ReadTexture(*task.frame, camera.name);
      m.texture = MaskedSquaredError(unwrapped, ToU8(decoded.texture),
                                     textures_->ReadMask(*task.frame, camera.name, unwrapped));
    }
    m.vertex_mm = MeanDistance(decoded.vertices_in_head, tracked.vertices_in_head, used_vertices_);
    ImageU8 covered = *mask;
    for (size_t i = 0; i < mask->values().size(); ++i) {
      if (mask->values()[i] == 0) continue;
      ++m.head_pixels;
      if (ours.coverage.values()[i] >= 128) continue;
      ++m.uncovered_pixels;
      covered.values()[i] = 0;
    }
    m.covered = MaskedSquaredError(truth, ours.colour, covered);
    if (task.keep_picture) {
      m.picture = EvaluatedPicture{task.group, *task.frame,           camera.name,    truth, ours.colour,
                                   *mask,      ToU8(decoded.texture), m.error.Mean(), m.ssim};
    }
    return m;
  }

 private:
  Rendering Draw(const Vertices& vertices, const ImageF& texture, const Camera& camera,
                 const TrackedFrame& tracked) const {
    return DrawMesh(vertices, capture_.topology(), texture, camera, tracked.world_from_head, draw_options_);
  }

  const Capture& capture_;
  const FrameDecoder& decoder_;
  const TextureSet* textures_;
  const std::vector<int> used_vertices_;
  DrawOptions draw_options_;
};

nlohmann::ordered_json JsonOf(const GroupResult& group) {
  nlohmann::ordered_json json;
  for (const char* key : {"mse", "mse_covered", "psnr_db", "ssim", "texture_mse", "vertex_mm"}) json[key] = nullptr;
  if (group.images > 0) {
    json["mse"] = group.error.Mean();
    if (group.covered.count > 0) json["mse_covered"] = group.covered.Mean();
    if (group.error.sum > 0) json["psnr_db"] = PsnrDb(group.error.Mean());
    json["ssim"] = group.ssim;
    if (group.texture.count > 0) json["texture_mse"] = group.texture.Mean();
    json["vertex_mm"] = group.vertex_mm;
  }
  json["images"] = group.images;
  json["uncovered"] = group.uncovered;
  json["images_unmasked"] = group.images_unmasked;
  return json;
}

}  // namespace

std::string ToString(EvaluationGroup group) {
  switch (group) {
    case EvaluationGroup::kTraining:
      return "training";
    case EvaluationGroup::kHeldOutCameras:
      return "held_out_cameras";
    case EvaluationGroup::kHeldOutSegments:
      return "held_out_segments";
    case EvaluationGroup::kHeldOutBoth:
      return "held_out_both";
  }
  return "";
}

void EvaluationOptions::Check() const {
  if (max_images < 0) throw Error("max-images must be 0 (all) or more, not {}", max_images);
  if (pictures < 0 || pictures > 1000) throw Error("a group keeps 0 ... 1000 pictures, not {}", pictures);
  DrawOptions render;
  render.supersample = supersample;
  render.Check();
}

void CheckHeldOut(const Avatar& avatar, const Capture& capture, int identity) {
  std::string trained_on;
  for (const FrameCode& code : avatar.codes) {
    if (code.identity != identity) continue;
    if (capture.split().IsHeldOutSegment(code.segment)) trained_on = "segment " + code.segment;
  }
  if (const auto cameras = avatar.training.find(TrainingCamerasKey(avatar, identity));
      cameras != avatar.training.end()) {
    std::istringstream names(cameras->second);
    for (std::string name; names >> name;) {
      if (capture.split().IsHeldOutCamera(name)) trained_on = "camera " + name;
    }
  }
  if (trained_on.empty()) return;
  throw Error(
      "the avatar was trained on {}, which the split of {} holds out; evaluate with the split of its training "
      "(--split)",
      trained_on, capture.root().string());
}

void MeasureTasks(const Capture& capture, const FrameEncoder& encode, const FrameDecoder& decoder,
                  const EvaluationOptions& options, const TextureSet* textures,
                  const std::vector<EvaluationTask>& tasks, const std::vector<std::vector<size_t>>& frames,
                  const std::function<bool(size_t, ImageMeasurement)>& done) {
  const Evaluator evaluator(capture, decoder, options, textures);
  std::atomic<bool> stop = false;
  ParallelFor(static_cast<int64_t>(frames.size()), [&](int64_t f) {
    if (stop) return;
    const FrameId& frame = *tasks[frames[f].front()].frame;
    const TrackedFrame tracked = capture.ReadTracked(frame);
    const EncodedFrame encoded = encode(frame, tracked);
    for (const size_t i : frames[f]) {
      if (!stop && !done(i, evaluator.Measure(tasks[i], tracked, encoded))) stop = true;
    }
  });
}

EvaluationResult Summarise(const std::vector<EvaluationTask>& tasks, std::vector<ImageMeasurement>* measurements) {
  EvaluationResult result;
  std::array<int64_t, 4> head_pixels = {}, uncovered_pixels = {};
  for (size_t i = 0; i < tasks.size(); ++i) {
    const auto g = static_cast<size_t>(tasks[i].group);
    GroupResult& group = result.groups[g];
    ++group.images;
    group.error += (*measurements)[i].error;
    group.covered += (*measurements)[i].covered;
    group.texture += (*measurements)[i].texture;
    group.ssim += (*measurements)[i].ssim;
    group.vertex_mm += (*measurements)[i].vertex_mm;
    group.images_unmasked += (*measurements)[i].unmasked;
    head_pixels[g] += (*measurements)[i].head_pixels;
    uncovered_pixels[g] += (*measurements)[i].uncovered_pixels;
    if ((*measurements)[i].picture) result.pictures.push_back(std::move(*(*measurements)[i].picture));
  }
  for (size_t g = 0; g < result.groups.size(); ++g) {
    GroupResult& group = result.groups[g];
    group.group = kEvaluationGroups[g];
    if (group.images > 0) group.ssim /= group.images, group.vertex_mm /= group.images;
    if (head_pixels[g] > 0) {
      group.uncovered = static_cast<double>(uncovered_pixels[g]) / static_cast<double>(head_pixels[g]);
    }
  }
  return result;
}

EvaluationResult Evaluate(const Capture& capture, const FrameEncoder& encode, const FrameDecoder& decoder,
                          const EvaluationOptions& options, const TextureSet* textures) {
  options.Check();
  const std::vector<EvaluationTask> tasks = ChooseTasks(capture, options);
  std::vector<ImageMeasurement> measurements(tasks.size());
  Progress progress("evaluate", static_cast<int64_t>(tasks.size()), "images");
  MeasureTasks(capture, encode, decoder, options, textures, tasks, ByFrame(tasks),
               [&](size_t i, ImageMeasurement measurement) {
                 measurements[i] = std::move(measurement);
                 progress.Advance();
                 return true;
               });
  progress.Finish();
  return Summarise(tasks, &measurements);
}

std::string ToText(const EvaluationResult& result) {
  std::string text = fmt::format("{:<18} {:>7} {:>9} {:>9} {:>9} {:>7} {:>9} {:>10} {:>10}\n", "", "images", "MSE",
                                 "covered", "PSNR", "SSIM", "texture", "vertices", "uncovered");
  int unmasked = 0;
  for (const GroupResult& group : result.groups) {
    unmasked += group.images_unmasked;
    if (group.images == 0) {
      text += fmt::format("{:<18} {:>7}\n", ToString(group.group), 0);
      continue;
    }
    text += fmt::format("{:<18} {:>7} {:>9.2f} {:>9} {:>6.2f} dB {:>7.4f} {:>9} {:>7.3f} mm {:>8.2f} %\n",
                        ToString(group.group), group.images, group.error.Mean(),
                        group.covered.count > 0 ? fmt::format("{:.2f}", group.covered.Mean()) : "-",
                        PsnrDb(group.error.Mean()), group.ssim,
                        group.texture.count > 0 ? fmt::format("{:.2f}", group.texture.Mean()) : "-", group.vertex_mm,
                        100 * group.uncovered);
  }
  text +=
      "\nMSE, PSNR (of the group's MSE) and SSIM over head pixels; texture: MSE over seen texels; 0 ... 255 units; "
      "uncovered head pixels count as black; covered: MSE without them\n";
  if (unmasked > 0) {
    text += fmt::format("{} images have no head mask: the tracked mesh's outline stood in for it\n", unmasked);
  }
  return text;
}

std::string ToJson(const EvaluationResult& result) {
  nlohmann::ordered_json json;
  for (const GroupResult& group : result.groups) json[ToString(group.group)] = JsonOf(group);
  return json.dump(2);
}

std::string ToCsv(const EvaluationResult& result) {
  std::vector<std::string> header = {"group"};
  const nlohmann::ordered_json first = JsonOf(result.groups[0]);
  for (const auto& [key, value] : first.items()) header.push_back(key);
  std::string csv = fmt::format("{}\n", fmt::join(header, ","));
  for (const GroupResult& group : result.groups) {
    std::vector<std::string> row = {ToString(group.group)};
    const nlohmann::ordered_json figures = JsonOf(group);
    for (const auto& value : figures) row.push_back(value.is_null() ? "" : value.dump());
    csv += fmt::format("{}\n", fmt::join(row, ","));
  }
  return csv;
}

}  // namespace likeness
