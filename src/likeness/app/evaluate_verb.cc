// likeness evaluate AVATAR CAPTURE

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "likeness/app/avatar_file.h"
#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/comparison.h"
#include "likeness/train/evaluate.h"
#include "likeness/train/frame_encoders.h"
#include "likeness/train/model.h"
#include "likeness/train/multiface_protocol.h"
#include "likeness/train/options.h"
#include "likeness/train/report.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path avatar;
  fs::path capture;
  CaptureOptions capture_options;
  std::string identity;
  fs::path performer;
  EvaluationOptions options;
  fs::path pictures;
  fs::path report;
  fs::path log;
  fs::path times;
  fs::path csv;
  std::string protocol = "held-out";
  std::string device = "cpu";
  bool json = false;
};

Command Describe(Arguments& a) {
  Command command("evaluate", "Compares an avatar with a capture, on cameras and segments that it has not seen.",
                  "likeness evaluate avatars/demo captures/demo --pictures pictures --report report.html");
  command.Positional("AVATAR", &a.avatar, "avatar file, or the folder of its training run");
  command.Positional("CAPTURE", &a.capture, "folder of the capture, unwrapped at the avatar's texture size");
  command.Option("identity", &a.identity, "whom of the avatar's people CAPTURE shows; default: whom it is named after");
  command.Option("performer", &a.performer,
                 "capture of another of its people: CAPTURE's frames are drawn by the codes of the same frames there");
  command.Choice("protocol", &a.protocol, {"held-out", "multiface"},
                 "images of cameras and segments kept apart, or the texture error that the Multiface project prints");
  command.Option("json", &a.json, "write the figures as JSON");
  command.Option("csv", &a.csv, "file for the figures as CSV, a row a group");
  command.Option("pictures", &a.pictures, "folder for PNGs of ground truth, ours and difference");
  command.Option("report", &a.report, "HTML file to write the whole evaluation to, pictures included");
  command.Option("max-images", &a.options.max_images, "most images of each group, spread evenly; 0: all");
  command.Option("pictures-per-group", &a.options.pictures, "how many images of each group are drawn");
  command.Option("supersample", &a.options.supersample, "n x n samples a pixel of the drawing");
  command.Option("seed", &a.options.seed, "which images, where --max-images leaves some out");
  command.Option("log", &a.log, "training log for the report; default: log.csv beside the avatar");
  command.Option("times", &a.times, "CSV of `stage,seconds` for the report");
  command.Option("device", &a.device, "cpu, cuda or cuda:N");
  AddCaptureFlags(&command, &a.capture_options);
  return command;
}

// The avatar's person of a capture; `name` may be empty.
int IdentityOf(const Avatar& avatar, const std::string& name, const fs::path& capture) {
  if (name.empty() && avatar.identities.size() == 1) return 0;
  return FindIdentity(avatar, name.empty() ? PersonName(capture) : name);
}

}  // namespace

int RunEvaluate(int argc, const char* const* argv) {
  Arguments a;
  Command command = Describe(a);
  if (!command.Parse(argc, argv)) return 0;
  a.options.Check();
  if (a.protocol != "held-out" && (!a.pictures.empty() || !a.report.empty() || !a.csv.empty())) {
    throw UsageError("--pictures, --report and --csv belong to --protocol held-out");
  }
  const fs::path avatar_file = AvatarFile(a.avatar);
  const std::unique_ptr<AvatarModel> model = AvatarModel::Load(avatar_file, a.device);
  const std::unique_ptr<Capture> capture = OpenCapture(a.capture, a.capture_options);
  const int identity = IdentityOf(model->avatar(), a.identity, a.capture);
  CheckHeldOut(model->avatar(), *capture, identity);
  const TextureSet textures(*capture, model->avatar().architecture.texture_size);
  // Read before the work starts, so that a wrong file is not found at its end.
  const fs::path default_log = avatar_file.parent_path() / "log.csv";
  std::optional<LossLog> log;
  if (!a.log.empty() || fs::exists(default_log)) log = ReadLossLog(a.log.empty() ? default_log : a.log);
  const std::vector<StageTime> stages = a.times.empty() ? std::vector<StageTime>() : ReadStageTimes(a.times);

  std::unique_ptr<Capture> performer;
  std::optional<TextureSet> performer_textures;
  FrameEncoder encode;
  if (a.performer.empty()) {
    encode = OwnFrames(*model, textures, identity);
  } else {
    performer = OpenCapture(a.performer, a.capture_options);
    performer_textures.emplace(*performer, textures.size());
    encode = PerformedFrames(*model, *performer_textures, IdentityOf(model->avatar(), "", a.performer), identity);
  }
  if (a.protocol == "multiface") {
    const MultifaceFigures figures = EvaluateAsMultiface(textures, encode, *model);
    fmt::print("{}\n", a.json ? ToJson(figures) : ToText(figures));
    return 0;
  }
  const EvaluationResult result = Evaluate(*capture, encode, *model, a.options, &textures);

  nlohmann::ordered_json json = nlohmann::ordered_json::parse(ToJson(result));
  std::string text = ToText(result);
  if (!a.pictures.empty()) {
    for (const fs::path& path : WriteComparisons(result.pictures, a.pictures)) {
      json["pictures"].push_back(path.string());
    }
    WriteFile(a.pictures / "evaluation.json", json.dump(2) + "\n");
    WriteFile(a.pictures / "evaluate.toml", command.ResolvedToml());
    text += fmt::format("\npictures   {}\n", a.pictures.string());
  }
  if (!a.csv.empty()) {
    WriteFile(a.csv, ToCsv(result));
    text += fmt::format("CSV        {}\n", a.csv.string());
  }
  if (!a.report.empty()) {
    WriteFile(a.report, ReportHtml({a.avatar.string(), model->avatar(), *capture, result, log, stages, identity}));
    WriteFile(fs::path(a.report).replace_extension(".toml"), command.ResolvedToml());
    json["report"] = a.report.string();
    text += fmt::format("report     {}\n", a.report.string());
  }
  fmt::print("{}\n", a.json ? json.dump(2) : text);
  return 0;
}

}  // namespace likeness
