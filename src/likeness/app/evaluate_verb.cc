// likeness evaluate AVATAR CAPTURE

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "likeness/app/capture_flags.h"
#include "likeness/app/capture_identity.h"
#include "likeness/app/command.h"
#include "likeness/app/shard_flag.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/random.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/comparison.h"
#include "likeness/train/evaluate.h"
#include "likeness/train/evaluation_parts.h"
#include "likeness/train/evaluation_video.h"
#include "likeness/train/frame_encoders.h"
#include "likeness/train/model.h"
#include "likeness/train/multiface_protocol.h"
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
  fs::path parts;
  std::string shard;
  EvaluationVideoOptions video;
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
  command.Option("parts", &a.parts,
                 "folder through which several processes share the work; the last to finish writes the results");
  AddShardFlag(&command, &a.shard, "measures only the i-th of n parts of the frames, into --parts");
  command.Option("max-images", &a.options.max_images, "most images of each group, spread evenly; 0: all");
  command.Option("pictures-per-group", &a.options.pictures, "how many images of each group are drawn");
  command.Option("supersample", &a.options.supersample, "n x n samples a pixel of the drawing");
  command.Option("seed", &a.options.seed, "which images, where --max-images leaves some out");
  command.Option("video", &a.video.path,
                 "video to write instead (.mp4, .webm): one camera's view of a segment, frame by frame; needs ffmpeg");
  command.Option("camera", &a.video.camera, "of the video; default: the first held-out one");
  command.Option("segment", &a.video.segment, "of the video; default: the first held-out one");
  command.Option("fps", &a.video.frames_per_s, "frames a second of the video");
  command.Option("log", &a.log, "training log for the report; default: log.csv beside the avatar");
  command.Option("times", &a.times, "CSV of `stage,seconds` for the report");
  command.Option("device", &a.device, "cpu, cuda or cuda:N");
  AddCaptureFlags(&command, &a.capture_options);
  return command;
}

// What cannot go together.
void CheckCombination(const Arguments& a, const Shard& shard) {
  const bool files = !a.pictures.empty() || !a.report.empty() || !a.csv.empty() || !a.parts.empty();
  if (a.protocol != "held-out" && files) {
    throw UsageError("--pictures, --report, --csv and --parts belong to --protocol held-out");
  }
  if (!a.video.path.empty() && (files || a.protocol != "held-out")) {
    throw UsageError(
        "--video writes a video and nothing else; leave out --pictures, --report, --csv, --parts and "
        "--protocol");
  }
  if (a.video.path.empty() && (!a.video.camera.empty() || !a.video.segment.empty())) {
    throw UsageError("--camera and --segment say what --video shows; name the video's file with it");
  }
  if (shard.count > 1 && (a.protocol != "held-out" || !a.video.path.empty())) {
    throw UsageError("--video and --protocol multiface are for one process: leave out --shard and the launcher");
  }
  if (shard.count > 1 && a.parts.empty()) {
    throw UsageError("several processes share an evaluation through a folder; name one with --parts DIR");
  }
}

void PrintVideo(const Arguments& a, const EvaluationVideo& video) {
  const GroupResult& figures = video.figures;
  if (a.json) {
    const nlohmann::ordered_json json = {{"video", a.video.path.string()}, {"camera", video.camera},
                                         {"segment", video.segment},       {"frames", figures.images},
                                         {"mse", figures.error.Mean()},    {"ssim", figures.ssim}};
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: {} frames of {} by camera {}; MSE {:.2f}, PSNR {:.2f} dB, SSIM {:.4f}\n", a.video.path.string(),
             figures.images, video.segment, video.camera, figures.error.Mean(), PsnrDb(figures.error.Mean()),
             figures.ssim);
}

}  // namespace

int RunEvaluate(int argc, const char* const* argv) {
  Arguments a;
  Command command = Describe(a);
  if (!command.Parse(argc, argv)) return 0;
  a.options.Check();
  const Shard shard = TakeShard(&a.shard);
  CheckCombination(a, shard);
  const fs::path avatar_file = AvatarFile(a.avatar);
  const std::unique_ptr<AvatarModel> model = AvatarModel::Load(avatar_file, a.device);
  const std::unique_ptr<Capture> capture = OpenCapture(a.capture, a.capture_options);
  const int identity = CaptureIdentity(model->avatar(), a.identity, a.capture);
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
    encode = PerformedFrames(*model, *performer_textures, CaptureIdentity(model->avatar(), "", a.performer), identity);
  }
  if (!a.video.path.empty()) {
    a.video.supersample = a.options.supersample;
    PrintVideo(a, WriteEvaluationVideo(*capture, encode, *model, a.video));
    return 0;
  }
  if (a.protocol == "multiface") {
    const MultifaceFigures figures = EvaluateAsMultiface(textures, encode, *model);
    fmt::print("{}\n", a.json ? ToJson(figures) : ToText(figures));
    return 0;
  }
  EvaluationResult result;
  if (a.parts.empty()) {
    result = Evaluate(*capture, encode, *model, a.options, &textures);
  } else {
    const std::string name =
        fmt::format("{:016x} {} {}", Hash(ReadFile(avatar_file)), identity, a.performer.lexically_normal().string());
    SharedEvaluation shared = EvaluateTogether(*capture, encode, *model, a.options, &textures, a.parts, name, shard);
    if (!shared.result) {
      LogInfo(
          "shard {} of {} is done; {} of {} images are still missing: they come from the other shards, or from this "
          "command with --shard 1/1",
          shard.index, shard.count, shared.images_missing, shared.images);
      return 0;
    }
    result = std::move(*shared.result);
  }

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
