#include "likeness/train/trainer.h"

#include <ATen/Parallel.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/folder_lock.h"
#include "likeness/base/launcher.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/base/random.h"
#include "likeness/capture/proxy_record.h"
#include "likeness/train/checkpoint.h"
#include "likeness/train/dataset.h"
#include "likeness/train/device.h"
#include "likeness/train/fine_tuning.h"
#include "likeness/train/gradient_exchange.h"
#include "likeness/train/image_loss.h"
#include "likeness/train/loader.h"
#include "likeness/train/make_avatar.h"
#include "likeness/train/ops/precision.h"
#include "likeness/train/peers.h"
#include "likeness/train/people.h"
#include "likeness/train/preview.h"
#include "likeness/train/run_log.h"
#include "likeness/train/sample_order.h"
#include "likeness/train/step.h"

namespace likeness {
namespace {

constexpr int64_t kAverageEvery = 4;        // steps between updates of the mean weights: each reads all of them
constexpr int64_t kMostSkippedInARow = 50;  // steps that are not finite before the run gives up
constexpr double kHeld = 0.6;               // share of a run in which the schedule "hold" stays at the learning rate
constexpr double kPictureMinutes = 1;       // at least, between pictures of the samples

double Seconds(std::chrono::steady_clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

// With what the capture decides: its geometry, and no geometry term where its mesh stands still.
TrainOptions ForCapture(const TrainOptions& options) {
  TrainOptions resolved = options;
  const Geometry geometry = GeometryOf(options.capture);
  resolved.geometry = ToString(geometry);
  if (options.geometry != resolved.geometry && options.geometry != ToString(Geometry::kTracked)) {
    throw Error("--geometry is '{}', but the meshes of {} are {}; likeness proxy makes captures with others",
                options.geometry, options.capture.string(), resolved.geometry);
  }
  for (const std::filesystem::path other : options.also) {
    if (GeometryOf(other) == geometry) continue;
    throw Error("{}: its meshes are {}, those of {} {}; people in one network have the same geometry", other.string(),
                ToString(GeometryOf(other)), options.capture.string(), resolved.geometry);
  }
  if (StandsStill(geometry) && options.loss.geometry > 0) {
    LogInfo("the {} stands still: there is no mesh to learn, and the geometry term is off", resolved.geometry);
    resolved.loss.geometry = 0;
  }
  return resolved;
}

// Where a run stands between its beginning, 0, and its end, 1.
double Position(const TrainOptions& options, const RunState& run) {
  double position = 0;
  if (options.iterations > 0) position = static_cast<double>(run.iteration) / static_cast<double>(options.iterations);
  if (options.minutes > 0) position = std::max(position, run.elapsed_s / (60 * options.minutes));
  return std::min(position, 1.0);
}

double LearningRate(const TrainOptions& options, double position) {
  const double rise = options.warmup > 0 ? std::min(1.0, (position + 1e-3) / options.warmup) : 1;
  const double hold = options.schedule == "hold" ? kHeld : 0;
  const double falling = options.schedule == "constant" ? 0 : std::max(0.0, position - hold) / (1 - hold);
  return options.learning_rate * rise * 0.5 * (1 + std::cos(M_PI * falling));
}

// The decay with which a running mean reaches over `share` of a run's length.
double AverageDecay(double share, const RunState& run, double position) {
  const double steps = static_cast<double>(run.iteration + 1);
  const double reach = std::max(1.0, share * steps / std::max(position, 1e-6));
  return std::min(std::exp(-static_cast<double>(kAverageEvery) / reach), steps / (steps + 10));
}

// What the progress line shows behind the count.
std::string Note(const TrainOptions& options, const RunState& run, const StepValues& values, double samples_per_s) {
  const double position = std::max(Position(options, run), 1e-9);
  const std::string image = options.loss.image > 0 ? fmt::format(", image {:.4f}", values.image) : "";
  return fmt::format("loss {:.4f} (texture {:.4f}, geometry {:.4f}, KL {:.2f}{}), {:.1f} samples/s, {} left",
                     values.total, values.texture, values.geometry, values.kl, image, samples_per_s,
                     FormatDuration(run.elapsed_s * (1 - position) / position));
}

// Gives everybody what the first process has loaded.
void Share(const Peers& peers, RunState* run, const std::vector<Parameter>& state) {
  const torch::Tensor counts = torch::tensor({run->iteration, run->batches, run->skipped, run->skipped_in_a_row});
  const torch::Tensor elapsed_s = torch::tensor(run->elapsed_s, torch::kFloat64);
  std::vector<torch::Tensor> tensors = {counts, elapsed_s};
  for (const Parameter& tensor : state) tensors.push_back(tensor.value);
  peers.Broadcast(tensors);
  *run = {counts[0].item<int64_t>(), counts[1].item<int64_t>(), elapsed_s.item<double>(), counts[2].item<int64_t>(),
          counts[3].item<int64_t>()};
}

}  // namespace

void KeepMemory() {
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, -1);  // never
  mallopt(M_TOP_PAD, 256 << 20);
  mallopt(M_ARENA_MAX, 1);                               // an arena of its own would not hold a thread's large tensors
  setenv("THP_MEM_ALLOC_ENABLE", "1", /*overwrite=*/0);  // LibTorch's allocator then asks for huge pages
}

TrainResult Train(const TrainOptions& given, const std::function<bool()>& stop, const std::string& resolved) {
  given.Check();
  const TrainOptions options = ForCapture(given);
  at::set_num_threads(ThreadCount());
  const Launcher launcher = ReadLauncher();
  const torch::Device device = FindDevice(options.device, launcher.local_rank);
  const Peers peers(launcher, device, options.peer_timeout_s);
  const People people(options);
  std::optional<Avatar> origin;
  if (!options.from.empty()) origin = LoadAvatar(options.from);
  Architecture architecture = ArchitectureFrom(options, people.size(), people.topology().vertex_count);
  const Dataset dataset(people.textures(), {.conditions = options.conditions,
                                            .weighting = ParseTexelWeighting(options.texels),
                                            .images = options.loss.image > 0,
                                            .crop = options.crop,
                                            .cache_bytes = options.CacheBytes(),
                                            .cache_folder = options.cache_dir,
                                            .like = origin ? &*origin : nullptr});
  architecture.conditions = dataset.conditions();
  architecture.Check();
  if (origin) CheckOrigin(options.from, *origin, architecture, people);
  LogInfo("train on {} textures of {} frames{}, {} x {} texels; {:.1f} million parameters", dataset.samples().size(),
          dataset.frames().size(), dataset.people() > 1 ? fmt::format(" of {} people", dataset.people()) : "",
          dataset.size(), dataset.size(), static_cast<double>(ParameterCount(architecture)) * 1e-6);

  const auto tensors = torch::TensorOptions(torch::kFloat32).device(device);
  Network network(architecture, options.seed, tensors,
                  ColourOptions{options.colours ? dataset.cameras() : 0, options.colour_rate});
  if (origin) network.Take(origin->weights);
  std::optional<ImageLoss> image_loss;
  if (options.loss.image > 0)
    image_loss.emplace(people.topology(), dataset.AllStatistics(), tensors, options.silhouettes);
  Optimiser optimiser(network.parameters(), network.statistics(), options.beta2);
  // The first process alone writes.
  std::optional<FolderLock> lock;
  if (peers.IsFirst()) lock.emplace(options.out);
  const RunIdentity identity = {architecture, options.Fingerprint()};
  Checkpoints checkpoints(options.out, options.keep);
  RunState run;
  if (peers.IsFirst()) {
    if (options.resume) {
      run = checkpoints.Load(identity, optimiser.State()).value_or(RunState());
    } else {
      checkpoints.Replace();
    }
    if (!resolved.empty()) WriteFile(options.out / "train.toml", resolved);
  }
  Share(peers, &run, optimiser.State());
  const auto save = [&] {
    if (peers.IsFirst()) checkpoints.Save(run, identity, optimiser.State());
  };

  const int64_t first = run.iteration, first_batch = run.batches;
  const double earlier_s = run.elapsed_s;
  std::optional<RunLog> log;
  if (peers.IsFirst()) log.emplace(options.out, first);
  TrainResult result;
  {
    GradientExchange exchange(peers, network.parameters());
    Loader loader(dataset, SampleOrder(dataset.samples_of_frame(), options.views, options.seed), options.batch,
                  options.views, first_batch + peers.rank(), peers.count(), options.workers);
    Progress progress("train", options.minutes > 0 ? 0 : options.iterations, "iterations");
    progress.Skip(first);
    const auto start = std::chrono::steady_clock::now();
    auto saved = start, pictured = start;
    bool stopped = false;
    while (!stopped && Position(options, run) < 1) {
      const double position = Position(options, run);
      const double rate = LearningRate(options, position);
      const Batch batch = loader.Next().To(device);
      const StepValues values = [&] {
        const PrecisionScope scope(PrecisionFrom(options.precision));
        return TrainStep(network, optimiser, peers, exchange, batch, options.loss, image_loss ? &*image_loss : nullptr,
                         Hash({options.seed, 1, static_cast<uint64_t>(run.iteration)}), rate, options.clip);
      }();
      run.skipped += values.skipped ? 1 : 0;
      run.skipped_in_a_row = values.skipped ? run.skipped_in_a_row + 1 : 0;
      if (run.skipped_in_a_row >= kMostSkippedInARow) {
        throw Error(
            "the loss or its gradient was not finite in {} steps in a row (iteration {}); try a smaller "
            "--learning-rate; {} holds the last checkpoints",
            kMostSkippedInARow, run.iteration, (options.out / "checkpoints").string());
      }
      if (options.average > 0 && run.iteration % kAverageEvery == 0) {
        optimiser.Average(AverageDecay(options.average, run, position));
      }
      ++run.iteration;
      run.batches += peers.count();
      const auto now = std::chrono::steady_clock::now();
      // Everybody goes by the first one's clock, and stops when anybody is asked to.
      std::array agreed = {peers.IsFirst() ? earlier_s + Seconds(now - start) : 0, stop() ? 1.0 : 0.0};
      peers.Sum(agreed);
      run.elapsed_s = agreed[0];
      stopped = agreed[1] > 0;
      result.samples_per_s =
          static_cast<double>((run.batches - first_batch) * options.batch) / (run.elapsed_s - earlier_s);
      progress.Advance();
      if (Seconds(now - saved) >= 60 * options.save_minutes) {
        save();
        saved = now;
      }
      if (!log) continue;
      log->Add(values, rate);
      if (run.iteration % options.log_every == 0 || Position(options, run) >= 1) {
        progress.Note(Note(options, run, log->Means(), result.samples_per_s));
        log->Write(run);
      }
      if (Seconds(now - pictured) >= 60 * std::max(options.save_minutes, kPictureMinutes)) {
        log->WritePicture(run, Preview(network, dataset, device));
        pictured = now;
      }
    }
    result.waiting = loader.waited_s() / std::max(1e-9, run.elapsed_s - earlier_s);
    result.cache_bytes = dataset.cache().memory_bytes();
    result.cache_file_bytes = dataset.cache().file_bytes();
    result.textures_made = dataset.cache().made();
  }

  result.iterations = run.iteration;
  result.samples = run.batches * options.batch;
  result.skipped = run.skipped;
  result.elapsed_s = run.elapsed_s;
  result.finished = Position(options, run) >= 1;
  const StepValues last = log ? log->LastMeans() : StepValues();
  result.loss = last.total;
  result.loss_texture = last.texture;
  result.loss_geometry = last.geometry;
  result.loss_kl = last.kl;
  result.loss_image = last.image;
  if (run.iteration > first) save();
  if (!result.finished || !peers.IsFirst()) return result;

  result.avatar = options.out / "avatar.safetensors";
  if (run.iteration == first && std::filesystem::exists(result.avatar)) return result;
  if (options.average > 0) {
    optimiser.SwapAverage();
    RefreshStatistics(network, dataset, options, device);
  }
  SaveAvatar(result.avatar, MakeAvatar(network, dataset, people, options, run, device));
  log->WritePicture(run, Preview(network, dataset, device));
  return result;
}

}  // namespace likeness
