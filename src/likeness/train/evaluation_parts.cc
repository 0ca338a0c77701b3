#include "likeness/train/evaluation_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/folder_lock.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/progress.h"
#include "likeness/base/random.h"
#include "likeness/image/image_io.h"
#include "likeness/train/evaluation_part_file.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

// Stands for everything that the figures follow from.
std::string Key(const Capture& capture, const std::vector<EvaluationTask>& tasks, const EvaluationOptions& options,
                bool textures, const std::string& avatar) {
  std::string all = fmt::format("{} {} {} {}\n", fs::weakly_canonical(capture.root()).string(), avatar,
                                options.supersample, textures);
  for (const EvaluationTask& task : tasks) {
    all += fmt::format("{}/{}/{}/{}{}\n", ToString(task.group), task.frame->segment, task.frame->frame,
                       task.camera->name, task.keep_picture ? " picture" : "");
  }
  return fmt::format("{:016x}", Hash(all));
}

class Parts {
 public:
  Parts(const std::vector<EvaluationTask>& tasks, fs::path folder, const Shard& shard)
      : tasks_(tasks),
        folder_(std::move(folder)),
        own_path_(folder_ / fmt::format("{}-of-{}.json", shard.index, shard.count)),
        own_(tasks.size()) {
    if (Exists(own_path_)) Read(own_path_, &own_);
  }

  // What all processes have measured so far.
  PartMeasurements ReadAll() const {
    PartMeasurements all(tasks_.size());
    for (const std::string& name : ListFolder(folder_)) {
      if (!name.starts_with('.') && name.ends_with(".json")) Read(folder_ / name, &all);
    }
    return all;
  }

  // From several threads.
  void Add(size_t task, ImageMeasurement measurement) {
    if (measurement.picture) WritePictures(task, *measurement.picture);
    measurement.picture.reset();
    const std::lock_guard lock(mutex_);
    own_[task] = measurement;
    // A lost process loses half a minute.
    const auto now = std::chrono::steady_clock::now();
    if (now - written_ < std::chrono::seconds(30)) return;
    WriteFile(own_path_, PartText(own_));
    written_ = now;
  }

  void Write() const { WriteFile(own_path_, PartText(own_)); }

  void ReadPictures(size_t i, ImageMeasurement* measurement) const {
    const EvaluationTask& task = tasks_[i];
    measurement->picture = EvaluatedPicture{task.group,
                                            *task.frame,
                                            task.camera->name,
                                            ReadImage(PicturePath(i, "truth"), 3),
                                            ReadImage(PicturePath(i, "ours"), 3),
                                            ReadImage(PicturePath(i, "mask"), 1),
                                            ReadImage(PicturePath(i, "texture"), 3),
                                            measurement->error.Mean(),
                                            measurement->ssim};
  }

 private:
  fs::path PicturePath(size_t task, std::string_view what) const {
    return folder_ / fmt::format("{}-{}.png", task, what);
  }

  void WritePictures(size_t task, const EvaluatedPicture& picture) const {
    WritePng(PicturePath(task, "truth"), picture.truth);
    WritePng(PicturePath(task, "ours"), picture.ours);
    WritePng(PicturePath(task, "mask"), picture.mask);
    WritePng(PicturePath(task, "texture"), picture.texture);
  }

  void Read(const fs::path& path, PartMeasurements* measurements) const {
    const PartMeasurements read = ParsePart(path, ReadFile(path), tasks_.size());
    for (size_t i = 0; i < read.size(); ++i) {
      if (!read[i]) continue;
      bool whole = true;
      if (tasks_[i].keep_picture) {
        for (const char* what : {"truth", "ours", "mask", "texture"}) whole = whole && Exists(PicturePath(i, what));
      }
      if (whole) (*measurements)[i] = read[i];
    }
  }

  const std::vector<EvaluationTask>& tasks_;
  const fs::path folder_;
  const fs::path own_path_;
  std::mutex mutex_;
  PartMeasurements own_;
  std::chrono::steady_clock::time_point written_ = std::chrono::steady_clock::now();
};

}  // namespace

SharedEvaluation EvaluateTogether(const Capture& capture, const FrameEncoder& encode, const FrameDecoder& decoder,
                                  const EvaluationOptions& options, const TextureSet* textures, const fs::path& folder,
                                  const std::string& avatar, const Shard& shard) {
  options.Check();
  const std::vector<EvaluationTask> tasks = ChooseTasks(capture, options);
  const fs::path own_folder = folder / Key(capture, tasks, options, textures != nullptr, avatar);
  {
    // A folder that cannot be written to is found out now.
    const FolderLock writable(own_folder, FolderLock::Held::kWait);
  }
  Parts parts(tasks, own_folder, shard);

  const PartMeasurements before = parts.ReadAll();
  std::vector<std::vector<size_t>> frames;
  int64_t mine = 0, kept = 0;
  const std::vector<std::vector<size_t>> all_frames = ByFrame(tasks);
  for (size_t f = 0; f < all_frames.size(); ++f) {
    if (!shard.Has(static_cast<int64_t>(f))) continue;
    std::vector<size_t> missing;
    for (const size_t i : all_frames[f]) {
      ++mine;
      if (before[i]) ++kept;
      if (!before[i]) missing.push_back(i);
    }
    if (!missing.empty()) frames.push_back(std::move(missing));
  }
  const InterruptScope interrupt;
  Progress progress("evaluate", mine, "images");
  progress.Skip(kept);
  std::atomic<int64_t> done = kept;
  MeasureTasks(capture, encode, decoder, options, textures, tasks, frames, [&](size_t i, ImageMeasurement measured) {
    parts.Add(i, std::move(measured));
    progress.Advance();
    ++done;
    return !interrupt.Requested();
  });
  progress.Finish();

  // One after another, so that the last one sees the parts of all.
  const FolderLock lock(own_folder, FolderLock::Held::kWait);
  parts.Write();
  if (done < mine) {
    throw Error("interrupted: {} of {} images are done and kept in {}; the same command goes on from there",
                done.load(), mine, folder.string());
  }
  PartMeasurements all = parts.ReadAll();
  SharedEvaluation shared;
  shared.images = static_cast<int64_t>(tasks.size());
  shared.images_missing = std::count_if(all.begin(), all.end(), [](const auto& m) { return !m.has_value(); });
  if (shared.images_missing > 0) return shared;
  std::vector<ImageMeasurement> measurements;
  for (size_t i = 0; i < all.size(); ++i) {
    measurements.push_back(*all[i]);
    if (tasks[i].keep_picture) parts.ReadPictures(i, &measurements.back());
  }
  shared.result = Summarise(tasks, &measurements);
  return shared;
}

}  // namespace likeness
