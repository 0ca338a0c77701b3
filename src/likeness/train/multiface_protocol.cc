#include "likeness/train/multiface_protocol.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"

namespace likeness {
namespace {

// Values of 0 are unseen, channel by channel, as in the published loader.
double TextureError(const ImageU8& truth, const ImageF& ours) {
  double sum = 0;
  for (size_t i = 0; i < truth.values().size(); ++i) {
    const double difference = truth.values()[i] - static_cast<double>(ours.values()[i]);
    if (truth.values()[i] != 0) sum += difference * difference;
  }
  return sum / static_cast<double>(truth.values().size());
}

}  // namespace

MultifaceFigures EvaluateAsMultiface(const TextureSet& textures, const FrameEncoder& encode,
                                     const FrameDecoder& decoder) {
  const Capture& capture = textures.capture();
  const std::vector<FrameId> frames = capture.HeldOutFrames();
  if (frames.empty()) {
    throw Error("{}: the split holds out no segment; name some with --test-segments FILE", capture.root().string());
  }
  const std::vector<std::string>& cameras = capture.split().training_cameras;
  const double vertex_variance = textures.ReadStatistics().vertex_variance;
  // Sums a frame, added up in order: the result is the same for any number of threads.
  std::vector<MultifaceFigures> parts(frames.size());
  Progress progress("evaluate", static_cast<int64_t>(frames.size()), "frames");
  ParallelFor(static_cast<int64_t>(frames.size()), [&](int64_t f) {
    const FrameId& frame = frames[static_cast<size_t>(f)];
    MultifaceFigures& part = parts[static_cast<size_t>(f)];
    const TrackedFrame tracked = capture.ReadTracked(frame);
    EncodedFrame encoded;
    for (const std::string& camera : cameras) {
      if (!textures.HasTexture(frame, camera)) continue;
      if (encoded.code.empty()) encoded = encode(frame, tracked);
      const Eigen::Vector3d view = ViewVector(capture.FindCamera(camera), tracked.world_from_head);
      const DecodedFrame decoded = decoder.Decode(encoded.code, view, encoded.conditions);
      const Vertices difference = decoded.vertices_in_head - tracked.vertices_in_head;
      part.texture_mse += TextureError(textures.ReadTexture(frame, camera), decoded.texture);
      part.vertex_mse += difference.cast<double>().array().square().mean() / vertex_variance;
      ++part.views;
    }
    progress.Advance();
  });
  MultifaceFigures figures;
  for (const MultifaceFigures& part : parts) {
    figures.views += part.views;
    figures.texture_mse += part.texture_mse;
    figures.vertex_mse += part.vertex_mse;
  }
  if (figures.views == 0) {
    throw Error("{}: no held-out frame has an unwrapped texture of {} texels", capture.root().string(),
                textures.size());
  }
  figures.texture_mse /= static_cast<double>(figures.views);
  figures.vertex_mse /= static_cast<double>(figures.views);
  return figures;
}

std::string ToText(const MultifaceFigures& figures) {
  return fmt::format(
      "Multiface protocol: known cameras, held-out segments, nothing fitted to them\n"
      "views {}, tex {:.3f} (0 ... 255 units, over all texels), vert {:.5f} (in variances)\n",
      figures.views, figures.texture_mse, figures.vertex_mse);
}

std::string ToJson(const MultifaceFigures& figures) {
  const nlohmann::ordered_json json = {
      {"protocol", "multiface"}, {"views", figures.views}, {"tex", figures.texture_mse}, {"vert", figures.vertex_mse}};
  return json.dump(2);
}

}  // namespace likeness
