// likeness fit-arkit AVATAR CAPTURE

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "likeness/app/capture_flags.h"
#include "likeness/app/capture_identity.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/arkit_fit.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/capture/coefficient_table.h"
#include "likeness/decode/decoder.h"
#include "likeness/geometry/mesh_distance.h"
#include "likeness/simulate/head.h"
#include "likeness/train/encode_frames.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path avatar;
  fs::path capture;
  CaptureOptions capture_options;
  fs::path coefficients;
  fs::path out;
  std::string identity;
  ArkitFitOptions options;
  std::string device = "cpu";
  bool json = false;
};

Command Describe(Arguments& a) {
  Command command("fit-arkit",
                  "Fits a map from ARKit coefficients to the avatar's codes and puts it into the avatar file, so that "
                  "likeness drive can follow any Live Link Face recording.",
                  "likeness fit-arkit avatars/demo captures/demo");
  command.Positional("AVATAR", &a.avatar, "avatar file, or the folder of its training run");
  command.Positional("CAPTURE", &a.capture,
                     "unwrapped capture whose frames have coefficients; its held-out segments judge the map");
  command.Option("coefficients", &a.coefficients,
                 "CSV of segment,frame and the 52 coefficients; default: truth/performance.csv of a simulated capture");
  command.Option("out", &a.out, "avatar file to write; default: AVATAR itself");
  command.Option("folds", &a.options.folds, "parts of the segments, each predicted from the others to choose the fit");
  command.Option("most-scored", &a.options.most_scored, "most frames whose meshes are compared to choose the fit");
  command.Option("identity", &a.identity, "whom of the avatar's people CAPTURE shows; default: whom it is named after");
  command.Option("device", &a.device, "cpu, cuda or cuda:N");
  command.Option("json", &a.json, "write the figures as JSON");
  AddCaptureFlags(&command, &a.capture_options);
  return command;
}

using Table = std::map<FrameId, std::vector<float>>;

std::vector<FrameId> WithCoefficients(std::vector<FrameId> frames, const Table& table) {
  std::erase_if(frames, [&](const FrameId& frame) { return !table.contains(frame); });
  return frames;
}

// Frames of one part of the capture with their codes.
struct Part {
  std::vector<FrameId> ids;
  std::vector<ArkitFrame> frames;
};

Part Encode(const AvatarModel& model, const TextureSet& textures, const std::vector<FrameId>& ids, int identity,
            const Table& table) {
  Part part{ids, {}};
  if (ids.empty()) return part;
  const Performance encoded = EncodeFrames(model, textures, ids, identity, 30);
  for (size_t i = 0; i < ids.size(); ++i) {
    const std::span<const float> code = encoded.Code(static_cast<int>(i));
    part.frames.push_back({ids[i].segment, table.at(ids[i]), {code.begin(), code.end()}});
  }
  return part;
}

// Mean distances to the tracked vertices over frames, mm.
struct Errors {
  size_t frames = 0;
  double map = 0, encoder = 0, mean_face = 0;
};

class Judge {
 public:
  Judge(const Capture& capture, const Vertices& mean, const MeshDecoder& decode, const std::vector<int>& vertices)
      : capture_(capture), mean_(mean), decode_(decode), vertices_(vertices) {}

  Errors Of(const Part& part, const ArkitMap& map) const {
    Errors errors;
    errors.frames = part.frames.size();
    for (size_t i = 0; i < part.frames.size(); ++i) {
      const Vertices truth = capture_.ReadTracked(part.ids[i]).vertices_in_head;
      errors.map += MeanDistance(decode_(map.CodeOf(part.frames[i].coefficients)), truth, vertices_);
      errors.encoder += MeanDistance(decode_(part.frames[i].code), truth, vertices_);
      errors.mean_face += MeanDistance(mean_, truth, vertices_);
    }
    for (double* sum : {&errors.map, &errors.encoder, &errors.mean_face}) {
      *sum /= static_cast<double>(std::max<size_t>(1, errors.frames));
    }
    return errors;
  }

 private:
  const Capture& capture_;
  const Vertices& mean_;
  const MeshDecoder& decode_;
  const std::vector<int>& vertices_;
};

nlohmann::ordered_json ToJson(const Errors& errors) {
  return {{"frames", errors.frames},
          {"map_mm", errors.map},
          {"encoder_mm", errors.encoder},
          {"mean_face_mm", errors.mean_face}};
}

std::string Row(const char* name, const Errors& errors) {
  if (errors.frames == 0) return fmt::format("{:<18} {:>7}        -           -           -\n", name, 0);
  return fmt::format("{:<18} {:>7} {:>8.3f} mm {:>8.3f} mm {:>8.3f} mm\n", name, errors.frames, errors.map,
                     errors.encoder, errors.mean_face);
}

void Print(const Arguments& a, const ArkitFit& fit, const Errors& training, const Errors& held_out) {
  if (a.json) {
    nlohmann::ordered_json json = {{"avatar", a.out.string()},      {"terms", fit.best.terms},
                                   {"strength", fit.best.strength}, {"cross_validated_mm", fit.best.error_mm},
                                   {"training", ToJson(training)},  {"held_out_segments", ToJson(held_out)}};
    for (const ArkitCandidate& c : fit.candidates) {
      json["candidates"].push_back({{"terms", c.terms}, {"strength", c.strength}, {"error_mm", c.error_mm}});
    }
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: a map of {} terms ({}), ridge {}\n\n", a.out.string(), fit.map.terms.size(), fit.best.terms,
             fit.best.strength);
  fmt::print("{:<18} {:>7} {:>11} {:>11} {:>11}\n", "", "frames", "map", "encoder", "mean face");
  fmt::print("{}{}", Row("training", training), Row("held_out_segments", held_out));
  fmt::print(
      "\nmean distance to the tracked vertices; cross-validated over training segments, to the encoder's mesh: "
      "{:.3f} mm\n",
      fit.best.error_mm);
}

}  // namespace

int RunFitArkit(int argc, const char* const* argv) {
  Arguments a;
  Command command = Describe(a);
  if (!command.Parse(argc, argv)) return 0;
  a.options.Check();
  const fs::path avatar_file = AvatarFile(a.avatar);
  if (a.out.empty()) a.out = avatar_file;
  if (a.coefficients.empty()) a.coefficients = TrueCoefficients(a.capture);
  if (!Exists(a.coefficients)) {
    throw FileError(a.coefficients,
                    "there are no coefficients; name a CSV of segment,frame and the 52 with --coefficients");
  }
  const auto& names = ExpressionNames();
  const Table table = ReadCoefficientTable(a.coefficients, names);

  const std::unique_ptr<AvatarModel> model = AvatarModel::Load(avatar_file, a.device);
  const std::unique_ptr<Capture> capture = OpenCapture(a.capture, a.capture_options);
  const TextureSet textures(*capture, model->avatar().architecture.texture_size);
  const int identity = CaptureIdentity(model->avatar(), a.identity, a.capture);
  const auto encode = [&](const std::vector<FrameId>& frames) {
    return Encode(*model, textures, WithCoefficients(frames, table), identity, table);
  };
  const Part training = encode(capture->TrainingFrames()), held_out = encode(capture->HeldOutFrames());
  if (training.frames.empty()) {
    throw FileError(a.coefficients, fmt::format("has no line of a training frame of {}", a.capture.string()));
  }
  const size_t known = training.frames.size() + held_out.frames.size();
  if (known < capture->frames().size()) {
    LogInfo("{} of {} frames have no coefficients and are left out", capture->frames().size() - known,
            capture->frames().size());
  }

  DecoderOptions decoder_options;
  decoder_options.person = identity;
  const std::unique_ptr<Decoder> decoder = Decoder::Open(avatar_file, decoder_options);
  const MeshDecoder decode = [&](std::span<const float> code) {
    Vertices mesh(decoder->architecture().vertex_count, 3);
    decoder->Decode(code, {}, {mesh.data()});
    return mesh;
  };
  const std::vector<int> vertices = VerticesInTriangles(capture->topology());
  const ArkitFit fit = FitArkitMap({names.begin(), names.end()}, training.frames, decode, vertices, a.options);
  WriteWithArkitMap(a.out, SafetensorsFile(avatar_file), fit.map);
  const Judge judge(*capture, model->avatar().identities[static_cast<size_t>(identity)].vertex_mean, decode, vertices);
  Print(a, fit, judge.Of(training, fit.map), judge.Of(held_out, fit.map));
  return 0;
}

}  // namespace likeness
