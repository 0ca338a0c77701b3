#include "likeness/train/dataset.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/base/random.h"
#include "likeness/capture/condition_file.h"

namespace likeness {

namespace {

template <typename T>
void Shuffle(std::vector<T>& values, Random& random) {
  for (size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random.Below(static_cast<int64_t>(i))]);
}

}  // namespace

Dataset::Dataset(std::vector<const TextureSet*> people, const std::vector<std::string>& conditions, size_t cache_bytes,
                 TexelWeighting weighting, const std::filesystem::path& cache_folder)
    : people_(std::move(people)),
      texel_weights_(people_.at(0)->capture().topology(), people_.front()->size(), weighting) {
  for (int i = 0; i < this->people(); ++i) AddPerson(i);
  ReadStatistics();
  ReadConditions(conditions);
  cache_ = std::make_unique<TextureCache>(
      static_cast<int>(samples_.size() + frames_.size()), [this](int slot) { return LoadTexels(slot); }, cache_bytes,
      cache_folder);
}

void Dataset::AddPerson(int identity) {
  const TextureSet& textures = *people_[identity];
  const Capture& capture = textures.capture();
  LIKENESS_CHECK(textures.size() == size());
  const std::vector<Camera> cameras = capture.TrainingCameras();
  const std::vector<FrameId> frames = capture.TrainingFrames();
  const size_t before = samples_.size();
  for (const FrameId& frame : frames) {
    const TrackedFrame& tracked = tracked_.emplace_back(capture.ReadTracked(frame));
    const int f = static_cast<int>(frames_.size());
    frames_.push_back(frame);
    identities_.push_back(identity);
    samples_of_frame_.emplace_back();
    for (int c = 0; c < static_cast<int>(cameras.size()); ++c) {
      const Camera& camera = cameras[c];
      if (!textures.HasTexture(frame, camera.name)) continue;
      samples_of_frame_[f].push_back(static_cast<int>(samples_.size()));
      samples_.push_back(
          {f, camera.name, this->cameras() + c, ViewVector(camera, tracked.world_from_head).cast<float>()});
    }
  }
  training_cameras_.insert(training_cameras_.end(), cameras.begin(), cameras.end());
  if (samples_.size() == before) {
    throw Error("{}: no textures to train on: {} training frames, {} training cameras, none unwrapped at {} x {}",
                capture.root().string(), frames.size(), cameras.size(), size(), size());
  }
}

// Variances of all people are means of theirs, weighted by the number of textures and of frames.
void Dataset::ReadStatistics() {
  std::vector<double> textures(people_.size()), frames(people_.size());
  for (const Sample& sample : samples_) ++textures[identities_[sample.frame]];
  for (const int identity : identities_) ++frames[identity];
  double texture_variance = 0, vertex_variance = 0;
  for (size_t i = 0; i < people_.size(); ++i) {
    const TextureStatistics read = people_[i]->ReadStatistics();
    texture_variance += read.variance * textures[i] / static_cast<double>(samples_.size());
    vertex_variance += read.vertex_variance * frames[i] / static_cast<double>(frames_.size());
    Statistics& statistics = statistics_.emplace_back();
    statistics.texture_mean = read.mean;
    statistics.vertex_mean =
        Eigen::Map<const Vertices>(read.vertex_mean.data(), static_cast<Eigen::Index>(read.vertex_mean.size() / 3), 3);
  }
  for (Statistics& statistics : statistics_) {
    statistics.texture_deviation = static_cast<float>(std::sqrt(texture_variance));
    statistics.vertex_deviation = static_cast<float>(std::sqrt(vertex_variance));
  }
}

void Dataset::ReadConditions(const std::vector<std::string>& names) {
  condition_values_.resize(frames_.size());
  for (const std::string& name : names) {
    std::vector<ConditionFile> files;
    for (const TextureSet* person : people_) files.emplace_back(person->capture().root(), name);
    for (const ConditionFile& file : files) {
      if (file.size() == files.front().size()) continue;
      throw FileError(file.path(), fmt::format("has {} values a frame; {} has {}", file.size(),
                                               files.front().path().string(), files.front().size()));
    }
    const auto size = static_cast<size_t>(files.front().size()), count = frames_.size();
    conditions_.push_back({name, files.front().size()});
    std::vector<double> sum(size);
    double squares = 0;
    for (size_t f = 0; f < count; ++f) {
      const std::vector<float>& values = files[identities_[f]].Of(frames_[f]);
      for (size_t i = 0; i < size; ++i) sum[i] += values[i];
      condition_values_[f].insert(condition_values_[f].end(), values.begin(), values.end());
    }
    for (size_t f = 0; f < count; ++f) {
      for (size_t i = 0; i < size; ++i) {
        const double mean = sum[i] / static_cast<double>(count);
        squares += std::pow(condition_values_[f][condition_mean_.size() + i] - mean, 2);
      }
    }
    // A condition that never changes says nothing, whatever it is divided by.
    const double variance = squares / static_cast<double>(count * size);
    const float deviation = variance > 1e-20 ? static_cast<float>(std::sqrt(variance)) : 1;
    for (size_t i = 0; i < size; ++i) {
      condition_mean_.push_back(static_cast<float>(sum[i] / static_cast<double>(count)));
      condition_deviation_.push_back(deviation);
    }
  }
}

PackedTexture Dataset::LoadTexels(int slot) const {
  if (slot >= static_cast<int>(samples_.size())) {
    const size_t frame = slot - samples_.size();
    return {people_[identities_[frame]]->ReadAverage(frames_[frame]), {}};
  }
  const Sample& sample = samples_[slot];
  const TextureSet& textures = *people_[identities_[sample.frame]];
  const ImageU8 texture = textures.ReadTexture(frames_[sample.frame], sample.camera);
  return {texture, textures.ReadMask(frames_[sample.frame], sample.camera, texture)};
}

Dataset::Fetched Dataset::Fetch(const std::vector<int>& samples, int views) const {
  LIKENESS_CHECK(!samples.empty() && samples.size() % views == 0);
  Fetched fetched;
  for (size_t i = 0; i < samples.size(); ++i) {
    const int frame = samples_[samples[i]].frame;
    if (i % views == 0) fetched.frames.push_back(frame);
    LIKENESS_CHECK(frame == fetched.frames.back());
    fetched.samples.push_back(samples[i]);
    fetched.textures.push_back(cache_->Get(samples[i]));
  }
  FetchAverages(&fetched);
  return fetched;
}

void Dataset::FetchAverages(Fetched* fetched) const {
  for (const int frame : fetched->frames) {
    fetched->averages.push_back(cache_->Get(static_cast<int>(samples_.size()) + frame));
  }
}

Batch Dataset::Standardise(const Fetched& fetched) const {
  const auto frames = static_cast<int64_t>(fetched.frames.size()), count = static_cast<int64_t>(fetched.samples.size());
  const int64_t side = size(), texels = side * side, coordinates = statistics_.front().vertex_mean.size();
  const auto values = static_cast<int64_t>(condition_mean_.size());
  const torch::Tensor average = torch::empty({frames, side, side, 3}), vertices = torch::empty({frames, coordinates});
  const torch::Tensor identity = torch::empty({frames}, torch::kInt64), named = torch::empty({frames, values});
  const torch::Tensor texture = torch::empty({count, side, side, 3}), seen = torch::empty({count, 1, side, side});
  const torch::Tensor view = torch::empty({count, 3}), camera = torch::empty({count}, torch::kInt64);
  const auto write_frame = [&](int64_t i) {
    const int frame = fetched.frames[i];
    ImageU8 read, mask;
    fetched.averages[i]->Unpack(size(), &read, &mask);
    const Statistics& own = statistics_[identities_[frame]];
    StandardiseTexture(own, read, mask, average.mutable_data_ptr<float>() + i * texels * 3);
    StandardiseVertices(own, tracked_[frame].vertices_in_head, vertices.mutable_data_ptr<float>() + i * coordinates);
    identity.mutable_data_ptr<int64_t>()[i] = identities_[frame];
    for (int64_t v = 0; v < values; ++v) {
      named.mutable_data_ptr<float>()[i * values + v] =
          (condition_values_[frame][v] - condition_mean_[v]) / condition_deviation_[v];
    }
  };
  const auto write_sample = [&](int64_t i) {
    const Sample& sample = samples_[fetched.samples[i]];
    ImageU8 read, mask;
    fetched.textures[i]->Unpack(size(), &read, &mask);
    StandardiseTexture(statistics_[identities_[sample.frame]], read, mask,
                       texture.mutable_data_ptr<float>() + i * texels * 3);
    texel_weights_.Write(training_cameras_[sample.camera_index], tracked_[sample.frame].world_from_head,
                         tracked_[sample.frame].vertices_in_head, mask, seen.mutable_data_ptr<float>() + i * texels);
    camera.mutable_data_ptr<int64_t>()[i] = sample.camera_index;
    std::copy_n(sample.view.data(), 3, view.mutable_data_ptr<float>() + 3 * i);
  };
  at::parallel_for(0, frames + count, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) i < frames ? write_frame(i) : write_sample(i - frames);
  });
  return {average.permute({0, 3, 1, 2}), vertices, texture.permute({0, 3, 1, 2}), seen, view, camera, identity, named};
}

Batch Dataset::ReadFrames(int begin, int end) const {
  Fetched fetched;
  for (int frame = begin; frame < end; ++frame) fetched.frames.push_back(frame);
  FetchAverages(&fetched);
  return Standardise(fetched);
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
