// likeness bench train [CAPTURE]

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "likeness/app/benches.h"
#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/train/bench.h"
#include "likeness/train/ops/precision.h"
#include "likeness/train/trainer.h"

namespace likeness {
namespace {

struct Arguments {
  TrainBenchOptions options;
  bool json = false;
};

Command Describe(Arguments& arguments) {
  TrainOptions& o = arguments.options.train;
  Command command("bench train",
                  "Times training steps on random data that lies in memory, or on a capture, loader included.",
                  "likeness bench train --preset multiface --size 512 --batch 8 --json");
  command.Positional("CAPTURE", &o.capture, "folder of an unwrapped capture; without: random data", false);
  command.Choice("preset", &o.preset, PresetNames(), "recipe and network, as of likeness train");
  command.Option("size", &o.size, "texels a side; 0: 512, or the largest of the capture");
  command.Option("batch", &o.batch, "textures in a step");
  command.Option("views", &o.views, "textures of one frame in a step, which is encoded once for them");
  command.Choice("precision", &o.precision, PrecisionNames(), "number format of the convolutions");
  command.Option("vertices", &arguments.options.vertex_count, "of the random mesh");
  command.Option("steps", &arguments.options.steps, "to measure, after two that warm up");
  command.Option("layers", &arguments.options.layers, "time each layer on its own, too");
  command.Option("workers", &o.workers, "threads that read textures ahead");
  command.Option("cache-mb", &o.cache_mb, "memory for textures, packed; the others are read again when needed");
  command.Option("cache-dir", &o.cache_dir,
                 "folder for a file of the textures that --cache-mb does not hold; it goes with the run");
  command.Option("loss.image", &o.loss.image, "weight of the image loss; of a CAPTURE alone");
  command.Option("crop", &o.crop, "side of the pieces of pictures for it, pixels; 0: whole");
  command.Option("seed", &o.seed, "of weights and order");
  AddCaptureFlags(&command, &o.capture_options);
  command.Option("json", &arguments.json, "write the results as JSON");
  return command;
}

void PrintJson(const TrainOptions& options, const TrainBenchResult& r) {
  nlohmann::ordered_json json = {{"preset", options.preset},
                                 {"texture_size", r.architecture.texture_size},
                                 {"batch", options.batch},
                                 {"views", options.views},
                                 {"parameters", r.parameters},
                                 {"kernels", r.kernels},
                                 {"threads", r.threads},
                                 {"samples_per_s", r.samples_per_s},
                                 {"step_ms", r.step_ms},
                                 {"step_ms_quartiles", {r.step_ms_low, r.step_ms_high}},
                                 {"processor_ms", r.processor_ms},
                                 {"loader_wait", r.waiting},
                                 {"memory_peak_mb", r.memory_peak_mb},
                                 {"gflop_per_sample", r.gflop_per_sample},
                                 {"peak_gflops", r.peak_gflops},
                                 {"share_of_peak", r.share_of_peak}};
  for (const LayerTime& layer : r.layers) {
    json["layers"][layer.name] = {
        {"forward_ms", layer.forward_ms}, {"backward_ms", layer.backward_ms}, {"gflop", layer.gflop}};
  }
  fmt::print("{}\n", json.dump(2));
}

void PrintText(const TrainOptions& options, const TrainBenchResult& r) {
  fmt::print("{} at {} x {}, batch {}, {} views a frame: {:.1f} million parameters, {} kernels, {} threads\n",
             options.preset, r.architecture.texture_size, r.architecture.texture_size, options.batch, options.views,
             static_cast<double>(r.parameters) * 1e-6, r.kernels, r.threads);
  fmt::print("{:8.1f} samples/s\n", r.samples_per_s);
  fmt::print("{:8.1f} ms a step (quartiles {:.1f} and {:.1f}), {:.1f} ms of processor time\n", r.step_ms, r.step_ms_low,
             r.step_ms_high, r.processor_ms);
  fmt::print("{:8.1f} % of the time waiting for the loader\n", 100 * r.waiting);
  fmt::print("{:8.0f} MB of memory at most\n", r.memory_peak_mb);
  fmt::print("{:8.1f} % of {:.0f} GFLOP/s, a large float32 matrix product's rate; {:.2f} GFLOP a sample\n",
             100 * r.share_of_peak, r.peak_gflops, r.gflop_per_sample);
  for (const LayerTime& layer : r.layers) {
    fmt::print("{:8.2f} ms forward {:8.2f} ms backward {:8.1f} GFLOP/s  {}\n", layer.forward_ms, layer.backward_ms,
               layer.gflop / (layer.forward_ms + layer.backward_ms) * 1e3, layer.name);
  }
}

}  // namespace

int RunBenchTrain(int argc, const char* const* argv) {
  Arguments arguments;
  const auto defaults = [&](const std::string& preset) {
    arguments.options.train = PresetOptions(preset);
    arguments.options.train.batch = 8;
    arguments.options.train.views = 1;
  };
  defaults(arguments.options.train.preset);
  if (!Describe(arguments).Parse(argc, argv)) return 0;
  // A second reading puts the preset's values in place of the defaults, and what was given on top.
  defaults(arguments.options.train.preset);
  if (!Describe(arguments).Parse(argc, argv)) return 0;
  TrainBenchOptions& options = arguments.options;
  options.on_capture = !options.train.capture.empty();
  if (!options.on_capture) options.train.capture = "-";
  options.train.out = "-";

  KeepMemory();
  const TrainBenchResult result = BenchTrain(options);
  if (arguments.json) {
    PrintJson(options.train, result);
  } else {
    PrintText(options.train, result);
  }
  return 0;
}

}  // namespace likeness
