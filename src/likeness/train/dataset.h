// What training reads of unwrapped captures, one for each person: the training cameras' textures of the training
// frames, with meshes, averages, named conditions and, for the image loss, the cameras' pictures, kept packed where
// they fit.

#pragma once

#include <torch/types.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/image_cache.h"
#include "likeness/train/image_crop.h"
#include "likeness/train/standardise.h"
#include "likeness/train/texel_weights.h"

namespace likeness {

// Crops of the camera images of N textures, stored as these are.
struct CropBatch {
  torch::Tensor colour;      // [N, 3, H, W], 0 ... 255 divided by the textures' deviation
  torch::Tensor head;        // [N, 1, H, W], 1 where a pixel counts, else 0
  torch::Tensor projection;  // [N, 3, 4] f64, from head space, mm, to homogeneous pixel coordinates of the crop
};

// Some textures with what the network needs to predict them; standardised, float32, on the CPU. F frames, N textures,
// N a multiple of F: texture n belongs to frame n / (N / F). Textures are stored row by row with channels interleaved
// ("channels last") and seen as [., 3, S, S].
struct Batch {
  torch::Tensor average;        // [F, 3, S, S]; 0 where no camera sees a texel
  torch::Tensor vertices;       // [F, 3 V]
  torch::Tensor texture;        // [N, 3, S, S]; 0 where not seen
  torch::Tensor seen;           // [N, 1, S, S]; the loss's weight w, 0 where not seen
  torch::Tensor view;           // [N, 3]
  torch::Tensor camera = {};    // [N] int64, index among the training cameras of all people
  torch::Tensor identity = {};  // [F] int64, index among the people
  torch::Tensor named = {};     // [F, values] named conditions, standardised; no values where there are none
  CropBatch crops = {};         // undefined where the data set has no images

  Batch To(torch::Device device) const;
};

struct DatasetOptions {
  std::vector<std::string> conditions = {};  // names of those that every capture has
  TexelWeighting weighting = TexelWeighting::kAll;
  bool images = false;                      // crops of the cameras' images, too
  int crop = 0;                             // their side, pixels; 0: whole images, as large as the largest
  size_t cache_bytes = 0;                   // of memory for textures and images
  std::filesystem::path cache_folder = {};  // for those that it does not hold; empty: they are read again
  // Standardise with the statistics of this avatar, which has as many people, and not with the captures' own. Borrowed.
  const Avatar* like = nullptr;
};

class Dataset {
 public:
  // One texture.
  struct Sample {
    int frame = 0;  // index into frames()
    std::string camera;
    int camera_index = 0;  // among the training cameras of all people
    Eigen::Vector3f view;  // head space
  };

  // Reads meshes, statistics and conditions now, textures and images when they are first needed. Throws Error when
  // nothing is left to train on, when a file is absent or wrong, or when a condition has another size for another
  // person.
  //   people  the textures of each person's capture, of one size; borrowed, at least one
  Dataset(std::vector<const TextureSet*> people, DatasetOptions options);
  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;

  int size() const { return people_.front()->size(); }
  int people() const { return static_cast<int>(people_.size()); }
  int cameras() const { return static_cast<int>(training_cameras_.size()); }  // for training, of all people
  const std::vector<FrameId>& frames() const { return frames_; }
  int IdentityOf(int frame) const { return identities_[frame]; }
  const std::vector<Sample>& samples() const { return samples_; }
  // Indices into samples(), for every frame.
  const std::vector<std::vector<int>>& samples_of_frame() const { return samples_of_frame_; }
  // The means are the person's own; the deviations are everybody's about their own means.
  const Statistics& statistics(int identity = 0) const { return statistics_[identity]; }
  const std::vector<Statistics>& AllStatistics() const { return statistics_; }  // of each person

  const std::vector<NamedCondition>& conditions() const { return conditions_; }
  // A frame's values of all conditions, as captured.
  const std::vector<float>& ConditionsOf(int frame) const { return condition_values_[frame]; }
  // [values]: of each value over the training frames, and of each condition about its values' means.
  const std::vector<float>& condition_mean() const { return condition_mean_; }
  const std::vector<float>& condition_deviation() const { return condition_deviation_; }

  const ImageCache& cache() const { return *cache_; }

  // What a batch is made of, as it lies in the cache.
  struct Fetched {
    std::vector<int> samples;
    std::vector<std::shared_ptr<const PackedImage>> textures;  // of the samples
    std::vector<int> frames;
    std::vector<std::shared_ptr<const PackedImage>> averages;  // of the frames
    std::vector<ImageCrop> crops;                              // of the samples, where there are images
  };
  // The slow part where files must be read and decoded. `samples` come in groups of `views` that share a frame. Crops
  // are a function of `crop_seed` and the sample's place. Safe from several threads.
  Fetched Fetch(const std::vector<int>& samples, int views, uint64_t crop_seed = 0) const;
  // The quick part, on all of LibTorch's threads.
  Batch Standardise(const Fetched& fetched) const;
  Batch Read(const std::vector<int>& samples, int views) const { return Standardise(Fetch(samples, views)); }

  // What it takes to encode frames [begin, end), without textures and views.
  Batch ReadFrames(int begin, int end) const;

 private:
  PackedImage Load(int slot) const;
  PackedImage LoadImage(const Sample& sample) const;
  void FetchAverages(Fetched* fetched) const;
  ImageCrop FetchCrop(int sample, uint64_t seed) const;
  CropBatch StandardiseCrops(const Fetched& fetched) const;
  const Capture& CaptureOf(const Sample& sample) const { return people_[identities_[sample.frame]]->capture(); }
  void AddPerson(int identity);
  void CheckImages();
  void ReadStatistics();
  void ReadConditions();

  std::vector<const TextureSet*> people_;
  DatasetOptions options_;
  std::vector<FrameId> frames_;
  std::vector<int> identities_;  // of frames
  std::vector<TrackedFrame> tracked_;
  std::vector<Camera> training_cameras_;  // of all people, one after another
  TexelWeights texel_weights_;
  std::vector<Sample> samples_;
  std::vector<std::vector<int>> samples_of_frame_;
  std::vector<Statistics> statistics_;
  std::vector<NamedCondition> conditions_;
  std::vector<std::vector<float>> condition_values_;  // of frames
  std::vector<float> condition_mean_, condition_deviation_;
  int crop_width_ = 0, crop_height_ = 0;
  std::unique_ptr<ImageCache> cache_;  // samples' textures, the frames' averages, samples' images
};

}  // namespace likeness
