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
#include "likeness/train/gradient_exchange.h"
#include "likeness/train/loader.h"
#include "likeness/train/ops/precision.h"
#include "likeness/train/peers.h"
#include "likeness/train/people.h"
#include "likeness/train/run_log.h"
#include "likeness/train/step.h"

namespace likeness {

namespace {

constexpr int64_t kAverageEvery = 4;        // steps between updates of the mean weights: each reads all of them
constexpr int64_t kMostSkippedInARow = 50;  // steps that are not finite before the run gives up
constexpr int kPreviewSamples = 3;
constexpr double kHeld = 0.6;          // share of a run in which the schedule "hold" stays at the learning rate
constexpr double kPictureMinutes = 1;  // at least, between pictures of the samples

double Seconds(std::chrono::steady_clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

Batch ToDevice(const Batch& batch, torch::Device device) {
  if (device.is_cpu()) return batch;
  return {batch.average.to(device), batch.vertices.to(device), batch.texture.to(device),  batch.seen.to(device),
          batch.view.to(device),    batch.camera.to(device),   batch.identity.to(device), batch.named.to(device)};
}

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

// Lets the running statistics of batch normalisation follow the mean weights, which they were not met with.
void RefreshStatistics(const Network& network, const Dataset& dataset, const TrainOptions& options,
                       torch::Device device) {
  if (network.statistics().empty()) return;
  constexpr int kBatches = 50;  // a running mean of momentum 0.1 has forgotten all but 0.5% of what was before
  const SampleOrder order(dataset.samples_of_frame(), options.views, options.seed);
  for (int i = 0; i < kBatches; ++i) {
    const Batch batch = ToDevice(dataset.Read(order.Samples(i, options.batch), options.views), device);
    const torch::Tensor condition = network.Condition(batch.identity, batch.named);
    const torch::Tensor mu = network.Encode(batch.average, batch.vertices, condition).mu;
    network.Decode(mu.repeat_interleave(options.views, 0), batch.view,
                   condition.defined() ? condition.repeat_interleave(options.views, 0) : condition);
  }
}

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

// Rows of truth, prediction and five-fold difference, for samples spread over the capture; unseen texels are grey.
ImageU8 Preview(const Network& network, const Dataset& dataset, torch::Device device) {
  const torch::NoGradGuard no_grad;
  const int size = dataset.size(), total = static_cast<int>(dataset.samples().size());
  const int rows = std::min(kPreviewSamples, total);
  ImageU8 picture(3 * size, rows * size, 3, 128);
  for (int row = 0; row < rows; ++row) {
    const int sample = static_cast<int>((row + 0.5) * total / rows);
    const Batch batch = dataset.Read({sample}, 1);
    const torch::Tensor condition = network.Condition(batch.identity.to(device), batch.named.to(device));
    const torch::Tensor mu = network.Encode(batch.average.to(device), batch.vertices.to(device), condition).mu;
    const torch::Tensor prediction =
        network.Decode(mu, batch.view.to(device), condition).texture.cpu().permute({0, 2, 3, 1}).contiguous();
    const torch::Tensor target = batch.texture.permute({0, 2, 3, 1}).contiguous();
    const Statistics& statistics = dataset.statistics(dataset.IdentityOf(dataset.samples()[sample].frame));
    const ImageF predicted = RestoreTexture(statistics, prediction.const_data_ptr<float>());
    const ImageF truth = RestoreTexture(statistics, target.const_data_ptr<float>());
    const float* seen = batch.seen.const_data_ptr<float>();
    const auto byte = [](float value) { return static_cast<uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); };
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const bool valid = seen[y * size + x] != 0;
        for (int c = 0; c < 3; ++c) {
          const float is = predicted.at(x, y)[c], should = truth.at(x, y)[c];
          picture.at(size + x, row * size + y)[c] = byte(is);
          if (!valid) continue;
          picture.at(x, row * size + y)[c] = byte(should);
          picture.at(2 * size + x, row * size + y)[c] = byte(128 + 5 * (is - should));
        }
      }
    }
  }
  return picture;
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

// What the progress line shows behind the count.
std::string Note(const TrainOptions& options, const RunState& run, const StepValues& values, double samples_per_s) {
  const double position = std::max(Position(options, run), 1e-9);
  return fmt::format("loss {:.4f} (texture {:.4f}, geometry {:.4f}, KL {:.2f}), {:.1f} samples/s, {} left",
                     values.total, values.texture, values.geometry, values.kl, samples_per_s,
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
  Architecture architecture = ArchitectureFrom(options, people.size(), people.topology().vertex_count);
  const Dataset dataset(people.textures(), options.conditions, options.CacheBytes(),
                        ParseTexelWeighting(options.texels), options.cache_dir);
  architecture.conditions = dataset.conditions();
  architecture.Check();
  LogInfo("train on {} textures of {} frames{}, {} x {} texels; {:.1f} million parameters", dataset.samples().size(),
          dataset.frames().size(), dataset.people() > 1 ? fmt::format(" of {} people", dataset.people()) : "",
          dataset.size(), dataset.size(), static_cast<double>(ParameterCount(architecture)) * 1e-6);

  const Network network(architecture, options.seed, torch::TensorOptions(torch::kFloat32).device(device),
                        ColourOptions{options.colours ? dataset.cameras() : 0, options.colour_rate});
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
      const Batch batch = ToDevice(loader.Next(), device);
      const StepValues values = [&] {
        const PrecisionScope scope(PrecisionFrom(options.precision));
        return TrainStep(network, optimiser, peers, exchange, batch, options.loss,
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
