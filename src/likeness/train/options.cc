#include "likeness/train/options.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/train/ops/precision.h"
#include "likeness/train/texel_weights.h"

namespace likeness {

namespace {

void InRange(const char* name, double value, double least, double most) {
  if (!(value >= least && value <= most)) throw Error("--{} is {}; expected {} to {}", name, value, least, most);
}

}  // namespace

void TrainOptions::Check() const {
  const std::vector<std::string>& presets = PresetNames();
  if (std::find(presets.begin(), presets.end(), preset) == presets.end()) {
    throw Error("--preset is '{}'; known are {}", preset, fmt::join(presets, ", "));
  }
  const std::vector<std::string>& schedules = ScheduleNames();
  if (std::find(schedules.begin(), schedules.end(), schedule) == schedules.end()) {
    throw Error("--schedule is '{}'; known are {}", schedule, fmt::join(schedules, ", "));
  }
  InRange("size", size, 0, 4096);
  InRange("identity-size", identity_size, 1, 1024);
  for (const std::string& name : conditions) {
    if (!IsConditionName(name)) throw Error("--condition is '{}'; expected letters, digits, '-' and '_'", name);
  }
  InRange("iterations", static_cast<double>(iterations), 0, 1e9);
  InRange("minutes", minutes, 0, 1e6);
  if (iterations == 0 && minutes == 0) throw Error("--iterations and --minutes are both 0; the run would never end");
  InRange("batch", batch, 1, 4096);
  InRange("views", views, 1, batch);
  if (batch % views != 0) throw Error("--batch is {}, no multiple of --views {}", batch, views);
  InRange("learning-rate", learning_rate, 1e-9, 1);
  InRange("colour-rate", colour_rate, 0, 1e6);
  InRange("warmup", warmup, 0, 1);
  InRange("beta2", beta2, 0, 0.999999);
  InRange("clip", clip, 0, 1e9);
  InRange("average", average, 0, 1);
  ParseTexelWeighting(texels);
  InRange("loss.texture", loss.texture, 0, 1e9);
  InRange("loss.geometry", loss.geometry, 0, 1e9);
  InRange("loss.kl", loss.kl, 0, 1e9);
  InRange("loss.image", loss.image, 0, 1e9);
  if (crop != 0) InRange("crop", crop, 8, 16384);
  PrecisionFrom(precision);
  InRange("save-minutes", save_minutes, 0, 1e6);
  InRange("keep", keep, 1, 1e6);
  InRange("log-every", log_every, 1, 1e6);
  InRange("peer-timeout", peer_timeout_s, 1, 1e6);
  InRange("workers", workers, 1, 64);
  InRange("cache-mb", cache_mb, 0, 1e7);
}

std::vector<std::string> TrainOptions::PeopleNames() const {
  std::vector<std::string> names = {PersonName(capture)};
  for (const std::string& folder : also) names.push_back(PersonName(folder));
  return names;
}

std::vector<std::string> TrainOptions::Fingerprint() const {
  std::vector<std::string> lines;
  const auto add = [&](const char* name, const auto& value) { lines.push_back(fmt::format("{} = {}", name, value)); };
  add("size", size);
  add("latent", latent);
  add("model", model);
  add("conditioning", conditioning);
  add("normalisation", normalisation);
  add("untied-bias", untied_bias);
  add("layout", layout);
  add("upsampling", upsampling);
  add("residual", residual);
  add("geometry", geometry);
  add("people", fmt::format("{}", fmt::join(PeopleNames(), " ")));
  add("identity", identity);
  add("identity-size", identity_size);
  add("conditions", fmt::format("{}", fmt::join(conditions, " ")));
  add("colours", colours);
  add("colour-rate", colour_rate);
  add("iterations", iterations);
  add("minutes", minutes);
  add("batch", batch);
  add("views", views);
  add("learning-rate", learning_rate);
  add("schedule", schedule);
  add("warmup", warmup);
  add("precision", precision);
  add("beta2", beta2);
  add("clip", clip);
  add("average", average);
  add("texels", texels);
  add("loss.texture", loss.texture);
  add("loss.geometry", loss.geometry);
  add("loss.kl", loss.kl);
  add("loss.image", loss.image);
  add("crop", crop);
  add("silhouettes", silhouettes);
  add("from", from.string());
  add("seed", seed);
  return lines;
}

std::string PersonName(const std::filesystem::path& capture) {
  const std::filesystem::path whole = std::filesystem::absolute(capture).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

const std::vector<std::string>& PresetNames() {
  static const std::vector<std::string> names = {"demo", "paper", "multiface"};
  return names;
}

const std::vector<std::string>& ScheduleNames() {
  static const std::vector<std::string> names = {"constant", "cosine", "hold"};
  return names;
}

TrainOptions PresetOptions(const std::string& preset) {
  TrainOptions options;
  options.preset = preset;
  if (preset == "paper" || preset == "multiface") {
    options.iterations = 200'000;
    options.minutes = 0;
    options.views = 1;
    options.texels = "all";
    options.learning_rate = 3e-4;
    options.schedule = "constant";
    options.warmup = 0;
    options.clip = 0;
    options.average = 0;
    options.loss.geometry = 1;
  }
  if (preset == "multiface") {
    options.latent = 256;
    options.normalisation = "weight-tensor";
    options.untied_bias = "decoder+channel";
    options.layout = "multiface";
    options.colours = true;
    options.clip = 10;
  }
  options.Check();
  return options;
}

Architecture ArchitectureFrom(const TrainOptions& options, int size, int vertex_count) {
  Architecture architecture;
  architecture.preset = options.preset;
  architecture.model = ParseModelKind(options.model);
  architecture.texture_size = size;
  architecture.vertex_count = vertex_count;
  architecture.latent = options.latent;
  architecture.conditioning = ParseConditioning(options.conditioning);
  architecture.normalisation = ParseNormalisation(options.normalisation);
  architecture.untied_bias = ParseUntiedBias(options.untied_bias);
  architecture.layout = ParseLayout(options.layout);
  architecture.upsampling = ParseUpsampling(options.upsampling);
  architecture.residual = options.residual;
  architecture.geometry = ParseGeometry(options.geometry);
  architecture.identities = 1 + static_cast<int>(options.also.size());
  architecture.identity = options.identity != "auto"    ? ParseIdentityConditioning(options.identity)
                          : architecture.identities > 1 ? IdentityConditioning::kOneHot
                                                        : IdentityConditioning::kNone;
  if (architecture.identity == IdentityConditioning::kLearned) architecture.identity_size = options.identity_size;
  architecture.Check();
  return architecture;
}

}  // namespace likeness
