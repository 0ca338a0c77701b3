// likeness train CAPTURE OUT

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/launcher.h"
#include "likeness/base/log.h"
#include "likeness/base/progress.h"
#include "likeness/train/fine_tuning.h"
#include "likeness/train/ops/precision.h"
#include "likeness/train/texel_weights.h"
#include "likeness/train/trainer.h"

namespace likeness {

namespace {

struct Arguments {
  TrainOptions options;
  bool json = false;
};

Command Describe(Arguments& arguments) {
  TrainOptions& o = arguments.options;
  Command command("train", "Trains an avatar on an unwrapped capture.",
                  "likeness train captures/demo avatars/demo --size 256 --minutes 7");
  command.Positional("CAPTURE", &o.capture, "folder of the capture, unwrapped");
  command.Positional("OUT", &o.out, "folder for avatar.safetensors, checkpoints, log.csv and TensorBoard events");
  command.Option("also", &o.also, "another person's capture, for one network that shows both; may be repeated");
  command.Choice("preset", &o.preset, PresetNames(), "recipe that sets the defaults of all other options");
  command.Option("size", &o.size, "texels a side; 0: the largest that the capture is unwrapped at");
  command.Option("latent", &o.latent, "values in a code");
  command.Choice("model", &o.model, ModelKindNames(), "what maps frames to codes and back");
  command.Choice("conditioning", &o.conditioning, ConditioningNames(), "how the view enters the decoder");
  command.Choice("normalisation", &o.normalisation, NormalisationNames(), "of the weights or features");
  command.Choice("untied-bias", &o.untied_bias, UntiedBiasNames(), "which convolutions have a bias for every texel");
  command.Choice("layout", &o.layout, LayoutNames(), "widths of the layers");
  command.Choice("upsampling", &o.upsampling, UpsamplingNames(), "how the decoder's convolutions double the side");
  command.Option("residual", &o.residual, "a residual convolution after each convolution");
  std::vector<std::string> identities = IdentityConditioningNames();
  identities.insert(identities.begin(), "auto");
  command.Choice("identity", &o.identity, identities,
                 "how the network is told whose face it is; auto: one-hot for several people");
  command.Option("identity-size", &o.identity_size, "values of a learned identity vector");
  command.Option("condition", &o.conditions, "tell the network CAPTURE/conditions/TEXT.csv; may be repeated");
  command.Choice("geometry", &o.geometry, GeometryNames(),
                 "the mesh to predict; tracked: as the capture's meshes are, which likeness proxy makes coarser");
  command.Option("colours", &o.colours, "a colour gain and bias for each camera but the first");
  command.Option("colour-rate", &o.colour_rate, "their learning rate, times the network's");
  command.Option("iterations", &o.iterations, "end after so many steps; 0: no such limit");
  command.Option("minutes", &o.minutes, "end after so much training; 0: no such limit");
  command.Option("batch", &o.batch, "textures in a step, of each process");
  command.Option("views", &o.views, "textures of one frame in a step, which is encoded once for them");
  command.Option("learning-rate", &o.learning_rate, "of Adam, at its highest");
  command.Choice("schedule", &o.schedule, ScheduleNames(), "of the learning rate over the run");
  command.Option("warmup", &o.warmup, "share of the run in which the learning rate rises");
  command.Option("beta2", &o.beta2, "Adam's decay of squared gradients");
  command.Option("clip", &o.clip, "largest norm of the gradient; 0: any");
  command.Option("average", &o.average, "share of the run that the final weights are a mean over; 0: the last ones");
  command.Choice("texels", &o.texels, TexelWeightingNames(), "what a texel counts in the loss");
  command.Option("loss.texture", &o.loss.texture, "weight of the texture term");
  command.Option("loss.geometry", &o.loss.geometry, "weight of the vertex term");
  command.Option("loss.kl", &o.loss.kl, "weight of the code's divergence from a normal distribution");
  command.Option("loss.image", &o.loss.image, "weight of the drawn picture's error over head pixels; 0: none is drawn");
  command.Option("crop", &o.crop, "side of the pieces of pictures for it, pixels, about random head pixels; 0: whole");
  command.Option("silhouettes", &o.silhouettes, "the image loss moves the mesh's outlines, too");
  command.Option("from", &o.from, "avatar to go on from, file or folder; what decides the network is taken from it");
  command.Option("seed", &o.seed, "of weights, order and noise");
  command.Option("device", &o.device, "cpu, cuda or cuda:N");
  command.Choice("precision", &o.precision, PrecisionNames(), "number format of the convolutions");
  command.Option("save-minutes", &o.save_minutes, "between checkpoints; 0: after every step");
  command.Option("keep", &o.keep, "checkpoints that stay");
  command.Option("log-every", &o.log_every, "iterations between rows of log.csv");
  command.Option("workers", &o.workers, "threads that read textures ahead");
  command.Option("cache-mb", &o.cache_mb, "memory for textures, packed; the others are read again when needed");
  command.Option("cache-dir", &o.cache_dir,
                 "folder for a file of the textures that --cache-mb does not hold; it goes with the run");
  command.Option("peer-timeout", &o.peer_timeout_s, "seconds until a process that does not answer ends the others");
  command.Option("resume", &o.resume, "go on from OUT's newest checkpoint");
  AddCaptureFlags(&command, &o.capture_options);
  command.Option("json", &arguments.json, "write the summary as JSON");
  return command;
}

void PrintSummary(const TrainOptions& options, const TrainResult& result, bool json) {
  if (json) {
    const nlohmann::ordered_json summary = {{"finished", result.finished},
                                            {"avatar", result.avatar.string()},
                                            {"iterations", result.iterations},
                                            {"samples", result.samples},
                                            {"skipped", result.skipped},
                                            {"elapsed_s", result.elapsed_s},
                                            {"samples_per_s", result.samples_per_s},
                                            {"waiting", result.waiting},
                                            {"cache_mb", static_cast<double>(result.cache_bytes) / (1 << 20)},
                                            {"cache_file_mb", static_cast<double>(result.cache_file_bytes) / (1 << 20)},
                                            {"loss", result.loss},
                                            {"loss_texture", result.loss_texture},
                                            {"loss_geometry", result.loss_geometry},
                                            {"loss_kl", result.loss_kl},
                                            {"loss_image", result.loss_image}};
    fmt::print("{}\n", summary.dump(2));
    return;
  }
  fmt::print("{} iterations, {} textures in {}; {:.1f} textures/s, {:.1f}% of the time waiting for data\n",
             result.iterations, result.samples, FormatDuration(result.elapsed_s), result.samples_per_s,
             100 * result.waiting);
  if (result.waiting > 0.05)
    fmt::print("more --workers, a larger --cache-mb or a --cache-dir would shorten the waiting\n");
  const std::string image = options.loss.image > 0 ? fmt::format(", image {:.5f}", result.loss_image) : "";
  fmt::print("loss {:.5f}: texture {:.5f}, geometry {:.5f}, KL {:.4f}{}\n", result.loss, result.loss_texture,
             result.loss_geometry, result.loss_kl, image);
  if (result.skipped > 0) fmt::print("{} steps were skipped as a value was not finite\n", result.skipped);
  if (result.finished) {
    fmt::print("avatar: {}\n", result.avatar.string());
  } else {
    fmt::print("stopped; go on with the same command: likeness train {} {} --config {}\n", options.capture.string(),
               options.out.string(), (options.out / "train.toml").string());
  }
}

}  // namespace

int RunTrain(int argc, const char* const* argv) {
  Arguments arguments;
  if (!Describe(arguments).Parse(argc, argv)) return 0;
  // A second reading puts the preset's values, and the network of --from, in place of the defaults, and what was given
  // on top.
  const std::filesystem::path from = arguments.options.from;
  arguments.options = PresetOptions(arguments.options.preset);
  if (!from.empty()) AdoptNetwork(LoadAvatar(AvatarFile(from)), &arguments.options);
  Command command = Describe(arguments);
  if (!command.Parse(argc, argv)) return 0;
  arguments.options.Check();
  if (!from.empty()) arguments.options.from = AvatarFile(from);

  // One of several processes speaks for all.
  const bool speaks = ReadLauncher().rank == 0;
  if (!speaks) SetQuiet(true);
  KeepMemory();
  const InterruptScope interrupt;
  const TrainResult result = Train(
      arguments.options, [&] { return interrupt.Requested(); }, command.ResolvedToml());
  if (speaks) PrintSummary(arguments.options, result, arguments.json);
  return result.finished ? 0 : 1;
}

}  // namespace likeness
