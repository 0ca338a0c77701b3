// likeness encode AVATAR CAPTURE OUT

#include <fmt/format.h>

#include <filesystem>

#include "likeness/app/capture_flags.h"
#include "likeness/app/capture_identity.h"
#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/base/file.h"
#include "likeness/train/encode_frames.h"

namespace likeness {

int RunEncode(int argc, const char* const* argv) {
  std::filesystem::path avatar_file, root, out;
  CaptureOptions capture_options;
  SelectionFlags selection;
  std::string identity, device = "cpu";
  double frames_per_second = 30;
  Command command("encode", "Turns frames of an unwrapped capture into a performance: codes, head poses and times.",
                  "likeness encode avatars/demo captures/demo talk.perf.safetensors --segments 'SEN_*'");
  command.Positional("AVATAR", &avatar_file, "avatar file, or the folder of its training run");
  command.Positional("CAPTURE", &root, "folder of the capture, unwrapped at the avatar's texture size");
  command.Positional("OUT", &out, "performance to write, NAME.perf.safetensors");
  AddFrameFlags(&command, &selection);
  command.Option("fps", &frames_per_second, "frames a second at which the capture's frame numbers count");
  command.Option("identity", &identity, "whom of the avatar's people CAPTURE shows; default: whom it is named after");
  command.Option("device", &device, "cpu, cuda or cuda:N");
  AddCaptureFlags(&command, &capture_options);
  if (!command.Parse(argc, argv)) return 0;

  const std::unique_ptr<AvatarModel> model = AvatarModel::Load(AvatarFile(avatar_file), device);
  const std::unique_ptr<Capture> capture = OpenCapture(root, capture_options);
  const TextureSet textures(*capture, model->avatar().architecture.texture_size);
  const Performance performance = EncodeFrames(*model, textures, SelectFrames(*capture, selection.Selection()),
                                               CaptureIdentity(model->avatar(), identity, root), frames_per_second);
  WritePerformance(out, performance);
  WriteFile(std::filesystem::path(out).replace_extension(".toml"), command.ResolvedToml());
  fmt::print("{}: {} frames, {:.1f} s\n", out.string(), performance.frame_count(), performance.seconds.back());
  return 0;
}

}  // namespace likeness
