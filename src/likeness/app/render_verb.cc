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
  int width = 0;
  int height = 0;
  double focal_px = 0;
  std::string background = "0,0,0";
  int supersample = 3;
  std::string device = "cpu";
};

Command Describe(Arguments& a) {
  Command command("render", "Draws a decoded frame of an avatar.",
                  "likeness render avatars/demo face.png --view 35,10 --frame mean --background 32,34,38");
  command.Positional("AVATAR", &a.avatar, "avatar file, or the folder of its training run");
  command.Positional("OUT", &a.out, "PNG file to write");
  command.Option("view", &a.view, "AZIMUTH,ELEVATION in degrees: towards the subject's left, and up");
  command.Option("camera", &a.camera, "the view of this camera of --capture instead");
  command.Option("capture", &a.capture, "folder of the capture that --camera belongs to");
  command.Option("frame", &a.frame, "mean, a number from 0, or SEGMENT/FRAME of a training frame");
  command.Option("code", &a.code, "text file with a latent code, instead of --frame");
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

Shot PortraitShot(const Arguments& a, const Avatar& avatar) {
  PortraitOptions options;
  ParseView(a.view, &options.azimuth_deg, &options.elevation_deg);
  options.width = a.width > 0 ? a.width : 768;
  options.height = a.height > 0 ? a.height : 1024;
  options.focal_px = a.focal_px;
  return {PortraitCamera(avatar.vertex_mean, avatar.topology, options), {}};
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
  DrawOptions options;
  options.supersample = a.supersample;
  options.background = ParseBackground(a.background);
  options.Check();

  const std::unique_ptr<AvatarModel> model = AvatarModel::Load(AvatarFile(a.avatar), a.device);
  const Avatar& avatar = model->avatar();
  NamedCode code;
  if (a.code.empty()) {
    code = FindCode(avatar, a.frame);
  } else {
    code.mu = ReadCode(a.code, avatar.architecture.latent);
  }
  const Shot shot = a.camera.empty() ? PortraitShot(a, avatar) : CaptureShot(a, code.frame);
  const DecodedFrame decoded = model->Decode(code.mu, ViewVector(shot.camera, shot.world_from_head));
  const Rendering rendering =
      DrawMesh(decoded.vertices_in_head, avatar.topology, decoded.texture, shot.camera, shot.world_from_head, options);
  WritePng(a.out, rendering.colour);
  WriteFile(fs::path(a.out).replace_extension(".toml"), command.ResolvedToml());
  fmt::print("{}\n", a.out.string());
  return 0;
}

}  // namespace likeness
