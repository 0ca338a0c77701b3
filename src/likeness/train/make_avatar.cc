#include "likeness/train/make_avatar.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "likeness/train/sample_order.h"

namespace likeness {
namespace {

// Codes of all frames, by the network as it is.
std::vector<FrameCode> EncodeFrames(const Network& network, const Dataset& dataset, int batch, torch::Device device) {
  const torch::NoGradGuard no_grad;
  std::vector<FrameCode> codes;
  const int count = static_cast<int>(dataset.frames().size());
  for (int begin = 0; begin < count; begin += batch) {
    const Batch frames = dataset.ReadFrames(begin, std::min(count, begin + batch));
    const torch::Tensor condition = network.Condition(frames.identity.to(device), frames.named.to(device));
    const torch::Tensor mu =
        network.Encode(frames.average.to(device), frames.vertices.to(device), condition).mu.cpu().contiguous();
    const float* values = mu.const_data_ptr<float>();
    for (int64_t i = 0; i < mu.size(0); ++i, values += mu.size(1)) {
      const int f = begin + static_cast<int>(i);
      const FrameId& frame = dataset.frames()[f];
      codes.push_back(
          {frame.segment, frame.frame, {values, values + mu.size(1)}, dataset.IdentityOf(f), dataset.ConditionsOf(f)});
    }
  }
  return codes;
}

}  // namespace

void RefreshStatistics(const Network& network, const Dataset& dataset, const TrainOptions& options,
                       torch::Device device) {
  if (network.statistics().empty()) return;
  constexpr int kBatches = 50;  // a running mean of momentum 0.1 has forgotten all but 0.5% of what was before
  const SampleOrder order(dataset.samples_of_frame(), options.views, options.seed);
  for (int i = 0; i < kBatches; ++i) {
    const Batch batch = dataset.Read(order.Samples(i, options.batch), options.views).To(device);
    const torch::Tensor condition = network.Condition(batch.identity, batch.named);
    const torch::Tensor mu = network.Encode(batch.average, batch.vertices, condition).mu;
    network.Decode(mu.repeat_interleave(options.views, 0), batch.view,
                   condition.defined() ? condition.repeat_interleave(options.views, 0) : condition);
  }
}

Avatar MakeAvatar(const Network& network, const Dataset& dataset, const People& people, const TrainOptions& options,
                  const RunState& run, torch::Device device) {
  Avatar avatar;
  avatar.architecture = network.architecture();
  avatar.topology = people.topology();
  avatar.identities.clear();
  for (int i = 0; i < dataset.people(); ++i) {
    const Statistics& own = dataset.statistics(i);
    avatar.identities.push_back({people.names()[i], own.texture_mean, own.vertex_mean});
  }
  const Statistics& statistics = dataset.statistics();
  avatar.texture_variance = std::pow(static_cast<double>(statistics.texture_deviation), 2);
  avatar.vertex_variance = std::pow(static_cast<double>(statistics.vertex_deviation), 2);
  avatar.condition_mean = dataset.condition_mean();
  avatar.condition_deviation = dataset.condition_deviation();
  avatar.weights = network.Folded();
  avatar.codes = EncodeFrames(network, dataset, options.batch, device);
  avatar.training = {{"iterations", fmt::format("{}", run.iteration)},
                     {"samples", fmt::format("{}", run.batches * options.batch)},
                     {"elapsed_s", fmt::format("{:.1f}", run.elapsed_s)},
                     {"frames", fmt::format("{}", dataset.frames().size())},
                     {"textures", fmt::format("{}", dataset.samples().size())}};
  for (size_t i = 0; i < people.names().size(); ++i) {
    avatar.training[TrainingCamerasKey(avatar, static_cast<int>(i))] =
        fmt::format("{}", fmt::join(people.captures()[i]->split().training_cameras, " "));
  }
  for (const std::string& line : options.Fingerprint()) {
    const size_t equals = line.find(" = ");
    avatar.training["option." + line.substr(0, equals)] = line.substr(equals + 3);
  }
  return avatar;
}

}  // namespace likeness
