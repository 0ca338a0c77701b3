// likeness render AVATAR OUT.png

#include <fmt/format.h>

#include <charconv>
#include <filesystem>

#include "likeness/app/avatar_file.h"
#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/codes.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/render/portrait.h"
#include "likeness/render/rasterizer.h"
#include "likeness/train/model.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path avatar;
  fs::path out;
  std::string view = "0,0";
  std::string camera;
  fs::path capture;
  CaptureOptions capture_options;
  std::string frame = "mean";
  fs::path code;
  std::string identity;
  std::vector<std::string> conditions;
  int sheet = 0;
  int width = 0;
  int height = 0;
  double focal_px = 0;
  std::string background = "0,0,0";
  int supersample = 3;
  std::string device = "cpu";
};

Command Describe(Arguments& a) {
  Command command("render", "Draws a decoded frame of an avatar, as any of its people.",
                  "likeness render avatars/demo face.png --view 35,10 --frame mean --background 32,34,38");
  command.Positional("AVATAR", &a.avatar, "avatar file, or the folder of its training run");
  command.Positional("OUT", &a.out, "PNG file to write");
  command.Option("view", &a.view, "AZIMUTH,ELEVATION in degrees: towards the subject's left, and up");
  command.Option("camera", &a.camera, "the view of this camera of --capture instead");
  command.Option("capture", &a.capture, "folder of the capture that --camera belongs to");
  command.Option("frame", &a.frame, "mean, a number from 0, or [PERSON/]SEGMENT/FRAME of a training frame");
  command.Option("code", &a.code, "text file with a latent code, instead of --frame");
  command.Option("identity", &a.identity, "which of the avatar's people to draw; default: whose frame it is");
  command.Option("condition", &a.conditions,
                 "NAME=V,V,...: a named condition, instead of the frame's; may be repeated");
  command.Option(
      "sheet", &a.sheet,
      "so many of --identity's frames, spread evenly, each drawn as everybody: rows of one code, columns of one "
      "person");
  command.Option("width", &a.width, "pixels; 0: 768, or the camera's");
  command.Option("height", &a.height, "pixels; 0: 1024, or the camera's");
  command.Option("focal", &a.focal_px, "focal length in pixels; 0: the head fits, or the camera's");
  command.Option("background", &a.background, "R,G,B, each 0 to 255");
  command.Option("supersample", &a.supersample, "n x n samples a pixel");
  command.Option("device", &a.device, "cpu, cuda or cuda:N");
  AddCaptureFlags(&command, &a.capture_options);
  return command;
}

std::array<float, 3> ParseBackground(const std::string& text) {
  std::array<float, 3> colour = {};
  const char *at = text.data(), *const end = at + text.size();
  for (size_t c = 0; c < 3; ++c) {
    const auto [next, error] = std::from_chars(at, end, colour[c]);
    const bool parted = c == 2 ? next == end : next != end && *next == ',';
    if (error != std::errc() || !parted || !(colour[c] >= 0 && colour[c] <= 255)) {
      throw UsageError(fmt::format("--background is R,G,B, each 0 to 255, such as 32,34,38; not '{}'", text));
    }
    at = next + 1;
  }
  return colour;
}

// Where to look from, and how the head stands there.
struct Shot {
  Camera camera;
  RigidTransform world_from_head;
};

Shot PortraitShot(const Arguments& a, const Avatar& avatar, int identity) {
  PortraitOptions options;
  ParseView(a.view, &options.azimuth_deg, &options.elevation_deg);
  options.width = a.width > 0 ? a.width : a.sheet > 0 ? 240 : 768;
  options.height = a.height > 0 ? a.height : a.sheet > 0 ? 320 : 1024;
  options.focal_px = a.focal_px;
  return {PortraitCamera(avatar.identities[identity].vertex_mean, avatar.topology, options), {}};
}

ImageU8 Draw(const AvatarModel& model, std::span<const float> code, const FrameConditions& conditions, const Shot& shot,
             const DrawOptions& options) {
  const DecodedFrame decoded = model.Decode(code, ViewVector(shot.camera, shot.world_from_head), conditions);
  return DrawMesh(decoded.vertices_in_head, model.avatar().topology, decoded.texture, shot.camera, shot.world_from_head,
                  options)
      .colour;
}

// Rows of one code, columns of one person.
ImageU8 DrawSheet(const Arguments& a, const AvatarModel& model, int identity, const DrawOptions& options) {
  const Avatar& avatar = model.avatar();
  std::vector<const FrameCode*> frames;
  for (const FrameCode& code : avatar.codes) {
    if (code.identity == identity) frames.push_back(&code);
  }
  if (frames.empty()) throw Error("{}: knows no codes of frames; --sheet needs them", a.avatar.string());
  const size_t count = std::min(frames.size(), static_cast<size_t>(a.sheet));
  std::vector<ImageU8> rows;
  for (size_t row = 0; row < count; ++row) {
    const FrameCode& frame = *frames[row * frames.size() / count];
    std::vector<Panel> panels;
    for (int person = 0; person < avatar.architecture.identities; ++person) {
      FrameConditions conditions = ConditionsOf(frame);
      conditions.identity = person;
      for (const std::string& assignment : a.conditions) SetCondition(avatar, assignment, &conditions);
      panels.push_back({Draw(model, frame.mu, conditions, PortraitShot(a, avatar, person), options),
                        person == identity ? frame.segment + " " + frame.frame : avatar.identities[person].name});
    }
    rows.push_back(SideBySide(panels));
  }
  return Stacked(rows);
}

Shot CaptureShot(const Arguments& a, const FrameCode* frame) {
  const std::unique_ptr<Capture> capture = OpenCapture(a.capture, a.capture_options);
  Shot shot;
  shot.camera = capture->FindCamera(a.camera);
  if (shot.camera.width == 0) throw Error("camera {} has no image that tells its size", a.camera);
  const int width = a.width > 0 ? a.width : shot.camera.width, height = a.height > 0 ? a.height : shot.camera.height;
  shot.camera = shot.camera.Resized(width, height);
  if (a.focal_px > 0) shot.camera.intrinsics(0, 0) = shot.camera.intrinsics(1, 1) = a.focal_px;
  // A frame that the avatar names stands as it did then; anything else as in the first frame.
  const FrameId pose = frame != nullptr ? FrameId{frame->segment, frame->frame} : capture->frames().front();
  shot.world_from_head = capture->ReadTracked(pose).world_from_head;
  return shot;
}

}  // namespace

int RunRender(int argc, const char* const* argv) {
  Arguments a;
  Command command = Describe(a);
  if (!command.Parse(argc, argv)) return 0;
  if (a.camera.empty() != a.capture.empty()) throw UsageError("--camera and --capture belong together");
  if (a.width < 0 || a.height < 0 || a.width > 16384 || a.height > 16384) {
    throw UsageError("--width and --height are 0 to 16384 pixels");
  }
  if (a.sheet < 0 || a.sheet > 100) throw UsageError("--sheet has 1 to 100 rows");
  if (a.sheet > 0 && (!a.camera.empty() || !a.code.empty())) {
    throw UsageError("--sheet draws frames of the avatar's own from --view; --camera and --code do not go with it");
  }
  DrawOptions options;
  options.supersample = a.supersample;
  options.background = ParseBackground(a.background);
  options.Check();

  const std::unique_ptr<AvatarModel> model = AvatarModel::Load(AvatarFile(a.avatar), a.device);
  const Avatar& avatar = model->avatar();
  const int identity = a.identity.empty() ? 0 : FindIdentity(avatar, a.identity);
  ImageU8 picture;
  if (a.sheet > 0) {
    picture = DrawSheet(a, *model, identity, options);
  } else {
    NamedCode code;
    if (a.code.empty()) {
      code = FindCode(avatar, a.frame, identity);
    } else {
      code.mu = ReadCode(a.code, avatar.architecture.latent);
    }
    FrameConditions conditions;
    if (code.frame != nullptr) conditions = ConditionsOf(*code.frame);
    if (code.frame == nullptr || !a.identity.empty()) conditions.identity = identity;
    for (const std::string& assignment : a.conditions) SetCondition(avatar, assignment, &conditions);
    const Shot shot = a.camera.empty() ? PortraitShot(a, avatar, conditions.identity) : CaptureShot(a, code.frame);
    picture = Draw(*model, code.mu, conditions, shot, options);
  }
  WritePng(a.out, picture);
  WriteFile(fs::path(a.out).replace_extension(".toml"), command.ResolvedToml());
  fmt::print("{}\n", a.out.string());
  return 0;
}

}  // namespace likeness
