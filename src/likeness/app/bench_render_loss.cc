// likeness bench render-loss

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "likeness/app/benches.h"
#include "likeness/app/command.h"
#include "likeness/train/render/bench.h"
#include "likeness/train/trainer.h"

namespace likeness {
namespace {

RunTime Sum(const RunTime& a, const RunTime& b) { return {a.wall_ms + b.wall_ms, a.processor_ms + b.processor_ms}; }

}  // namespace

int RunBenchRenderLoss(int argc, const char* const* argv) {
  RenderBenchOptions options;
  bool json = false;
  Command command("bench render-loss",
                  "Times the image loss, forward and backward, beside the same in plain LibTorch operations.",
                  "likeness bench render-loss --json");
  command.Option("crops", &options.crops, "in a batch");
  command.Option("crop", &options.crop, "pixels a side");
  command.Option("texture", &options.texture, "texels a side");
  command.Option("runs", &options.runs, "to take the medians of, after one that warms up");
  command.Option("seed", &options.seed, "of cameras and colours");
  command.Option("json", &json, "write the results as JSON");
  if (!command.Parse(argc, argv)) return 0;

  KeepMemory();
  const RenderBenchResult r = BenchRenderLoss(options);
  const RunTime ours = Sum(r.forward, r.backward), plain = Sum(r.plain_forward, r.plain_backward);
  const RunTime ours_all = Sum(ours, r.rasterise), plain_all = Sum(plain, r.rasterise);
  if (json) {
    const auto time = [](const RunTime& t) {
      return nlohmann::ordered_json{{"wall_ms", t.wall_ms}, {"processor_ms", t.processor_ms}};
    };
    const auto ratio = [](const RunTime& a, const RunTime& b) {
      return nlohmann::ordered_json{{"wall", a.wall_ms / b.wall_ms}, {"processor", a.processor_ms / b.processor_ms}};
    };
    const nlohmann::ordered_json result = {{"crops", options.crops},
                                           {"crop", options.crop},
                                           {"texture", options.texture},
                                           {"threads", r.threads},
                                           {"vertices", r.vertices},
                                           {"triangles", r.triangles},
                                           {"covered", r.covered},
                                           {"rasterise", time(r.rasterise)},
                                           {"forward", time(r.forward)},
                                           {"backward", time(r.backward)},
                                           {"plain_forward", time(r.plain_forward)},
                                           {"plain_backward", time(r.plain_backward)},
                                           {"times_as_fast", ratio(plain, ours)},
                                           {"times_as_fast_with_rasterise", ratio(plain_all, ours_all)},
                                           {"gradient_error", r.gradient_error},
                                           {"plain_gradient_error", r.plain_gradient_error}};
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("{} crops of {} x {}, textures of {} x {}, {} triangles, {:.0f}% of the pixels covered, {} threads\n",
             options.crops, options.crop, options.crop, options.texture, options.texture, r.triangles, 100 * r.covered,
             r.threads);
  const auto row = [](const char* name, const RunTime& t) {
    fmt::print("{:<24} {:9.1f} ms {:9.1f} ms of processor time\n", name, t.wall_ms, t.processor_ms);
  };
  row("rasterise (for both)", r.rasterise);
  row("forward", r.forward);
  row("backward", r.backward);
  row("plain LibTorch, forward", r.plain_forward);
  row("plain LibTorch, backward", r.plain_backward);
  fmt::print("{:.1f} times as fast by the clock, {:.1f} by processor time; {:.1f} and {:.1f} with rasterising\n",
             plain.wall_ms / ours.wall_ms, plain.processor_ms / ours.processor_ms, plain_all.wall_ms / ours_all.wall_ms,
             plain_all.processor_ms / ours_all.processor_ms);
  fmt::print("gradients are {:.1e} off those in float64; the plain ones {:.1e}\n", r.gradient_error,
             r.plain_gradient_error);
  return 0;
}

}  // namespace likeness
