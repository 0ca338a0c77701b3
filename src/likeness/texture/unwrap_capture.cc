#include "likeness/texture/unwrap_capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/folder_lock.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/base/random.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image_io.h"
#include "likeness/texture/texture_set.h"
#include "likeness/texture/texture_sums.h"
#include "likeness/texture/unwrap_state.h"

namespace likeness {
namespace {

// What captures whose meshes stand still are given instead of a variance of 0, mm squared: they can be divided by its
// root, and what a network then decodes stays within micrometres.
constexpr double kLeastVertexVariance = 1e-6;

namespace fs = std::filesystem;

class CaptureUnwrapper {
 public:
  CaptureUnwrapper(const Capture& capture, const UnwrapOptions& options, const Shard& shard)
      : capture_(capture),
        options_(options),
        shard_(shard),
        layout_(capture.root()),
        state_(capture, options),
        texels_(MapTexels(capture.topology(), options.size)),
        total_(options.size) {
    if (std::none_of(texels_.texels.begin(), texels_.texels.end(), [](const auto& t) { return t.triangle >= 0; }))
      throw Error("{}: no triangle covers any texel: the UVs lie outside [0, 1]", capture.root().string());
  }

  UnwrapReport Run() {
    FindViews();
    {
      const std::optional<FolderLock> lock = LockFolder();
      state_.Prepare(options_.redo);
    }
    for (size_t i = 0; i < frames_.size(); ++i) {
      if (shard_.Has(static_cast<int64_t>(i))) mine_.push_back(&frames_[i]);
    }
    MarkDone();
    needs_total_ = NeedsStatistics() && !(shard_.count > 1 && Exists(SumsPath(shard_.index)));

    int64_t views = 0;
    for (const Frame* frame : mine_) views += static_cast<int64_t>(frame->views.size());
    Progress progress(fmt::format("unwrap {} x {}", options_.size, options_.size), views, "views");
    const auto run_frame = [&](int64_t i) { RunFrame(*mine_[static_cast<size_t>(i)], &progress); };
    const auto count = static_cast<int64_t>(mine_.size());
    // Frames side by side while there are enough of them; otherwise the cameras of one.
    if (count >= 2 * ThreadCount()) {
      ParallelFor(count, run_frame);
    } else {
      for (int64_t i = 0; i < count; ++i) run_frame(i);
    }
    progress.Finish();
    if (interrupt_.Requested()) {
      throw Error("interrupted: {} of {} views are done; the same command{} goes on from there", done_ + kept_, views,
                  options_.redo ? " without --redo" : "");
    }

    UnwrapReport report;
    report.views = done_;
    report.views_kept = kept_;
    report.views_absent = absent_;
    report.training_views = training_views_;
    if (shard_.count > 1) {
      report.shards_missing = JoinShards();
      if (!report.shards_missing.empty()) return report;
    } else if (needs_total_) {
      WriteStatistics();
    }
    const TextureStatistics statistics = TextureSet(capture_, options_.size).ReadStatistics();
    report.texture_variance = statistics.variance;
    report.vertex_variance = statistics.vertex_variance;
    return report;
  }

 private:
  struct View {
    const Camera* camera = nullptr;
    bool training = false;
    bool done = false;
  };
  struct Frame {
    FrameId id;
    bool training = false;
    bool done = false;  // with its average
    std::vector<View> views;
  };

  CaptureLayout Statistics() const { return CaptureLayout(layout_.TextureFolder(options_.size)); }
  fs::path SumsFolder() const { return layout_.TextureFolder(options_.size) / ".sums"; }

  // Where a shard leaves its sums. The name says what they are of, so a file of this name is never out of date.
  fs::path SumsPath(int index) const {
    return SumsFolder() / fmt::format("{}-of-{}-{}", index, shard_.count, StatisticsKey({index, shard_.count}));
  }

  bool NeedsStatistics() const {
    return !state_.HasStatistics(StatisticsKey({})) || !Exists(Statistics().TextureMean());
  }

  // Shards change what they share one after another.
  std::optional<FolderLock> LockFolder() const {
    if (shard_.count == 1) return std::nullopt;
    return std::optional<FolderLock>(std::in_place, layout_.TextureFolder(options_.size), FolderLock::Held::kWait);
  }

  // Leaves this shard's sums for the last one, which writes the statistics. Returns the shards that have not finished.
  std::vector<int> JoinShards() {
    if (needs_total_) WriteFile(SumsPath(shard_.index), total_.Bytes());
    const std::optional<FolderLock> lock = LockFolder();
    state_.Refresh();
    std::vector<int> missing;
    if (!NeedsStatistics()) return missing;
    for (int index = 1; index <= shard_.count; ++index) {
      if (!Exists(SumsPath(index))) missing.push_back(index);
    }
    if (!missing.empty()) return missing;
    total_ = TextureSums(options_.size);
    for (int index = 1; index <= shard_.count; ++index) {
      const fs::path path = SumsPath(index);
      try {
        total_.Add(TextureSums::Parse(path, ReadFile(path), options_.size));
      } catch (const Error& error) {
        throw Error("{}; remove it and run shard {}/{} again", error.what(), index, shard_.count);
      }
    }
    WriteStatistics();
    RemoveFolder(SumsFolder());
    return missing;
  }

  void FindViews() {
    const Split& split = capture_.split();
    std::vector<View> cameras;
    for (const Camera& camera : capture_.cameras()) {
      const bool training = std::find(split.training_cameras.begin(), split.training_cameras.end(), camera.name) !=
                            split.training_cameras.end();
      if (training || (options_.held_out && split.IsHeldOutCamera(camera.name))) {
        cameras.push_back({&camera, training, false});
      }
    }
    for (const FrameId& id : capture_.frames()) frames_.push_back({id, !split.IsHeldOutSegment(id.segment), false, {}});
    std::atomic<int64_t> absent = 0;
    ParallelFor(static_cast<int64_t>(frames_.size()), [&](int64_t i) {
      Frame& frame = frames_[static_cast<size_t>(i)];
      for (const View& view : cameras) {
        if (capture_.HasCameraImage(frame.id, *view.camera)) {
          frame.views.push_back(view);
        } else {
          ++absent;
        }
      }
    });
    absent_ = absent;
    std::erase_if(frames_, [](const Frame& frame) { return frame.views.empty(); });
    for (const Frame& frame : frames_) {
      for (const View& view : frame.views) training_views_ += frame.training && view.training ? 1 : 0;
    }
    if (training_views_ == 0) {
      throw Error(
          "{}: no training camera has an image of a training frame; expected images/<segment>/<camera>/"
          "<frame>.png",
          capture_.root().string());
    }
  }

  void MarkDone() {
    ParallelFor(static_cast<int64_t>(mine_.size()), [&](int64_t i) {
      Frame& frame = *mine_[static_cast<size_t>(i)];
      const auto whole = [&](const std::string& name) {
        return LooksWholePng(layout_.Texture(frame.id, name, options_.size)) &&
               LooksWholePng(layout_.TextureMask(frame.id, name, options_.size));
      };
      bool training_done = true;
      for (View& view : frame.views) {
        view.done = whole(view.camera->name);
        if (view.training && !view.done) training_done = false;
      }
      frame.done = training_done && LooksWholePng(layout_.AverageTexture(frame.id, options_.size));
    });
  }

  // Stands for everything that enters the statistics, or a shard's sums.
  std::string StatisticsKey(const Shard& shard) const {
    std::string names;
    for (size_t i = 0; i < frames_.size(); ++i) {
      const Frame& frame = frames_[i];
      if (!frame.training || !shard.Has(static_cast<int64_t>(i))) continue;
      names += frame.id.segment + '/' + frame.id.frame + ':';
      for (const View& view : frame.views) {
        if (view.training) names += view.camera->name + ' ';
      }
    }
    return fmt::format("{:016x}", Hash(names));
  }

  UnwrappedView Read(const Frame& frame, const View& view) const {
    return {ReadImage(layout_.Texture(frame.id, view.camera->name, options_.size), 3),
            ReadImage(layout_.TextureMask(frame.id, view.camera->name, options_.size), 1)};
  }

  UnwrappedView Make(const FrameUnwrapper& unwrapper, const RigidTransform& world_from_head, const Frame& frame,
                     const View& view) const {
    const ImageU8 image = capture_.ReadCameraImage(frame.id, *view.camera);
    std::optional<ImageU8> mask;
    if (options_.use_masks) mask = capture_.ReadHeadMask(frame.id, *view.camera);
    if (const auto valid = capture_.ReadValidMask(*view.camera)) mask = mask ? Both(*mask, *valid) : *valid;
    UnwrappedView made = unwrapper.Unwrap(*view.camera, world_from_head, image, mask ? &*mask : nullptr);
    Write(layout_.TextureMask(frame.id, view.camera->name, options_.size), made.mask);
    Write(layout_.Texture(frame.id, view.camera->name, options_.size), made.texture);
    return made;
  }

  static ImageU8 Both(ImageU8 mask, const ImageU8& other) {
    for (size_t i = 0; i < mask.values().size(); ++i) mask.values()[i] &= other.values()[i];
    return mask;
  }

  static void Write(const fs::path& path, const ImageU8& image) { WriteFile(path, EncodePng(image, 1), Sync::kNo); }

  void RunFrame(const Frame& frame, Progress* progress) {
    const bool needs_sums = !frame.done || (frame.training && needs_total_);
    const bool all_done = std::all_of(frame.views.begin(), frame.views.end(), [](const View& v) { return v.done; });
    const auto views = static_cast<int64_t>(frame.views.size());
    if (interrupt_.Requested()) return;
    if (all_done && !needs_sums) {
      kept_ += views;
      progress->Skip(views);
      return;
    }
    TrackedFrame tracked;
    std::optional<FrameUnwrapper> unwrapper;
    if (!all_done) {
      tracked = capture_.ReadTracked(frame.id);
      unwrapper.emplace(capture_.topology(), texels_, tracked.vertices_in_head, options_);
    }
    TextureSums sums(options_.size);
    std::mutex mutex;
    ParallelFor(views, [&](int64_t i) {
      if (interrupt_.Requested()) return;
      const View& view = frame.views[static_cast<size_t>(i)];
      const bool summed = view.training && needs_sums;
      if (view.done && !summed) {
        ++kept_;
        progress->Skip(1);
        return;
      }
      const UnwrappedView unwrapped =
          view.done ? Read(frame, view) : Make(*unwrapper, tracked.world_from_head, frame, view);
      ++(view.done ? kept_ : done_);
      progress->Advance();
      if (summed) {
        const std::lock_guard lock(mutex);
        sums.Add(unwrapped);
      }
    });
    if (interrupt_.Requested() || !needs_sums) return;
    if (!frame.done) Write(layout_.AverageTexture(frame.id, options_.size), sums.Average());
    if (frame.training && needs_total_) {
      const std::lock_guard lock(total_mutex_);
      total_.Add(sums);
    }
  }

  void WriteStatistics() {
    VertexSums vertices;
    for (const Frame& frame : frames_) {
      if (frame.training) vertices.Add(capture_.ReadTracked(frame.id).vertices_in_head);
    }
    if (total_.Variance() == 0) {
      throw Error(
          "{}: the training textures are all the same, or no texel is seen: do meshes, head poses and "
          "calibration fit the images? likeness inspect draws them",
          capture_.root().string());
    }
    const auto write = [&](const CaptureLayout& layout) {
      WriteFile(layout.TextureVariance(), fmt::format("{}\n", total_.Variance()));
      WriteFloats(layout.VertexMean(), vertices.Mean());
      WriteFile(layout.VertexVariance(), fmt::format("{}\n", std::max(kLeastVertexVariance, vertices.Variance())));
      WritePng(layout.TextureMean(), total_.FilledAverage());
    };
    write(Statistics());
    if (MayReplaceRootStatistics()) write(layout_);
    state_.SetStatistics(StatisticsKey({}));
  }

  // Nothing may be lost, and published tools expect the largest size.
  bool MayReplaceRootStatistics() const {
    if (!Exists(layout_.TextureMean())) return true;
    const int size = ReadImageInfo(layout_.TextureMean()).width;
    return size == options_.size ||
           (size < options_.size && Exists(CaptureLayout(layout_.TextureFolder(size)).TextureMean()));
  }

  const Capture& capture_;
  const UnwrapOptions& options_;
  const Shard shard_;
  const CaptureLayout layout_;
  UnwrapState state_;
  const TexelMap texels_;
  std::vector<Frame> frames_;
  std::vector<Frame*> mine_;  // of this shard
  const InterruptScope interrupt_;
  bool needs_total_ = true;
  int64_t absent_ = 0;
  int64_t training_views_ = 0;
  std::atomic<int64_t> done_ = 0, kept_ = 0;
  std::mutex total_mutex_;
  TextureSums total_;
};

}  // namespace

UnwrapReport UnwrapCapture(const Capture& capture, const UnwrapOptions& options, const Shard& shard) {
  options.Check();
  if (options.redo && shard.count > 1) {
    const CaptureLayout layout(capture.root());
    throw Error("--redo would remove what other shards have made: remove {} and {} before all of them start",
                layout.TextureFolder(options.size).string(), layout.TextureMaskFolder(options.size).string());
  }
  return CaptureUnwrapper(capture, options, shard).Run();
}

}  // namespace likeness
