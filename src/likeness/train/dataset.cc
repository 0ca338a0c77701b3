#include "likeness/train/dataset.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/base/log.h"
#include "likeness/base/random.h"
#include "likeness/capture/condition_file.h"
#include "likeness/render/rasterizer.h"
#include "likeness/train/render/rasterise.h"

namespace likeness {
Batch Batch::To(torch::Device device) const {
  if (device.is_cpu()) return *this;
  const auto moved = [&](const torch::Tensor& tensor) { return tensor.defined() ? tensor.to(device) : tensor; };
  return {moved(average),  moved(vertices), moved(texture),
          moved(seen),     moved(view),     moved(camera),
          moved(identity), moved(named),    {moved(crops.colour), moved(crops.head), moved(crops.projection)}};
}

Dataset::Dataset(std::vector<const TextureSet*> people, DatasetOptions options)
    : people_(std::move(people)),
      options_(std::move(options)),
      texel_weights_(people_.at(0)->capture().topology(), people_.front()->size(), options_.weighting) {
  for (int i = 0; i < this->people(); ++i) AddPerson(i);
  if (options_.images) CheckImages();
  ReadStatistics();
  ReadConditions();
  const size_t slots = (options_.images ? 2 : 1) * samples_.size() + frames_.size();
  cache_ = std::make_unique<ImageCache>(
      static_cast<int>(slots), [this](int slot) { return Load(slot); }, options_.cache_bytes, options_.cache_folder);
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

// Finds the crops' size, and says how pixels of the head are told from others.
void Dataset::CheckImages() {
  bool images = false, masks = true;
  for (const Sample& sample : samples_) {
    const Camera& camera = training_cameras_[sample.camera_index];
    const FrameId& frame = frames_[sample.frame];
    if (!CaptureOf(sample).HasCameraImage(frame, camera)) continue;
    images = true;
    masks = masks && CaptureOf(sample).HasHeadMask(frame, camera);
    crop_width_ = std::max(crop_width_, camera.width);
    crop_height_ = std::max(crop_height_, camera.height);
  }
  if (!images) {
    throw Error("{}: has no images of the cameras and frames to train on; the image loss needs them (--loss.image 0)",
                people_.front()->capture().root().string());
  }
  if (options_.crop > 0) crop_width_ = crop_height_ = options_.crop;
  if (masks) return;
  LogInfo(
      "images without a head mask count where the tracked mesh is, without what has the background's colour where the "
      "image's borders share one");
}

// Variances of all people are means of theirs, weighted by the number of textures and of frames.
void Dataset::ReadStatistics() {
  if (options_.like != nullptr) {
    for (int i = 0; i < people(); ++i) statistics_.push_back(StatisticsOf(*options_.like, i));
    return;
  }
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

void Dataset::ReadConditions() {
  condition_values_.resize(frames_.size());
  for (const std::string& name : options_.conditions) {
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
  if (options_.like == nullptr) return;
  condition_mean_ = options_.like->condition_mean;
  condition_deviation_ = options_.like->condition_deviation;
}

PackedImage Dataset::Load(int slot) const {
  const auto samples = static_cast<int>(samples_.size()), frames = static_cast<int>(frames_.size());
  if (slot >= samples + frames) return LoadImage(samples_[slot - samples - frames]);
  if (slot >= samples) {
    const size_t frame = slot - samples;
    return {people_[identities_[frame]]->ReadAverage(frames_[frame]), {}};
  }
  const Sample& sample = samples_[slot];
  const TextureSet& textures = *people_[identities_[sample.frame]];
  const ImageU8 texture = textures.ReadTexture(frames_[sample.frame], sample.camera);
  return {texture, textures.ReadMask(frames_[sample.frame], sample.camera, texture)};
}

PackedImage Dataset::LoadImage(const Sample& sample) const {
  const HeadImage image = ReadHeadImage(CaptureOf(sample), frames_[sample.frame],
                                        training_cameras_[sample.camera_index], tracked_[sample.frame]);
  return {image.colour, image.head};
}

Dataset::Fetched Dataset::Fetch(const std::vector<int>& samples, int views, uint64_t crop_seed) const {
  LIKENESS_CHECK(!samples.empty() && samples.size() % views == 0);
  Fetched fetched;
  for (size_t i = 0; i < samples.size(); ++i) {
    const int frame = samples_[samples[i]].frame;
    if (i % views == 0) fetched.frames.push_back(frame);
    LIKENESS_CHECK(frame == fetched.frames.back());
    fetched.samples.push_back(samples[i]);
    fetched.textures.push_back(cache_->Get(samples[i]));
    if (options_.images) fetched.crops.push_back(FetchCrop(samples[i], Hash({crop_seed, i})));
  }
  FetchAverages(&fetched);
  return fetched;
}

// Where a camera has no image of the frame no pixel counts.
ImageCrop Dataset::FetchCrop(int sample, uint64_t seed) const {
  const Camera& camera = training_cameras_[samples_[sample].camera_index];
  if (!CaptureOf(samples_[sample]).HasCameraImage(frames_[samples_[sample].frame], camera)) {
    return {0, 0, {ImageU8(crop_width_, crop_height_, 3), ImageU8(crop_width_, crop_height_, 1)}};
  }
  HeadImage image;
  cache_->Get(static_cast<int>(samples_.size() + frames_.size()) + sample)
      ->Unpack(camera.width, camera.height, &image.colour, &image.head);
  return CropAtRandom(image, crop_width_, crop_height_, seed);
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
    fetched.averages[i]->Unpack(size(), size(), &read, &mask);
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
    fetched.textures[i]->Unpack(size(), size(), &read, &mask);
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
  return {average.permute({0, 3, 1, 2}), vertices, texture.permute({0, 3, 1, 2}), seen, view, camera, identity, named,
          StandardiseCrops(fetched)};
}

CropBatch Dataset::StandardiseCrops(const Fetched& fetched) const {
  if (fetched.crops.empty()) return {};
  const auto count = static_cast<int64_t>(fetched.crops.size());
  const int64_t height = crop_height_, width = crop_width_, pixels = height * width;
  const torch::Tensor colour = torch::empty({count, height, width, 3}), head = torch::empty({count, 1, height, width});
  std::vector<PixelFromMesh> projections(fetched.crops.size());
  const float scale = 1 / statistics_.front().texture_deviation;
  at::parallel_for(0, count, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const ImageCrop& crop = fetched.crops[i];
      const Sample& sample = samples_[fetched.samples[i]];
      projections[i] = ProjectionOf(training_cameras_[sample.camera_index], tracked_[sample.frame].world_from_head,
                                    crop.x0, crop.y0);
      float* const colours = colour.mutable_data_ptr<float>() + i * pixels * 3;
      float* const counts = head.mutable_data_ptr<float>() + i * pixels;
      for (int64_t k = 0; k < 3 * pixels; ++k) colours[k] = scale * crop.pixels.colour.values()[k];
      for (int64_t k = 0; k < pixels; ++k) counts[k] = crop.pixels.head.values()[k] != 0 ? 1 : 0;
    }
  });
  return {colour.permute({0, 3, 1, 2}), head, Projections(projections)};
}

Batch Dataset::ReadFrames(int begin, int end) const {
  Fetched fetched;
  for (int frame = begin; frame < end; ++frame) fetched.frames.push_back(frame);
  FetchAverages(&fetched);
  return Standardise(fetched);
}

}  // namespace likeness
