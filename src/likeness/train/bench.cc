#include "likeness/train/bench.h"

#include <ATen/Parallel.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <memory>
#include <optional>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/capture/capture.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/dataset.h"
#include "likeness/train/image_loss.h"
#include "likeness/train/loader.h"
#include "likeness/train/network.h"
#include "likeness/train/ops/precision.h"
#include "likeness/train/ops/row_kernels.h"
#include "likeness/train/optimiser.h"
#include "likeness/train/sample_order.h"
#include "likeness/train/step.h"

namespace likeness {

namespace {

constexpr int kWarmUp = 2;
constexpr int kLayerRepeats = 5;

double Milliseconds() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double ProcessorMilliseconds() {
  timespec time = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

double Quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

// The best of some products of 1024 x 1024 matrices.
double PeakGflops() {
  constexpr int64_t kSide = 1024;
  const torch::NoGradGuard no_grad;
  const torch::Tensor a = torch::randn({kSide, kSide}), b = torch::randn({kSide, kSide});
  torch::Tensor c = torch::empty({kSide, kSide});
  double best = 1e30;
  for (int i = 0; i < 12; ++i) {
    const double begin = Milliseconds();
    torch::mm_out(c, a, b);
    best = std::min(best, Milliseconds() - begin);
  }
  return 2.0 * kSide * kSide * kSide / best * 1e-6;
}

// Forward and backward, for one sample; the network's inputs have no gradient.
double LayerGflop(const LayerInfo& layer) {
  double products = static_cast<double>(layer.in) * layer.out;
  if (layer.kind == LayerKind::kConvolution) products *= 16.0 * layer.out_size * layer.out_size;
  if (layer.kind == LayerKind::kTransposedConvolution) products *= 4.0 * layer.out_size * layer.out_size;
  const bool first = layer.name == "encoder.texture_conv.0" || layer.name == "encoder.mesh_fc";
  return products * (first ? 4 : 6) * 1e-9;
}

Batch RandomBatch(const Architecture& architecture, int batch, int views) {
  const int64_t frames = batch / views, side = architecture.texture_size;
  Batch random;
  random.average = torch::randn({frames, side, side, 3}).permute({0, 3, 1, 2});
  random.vertices = torch::randn({frames, 3 * architecture.vertex_count});
  random.texture = torch::randn({batch, side, side, 3}).permute({0, 3, 1, 2});
  random.seen = (torch::randn({batch, 1, side, side}) > 0).to(torch::kFloat32);
  random.view = torch::randn({batch, 3});
  return random;
}

std::vector<LayerTime> LayerTimes(const Network& network, int batch, int frames) {
  std::vector<LayerTime> times;
  for (const LayerInfo& info : Layers(network.architecture())) {
    const bool encoder = info.name.starts_with("encoder.");
    const int64_t count = encoder ? frames : batch, in = info.in;
    const int64_t side = info.kind == LayerKind::kConvolution ? 2 * info.out_size : info.out_size / 2;
    torch::Tensor x = info.kind == LayerKind::kLinear ? torch::randn({count, in})
                                                      : torch::randn({count, side, side, in}).permute({0, 3, 1, 2});
    const bool first = info.name == "encoder.texture_conv.0" || info.name == "encoder.mesh_fc";
    const bool last = info.name.starts_with("decoder.texture") && info.out == 3;
    x.requires_grad_(!first);
    std::vector<double> forward, backward;
    torch::Tensor gradient;
    for (int i = 0; i < kLayerRepeats; ++i) {
      const double begin = Milliseconds();
      const torch::Tensor y = network.layer(info.name)(x, last ? 1 : kLeakySlope);
      forward.push_back(Milliseconds() - begin);
      if (!gradient.defined())
        gradient = torch::randn(y.sizes()).to(y.options(), false, false, y.suggest_memory_format());
      for (const Parameter& parameter : network.layer(info.name).parameters()) parameter.value.mutable_grad().reset();
      x.mutable_grad().reset();
      const double half = Milliseconds();
      y.backward(gradient);
      backward.push_back(Milliseconds() - half);
    }
    times.push_back(
        {info.name, Quantile(forward, 0.5), Quantile(backward, 0.5), LayerGflop(info) * static_cast<double>(count)});
  }
  return times;
}

}  // namespace

void TrainBenchOptions::Check() const {
  if (steps < 1 || steps > 10000) throw Error("steps is {}; expected 1 to 10000", steps);
  if (vertex_count < 1) throw Error("vertices is {}; expected 1 or more", vertex_count);
  if (train.loss.image > 0 && !on_capture) throw Error("--loss.image needs a CAPTURE, whose images it draws");
  train.Check();
}

TrainBenchResult BenchTrain(const TrainBenchOptions& options) {
  options.Check();
  const TrainOptions& train = options.train;
  at::set_num_threads(ThreadCount());

  std::unique_ptr<Capture> capture;
  std::optional<TextureSet> textures;
  std::optional<Dataset> dataset;
  std::optional<Loader> loader;
  std::optional<ImageLoss> image_loss;
  int size = train.size > 0 ? train.size : 512, vertices = options.vertex_count;
  if (options.on_capture) {
    capture = OpenCapture(train.capture, train.capture_options);
    if (train.size == 0) {
      const std::vector<int> sizes = TextureSizes(train.capture);
      if (sizes.empty()) {
        throw Error("{}: has no unwrapped textures; make them: likeness unwrap {}", train.capture.string(),
                    train.capture.string());
      }
      size = sizes.back();
    }
    textures.emplace(*capture, size);
    vertices = capture->topology().vertex_count;
    dataset.emplace(std::vector<const TextureSet*>{&*textures}, DatasetOptions{.images = train.loss.image > 0,
                                                                               .crop = train.crop,
                                                                               .cache_bytes = train.CacheBytes(),
                                                                               .cache_folder = train.cache_dir});
    if (train.loss.image > 0) image_loss.emplace(capture->topology(), dataset->AllStatistics(), torch::kFloat32);
  }

  TrainBenchResult result;
  result.architecture = ArchitectureFrom(train, size, vertices);
  result.parameters = ParameterCount(result.architecture);
  result.threads = at::get_num_threads();
  const Precision precision = PrecisionFrom(train.precision);
  const bool half = precision == Precision::kBfloat16 && Bfloat16RowKernels() != nullptr;
  result.kernels = half ? Bfloat16RowKernels()->name : FloatRowKernels().name;
  result.peak_gflops = PeakGflops();

  const Network network(result.architecture, train.seed);
  Optimiser optimiser(network.parameters());
  const Peers alone;
  GradientExchange exchange(alone, network.parameters());
  const PrecisionScope scope(precision);
  Batch batch;
  if (dataset) {
    loader.emplace(*dataset, SampleOrder(dataset->samples_of_frame(), train.views, train.seed), train.batch,
                   train.views, 0, 1, train.workers);
  } else {
    batch = RandomBatch(result.architecture, train.batch, train.views);
  }
  std::vector<double> wall, processor;
  double waited_before_ms = 0;
  for (int step = 0; step < kWarmUp + options.steps; ++step) {
    if (step == kWarmUp && loader) waited_before_ms = loader->waited_s() * 1e3;
    const double begin = Milliseconds(), processor_begin = ProcessorMilliseconds();
    if (loader) batch = loader->Next();
    TrainStep(network, optimiser, alone, exchange, batch, train.loss, image_loss ? &*image_loss : nullptr,
              static_cast<uint64_t>(step), 1e-4, train.clip);
    if (step < kWarmUp) continue;
    wall.push_back(Milliseconds() - begin);
    processor.push_back(ProcessorMilliseconds() - processor_begin);
  }
  double total_ms = 0;
  for (const double ms : wall) total_ms += ms;
  if (loader) result.waiting = (loader->waited_s() * 1e3 - waited_before_ms) / total_ms;
  result.step_ms = Quantile(wall, 0.5);
  result.step_ms_low = Quantile(wall, 0.25);
  result.step_ms_high = Quantile(wall, 0.75);
  result.processor_ms = Quantile(processor, 0.5);
  result.samples_per_s = train.batch / result.step_ms * 1e3;
  for (const LayerInfo& layer : Layers(result.architecture)) {
    const bool encoder = layer.name.starts_with("encoder.");
    result.gflop_per_sample += LayerGflop(layer) / (encoder ? train.views : 1);
  }
  result.share_of_peak = result.gflop_per_sample * result.samples_per_s / result.peak_gflops;
  if (options.layers) result.layers = LayerTimes(network, train.batch, train.batch / train.views);
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  result.memory_peak_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  return result;
}

}  // namespace likeness
