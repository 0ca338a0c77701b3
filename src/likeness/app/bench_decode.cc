// likeness bench decode [AVATAR]

#include "likeness/app/bench_decode.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "likeness/app/benches.h"
#include "likeness/app/command.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/base/error.h"
#include "likeness/base/quantile.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/kernels.h"
#include "likeness/decode/random_avatar.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double Milliseconds(Clock::duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

struct Arguments {
  fs::path avatar;
  std::string preset = "multiface";
  std::string kernel = "all";
  int size = 1024;
  int vertices = 7306;
  double seconds = 1;
  bool json = false;
};

// A random network of the preset in a file that is removed at the end.
struct RandomFile {
  explicit RandomFile(const Arguments& arguments) {
    Architecture a;
    a.preset = arguments.preset;
    a.texture_size = arguments.size;
    a.vertex_count = arguments.vertices;
    if (arguments.preset == "multiface") {
      a.layout = Layout::kMultiface;
      a.latent = 256;
      a.untied_bias = UntiedBias::kDecoderAndChannel;
    }
    a.Check();
    SaveAvatar(path, RandomAvatar(a, 1));
  }
  ~RandomFile() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
  RandomFile(const RandomFile&) = delete;
  RandomFile& operator=(const RandomFile&) = delete;

  const fs::path path = fs::temp_directory_path() / fmt::format("likeness-bench-{}.safetensors", getpid());
};

// Textures and mesh of one frame, and what is decoded into them.
struct Frame {
  Frame(const Decoder& decoder, int view_count)
      : code(decoder.mean_code()), vertices(static_cast<size_t>(decoder.architecture().vertex_count) * 3) {
    const int64_t row = decoder.architecture().texture_size * int64_t{4};
    for (int v = 0; v < view_count; ++v) {
      pixels[v].resize(static_cast<size_t>(row * row / 4));
      const float x = v == 0 ? -kEyeX : kEyeX;
      views.push_back({{x, 0, std::sqrt(1 - x * x)}, pixels[v].data(), row});
    }
  }
  // The pair comes with the mesh, the single view without.
  void Decode(Decoder& decoder) { decoder.Decode(code, views, {views.size() == 2 ? vertices.data() : nullptr, 12}); }

  std::vector<float> code, vertices;
  std::vector<uint8_t> pixels[2];
  std::vector<Decoder::View> views;
};

// Gigabytes a second that threads together read from memory, or from a cache that holds as much as a network does.
double ReadBandwidth(int threads) {
  constexpr size_t kBytes = size_t{24} << 20;
  const std::vector<uint64_t> memory(kBytes / 8, 1);
  double best = 0;
  for (int run = 0; run < 12; ++run) {
    std::vector<std::thread> workers;
    std::vector<uint64_t> sums(static_cast<size_t>(threads) * 64);
    const auto read = [&](int t) {
      const size_t share = memory.size() / static_cast<size_t>(threads);
      const uint64_t* const from = memory.data() + share * static_cast<size_t>(t);
      uint64_t sum[16] = {};
      for (int pass = 0; pass < 4; ++pass) {
        for (size_t i = 0; i + 16 <= share; i += 16) {
          for (size_t k = 0; k < 16; ++k) sum[k] ^= from[i + k];
        }
      }
      for (const uint64_t s : sum) sums[static_cast<size_t>(t) * 64] += s;
    };
    const auto since = Clock::now();
    for (int t = 1; t < threads; ++t) workers.emplace_back(read, t);
    read(0);
    for (std::thread& worker : workers) worker.join();
    best = std::max(best, 4e-6 * static_cast<double>(kBytes) / Milliseconds(Clock::now() - since));
  }
  return best;
}

// GFLOP/s of a kernel's own products on data in the first-level cache, on one thread.
double PeakRate(const Kernel& kernel) {
  PackedConvolution layer;
  layer.in_rows = layer.out_rows = 2;
  layer.channels = 32;
  layer.depth = 64;
  layer.columns = 64;
  layer.count = 48;
  Memory memory;
  void* const weights = memory.Allocate(kernel.weight_bytes(layer));
  kernel.pack_weights(std::vector<float>(static_cast<size_t>(2 * 64 * 64), 0.01f).data(), layer, weights);
  layer.weights = weights;
  const void* const features = memory.Allocate((48 + kRowSlack) * 32 * 4);
  float* const sums = static_cast<float*>(memory.Allocate((48 + kRowSlack) * 64 * 4));
  const BlockJob job{&layer, {features, features, nullptr}, 0, 64, 48};
  const unsigned mode = kernel.enter();
  double best = 0;
  for (int run = 0; run < 200; ++run) {
    constexpr int kCalls = 50;
    const auto since = Clock::now();
    for (int call = 0; call < kCalls; ++call) kernel.block(job, sums);
    best = std::max(best, kCalls * 2e-6 * 48 * 128 * 64 / Milliseconds(Clock::now() - since));
  }
  kernel.leave(mode);
  return best;
}

struct Row {
  std::string kernel;
  int threads = 0, views = 0;
  double median_ms = 0, p90_ms = 0, p99_ms = 0, least_ms = 0, paced_p99_ms = 0, psnr_db = 0;
  double mbytes = 0, gflop = 0, bandwidth = 0, peak = 0, bound_ms = 0;
};

Row Measure(Decoder& decoder, const Arguments& arguments, int threads, int views, const std::vector<uint8_t>& truth) {
  constexpr double kFrameMs = 1000.0 / 90;
  Frame frame(decoder, views);
  for (int i = 0; i < 3; ++i) frame.Decode(decoder);
  std::vector<double> warm, paced;
  const auto timed = [&](std::vector<double>& times) {
    const auto since = Clock::now();
    frame.Decode(decoder);
    times.push_back(Milliseconds(Clock::now() - since));
  };
  const auto begin = Clock::now();
  while (warm.size() < 5 || Milliseconds(Clock::now() - begin) < 1e3 * arguments.seconds) timed(warm);
  auto next = Clock::now();
  const auto end = next + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(arguments.seconds));
  while (paced.size() < 5 || Clock::now() < end) {
    next += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::milli>(kFrameMs));
    std::this_thread::sleep_until(next);
    timed(paced);
  }
  Row row{decoder.kernel(), threads, views};
  row.median_ms = Quantile(warm, 0.5);
  row.p90_ms = Quantile(warm, 0.9);
  row.p99_ms = Quantile(warm, 0.99);
  row.least_ms = Quantile(warm, 0);
  row.paced_p99_ms = Quantile(paced, 0.99);
  row.psnr_db = PsnrDb(frame.pixels[0], truth);
  const FrameCost cost = decoder.Cost(views, views == 2);
  row.mbytes = cost.bytes * 1e-6;
  row.gflop = cost.flops * 1e-9;
  return row;
}

std::vector<Row> MeasureAll(const fs::path& file, const Arguments& arguments) {
  DecoderOptions options;
  options.kernel = "portable";
  std::vector<std::vector<uint8_t>> truths;
  for (const int views : {1, 2}) {
    const auto decoder = Decoder::Open(file, options);
    Frame frame(*decoder, views);
    frame.Decode(*decoder);
    truths.push_back(frame.pixels[0]);
  }
  std::vector<Row> rows;
  for (const Kernel* kernel : AllKernels()) {
    if (arguments.kernel != "all" && arguments.kernel != kernel->name) continue;
    if (!kernel->available()) {
      fmt::print(stderr, "this processor cannot run the kernel '{}'\n", kernel->name);
      continue;
    }
    const double peak = PeakRate(*kernel);
    for (const int threads : {1, 2}) {
      const double bandwidth = ReadBandwidth(threads);
      options.kernel = kernel->name;
      options.threads = threads;
      const auto decoder = Decoder::Open(file, options);
      for (const int views : {1, 2}) {
        Row row = Measure(*decoder, arguments, threads, views, truths[static_cast<size_t>(views) - 1]);
        row.bandwidth = bandwidth;
        row.peak = peak * threads;
        row.bound_ms = std::max(row.mbytes / bandwidth, 1e3 * row.gflop / row.peak);
        rows.push_back(row);
      }
    }
  }
  return rows;
}

void PrintJson(const std::vector<Row>& rows) {
  nlohmann::ordered_json json = nlohmann::json::array();
  for (const Row& r : rows) {
    json.push_back({{"kernel", r.kernel},
                    {"threads", r.threads},
                    {"views", r.views},
                    {"mesh", r.views == 2},
                    {"median_ms", r.median_ms},
                    {"p90_ms", r.p90_ms},
                    {"p99_ms", r.p99_ms},
                    {"least_ms", r.least_ms},
                    {"paced_p99_ms", r.paced_p99_ms},
                    {"psnr_db", r.psnr_db},
                    {"mbytes", r.mbytes},
                    {"gflop", r.gflop},
                    {"bandwidth_gb_s", r.bandwidth},
                    {"peak_gflop_s", r.peak},
                    {"bound_ms", r.bound_ms}});
  }
  fmt::print("{}\n", json.dump(2));
}

void PrintText(const std::vector<Row>& rows) {
  fmt::print("{:<10}{:>8}{:>7}{:>10}{:>8}{:>8}{:>8}{:>11}{:>9}{:>8}{:>8}{:>10}\n", "kernel", "threads", "views",
             "median", "p90", "p99", "least", "paced p99", "PSNR", "MB", "GFLOP", "bound");
  for (const Row& r : rows) {
    fmt::print("{:<10}{:>8}{:>7}{:>10.2f}{:>8.2f}{:>8.2f}{:>8.2f}{:>11.2f}{:>9.1f}{:>8.1f}{:>8.2f}{:>10.2f}\n",
               r.kernel, r.threads, r.views, r.median_ms, r.p90_ms, r.p99_ms, r.least_ms, r.paced_p99_ms, r.psnr_db,
               r.mbytes, r.gflop, r.bound_ms);
  }
  fmt::print(
      "\nmilliseconds; two views with the mesh, one without. paced: 90 frames a second, asleep between them.\n"
      "bound: the larger of bytes over measured bandwidth and operations over the kernel's own rate in the cache\n");
}

void MeasureAndPrint(const fs::path& file, const Arguments& arguments) {
  if (arguments.kernel == "gl") return BenchDecodeOnGl(file, arguments.seconds, arguments.json);
  const std::vector<Row> rows = MeasureAll(file, arguments);
  if (arguments.json) {
    PrintJson(rows);
  } else {
    PrintText(rows);
  }
}

}  // namespace

double PsnrDb(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  double squares = 0;
  for (size_t i = 0; i < a.size(); ++i) squares += (a[i] - b[i]) * (a[i] - b[i]);
  return squares == 0 ? 100 : 10 * std::log10(255 * 255 * 0.75 * static_cast<double>(a.size()) / squares);
}

int RunBenchDecode(int argc, const char* const* argv) {
  Arguments arguments;
  std::vector<std::string> kernels = {"all"};
  for (const Kernel* kernel : AllKernels()) kernels.emplace_back(kernel->name);
  kernels.emplace_back("gl");
  Command command("bench decode", "Times decoding at run time: each kernel, on one thread and two, one view and two.",
                  "likeness bench decode --json");
  command.Positional("AVATAR", &arguments.avatar, "avatar file or training folder (default: a random network)", false);
  command.Choice("preset", &arguments.preset, {"multiface", "paper"}, "of the random network");
  command.Option("size", &arguments.size, "texels a side of the random network");
  command.Option("vertices", &arguments.vertices, "of the random network's mesh");
  command.Choice("kernel", &arguments.kernel, kernels,
                 "measure this one alone; gl is the GPU, by OpenGL, and not among all");
  command.Option("seconds", &arguments.seconds, "for each measurement");
  command.Option("json", &arguments.json, "write the results as JSON");
  if (!command.Parse(argc, argv)) return 0;
  if (!(arguments.seconds > 0 && arguments.seconds <= 600)) {
    throw Error("--seconds {}: expected more than 0, and at most 600", arguments.seconds);
  }
  if (arguments.avatar.empty()) {
    const RandomFile file(arguments);
    MeasureAndPrint(file.path, arguments);
  } else {
    MeasureAndPrint(AvatarFile(arguments.avatar), arguments);
  }
  return 0;
}

}  // namespace likeness
