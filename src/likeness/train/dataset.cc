#include "likeness/train/dataset.h"

#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/base/random.h"

namespace likeness {

namespace {

Statistics StatisticsOf(const TextureStatistics& read) {
  Statistics statistics;
  statistics.texture_mean = read.mean;
  statistics.texture_deviation = static_cast<float>(std::sqrt(read.variance));
  statistics.vertex_mean =
      Eigen::Map<const Vertices>(read.vertex_mean.data(), static_cast<Eigen::Index>(read.vertex_mean.size() / 3), 3);
  statistics.vertex_deviation = static_cast<float>(std::sqrt(read.vertex_variance));
  return statistics;
}

template <typename T>
void Shuffle(std::vector<T>& values, Random& random) {
  for (size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random.Below(static_cast<int64_t>(i))]);
}

}  // namespace

Dataset::Dataset(const Capture& capture, const TextureSet& textures, size_t cache_bytes, TexelWeighting weighting,
                 const std::filesystem::path& cache_folder)
    : textures_(textures),
      frames_(capture.TrainingFrames()),
      training_cameras_(capture.TrainingCameras()),
      texel_weights_(capture.topology(), textures.size(), weighting),
      statistics_(StatisticsOf(textures.ReadStatistics())) {
  for (int f = 0; f < static_cast<int>(frames_.size()); ++f) {
    tracked_.push_back(capture.ReadTracked(frames_[f]));
    samples_of_frame_.emplace_back();
    for (int c = 0; c < cameras(); ++c) {
      const Camera& camera = training_cameras_[c];
      if (!textures.HasTexture(frames_[f], camera.name)) continue;
      samples_of_frame_[f].push_back(static_cast<int>(samples_.size()));
      samples_.push_back({f, camera.name, c, ViewVector(camera, tracked_[f].world_from_head).cast<float>()});
    }
  }
  if (samples_.empty()) {
    throw Error("{}: no textures to train on: {} training frames, {} training cameras, none unwrapped at {} x {}",
                capture.root().string(), frames_.size(), cameras(), size(), size());
  }
  cache_ = std::make_unique<TextureCache>(
      static_cast<int>(samples_.size() + frames_.size()), [this](int slot) { return LoadTexels(slot); }, cache_bytes,
      cache_folder);
}

PackedTexture Dataset::LoadTexels(int slot) const {
  if (slot >= static_cast<int>(samples_.size())) return {textures_.ReadAverage(frames_[slot - samples_.size()]), {}};
  const Sample& sample = samples_[slot];
  const ImageU8 texture = textures_.ReadTexture(frames_[sample.frame], sample.camera);
  return {texture, textures_.ReadMask(frames_[sample.frame], sample.camera, texture)};
}

Dataset::Texels Dataset::ReadTexels(int slot) const {
  Texels texels;
  cache_->Get(slot)->Unpack(size(), &texels.texture, &texels.seen);
  return texels;
}

Batch Dataset::ReadFrames(int begin, int end) const {
  const int64_t count = end - begin, side = size(), coordinates = statistics_.vertex_mean.size();
  const torch::Tensor average = torch::empty({count, side, side, 3}), vertices = torch::empty({count, coordinates});
  for (int64_t i = 0; i < count; ++i) {
    const int frame = begin + static_cast<int>(i);
    const Texels texels = ReadTexels(static_cast<int>(samples_.size()) + frame);
    StandardiseTexture(statistics_, texels.texture, {}, average.mutable_data_ptr<float>() + i * side * side * 3);
    StandardiseVertices(statistics_, tracked_[frame].vertices_in_head,
                        vertices.mutable_data_ptr<float>() + i * coordinates);
  }
  Batch batch;
  batch.average = average.permute({0, 3, 1, 2});
  batch.vertices = vertices;
  return batch;
}

Batch Dataset::Read(const std::vector<int>& samples, int views) const {
  const int64_t count = static_cast<int64_t>(samples.size()), side = size(), texels = side * side;
  LIKENESS_CHECK(count > 0 && count % views == 0);
  const torch::Tensor texture = torch::empty({count, side, side, 3}), seen = torch::empty({count, 1, side, side});
  const torch::Tensor view = torch::empty({count, 3}), camera = torch::empty({count}, torch::kInt64);
  std::vector<torch::Tensor> averages, vertices;
  for (int64_t i = 0; i < count; ++i) {
    const Sample& sample = samples_[samples[i]];
    if (i % views == 0) {
      const Batch frame = ReadFrames(sample.frame, sample.frame + 1);
      averages.push_back(frame.average.permute({0, 2, 3, 1}));
      vertices.push_back(frame.vertices);
    }
    LIKENESS_CHECK(sample.frame == samples_[samples[i - i % views]].frame);
    const Texels read = ReadTexels(samples[i]);
    StandardiseTexture(statistics_, read.texture, read.seen, texture.mutable_data_ptr<float>() + i * texels * 3);
    texel_weights_.Write(training_cameras_[sample.camera_index], tracked_[sample.frame].world_from_head,
                         tracked_[sample.frame].vertices_in_head, read.seen,
                         seen.mutable_data_ptr<float>() + i * texels);
    camera.mutable_data_ptr<int64_t>()[i] = sample.camera_index;
    std::copy_n(sample.view.data(), 3, view.mutable_data_ptr<float>() + 3 * i);
  }
  return {torch::cat(averages).permute({0, 3, 1, 2}),
          torch::cat(vertices),
          texture.permute({0, 3, 1, 2}),
          seen,
          view,
          camera};
}

SampleOrder::SampleOrder(std::vector<std::vector<int>> samples_of_frame, int views, uint64_t seed)
    : samples_of_frame_(std::move(samples_of_frame)), views_(views), seed_(seed) {
  for (const std::vector<int>& samples : samples_of_frame_) {
    groups_per_epoch_ += (static_cast<int64_t>(samples.size()) + views - 1) / views;
  }
  LIKENESS_CHECK(groups_per_epoch_ > 0);
}

std::vector<std::vector<int>> SampleOrder::Epoch(int64_t epoch) const {
  Random random(Hash({seed_, static_cast<uint64_t>(epoch)}));
  std::vector<std::vector<int>> groups;
  for (std::vector<int> samples : samples_of_frame_) {
    Shuffle(samples, random);
    for (size_t begin = 0; begin < samples.size(); begin += views_) {
      std::vector<int>& group = groups.emplace_back();
      for (int i = 0; i < views_; ++i) group.push_back(samples[(begin + i) % samples.size()]);
    }
  }
  Shuffle(groups, random);
  return groups;
}

std::vector<int> SampleOrder::Samples(int64_t iteration, int batch) const {
  const int64_t count = batch / views_;
  std::vector<int> samples;
  int64_t shuffled = -1;
  std::vector<std::vector<int>> groups;
  for (int64_t position = iteration * count; position < (iteration + 1) * count; ++position) {
    if (position / groups_per_epoch_ != shuffled) {
      shuffled = position / groups_per_epoch_;
      groups = Epoch(shuffled);
    }
    const std::vector<int>& group = groups[position % groups_per_epoch_];
    samples.insert(samples.end(), group.begin(), group.end());
  }
  return samples;
}

}  // namespace likeness
