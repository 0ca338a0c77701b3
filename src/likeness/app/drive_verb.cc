// likeness drive AVATAR RECORDING OUT

#include <fmt/format.h>

#include <filesystem>

#include "likeness/app/command.h"
#include "likeness/app/live_link_performance.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/avatar/conditions.h"
#include "likeness/base/file.h"

namespace likeness {

int RunDrive(int argc, const char* const* argv) {
  std::filesystem::path avatar_path, recording, out;
  std::string identity;
  DriveOptions options;
  Command command(
      "drive", "Turns a recording of Live Link Face into a performance, by the avatar's map from ARKit coefficients.",
      "likeness drive avatars/demo take_1.csv take_1.perf.safetensors");
  command.Positional("AVATAR", &avatar_path,
                     "avatar file, or the folder of its training run; likeness fit-arkit first");
  command.Positional("RECORDING", &recording, "CSV as Live Link Face writes it");
  command.Positional("OUT", &out, "performance to write, NAME.perf.safetensors");
  command.Option("head-motion", &options.head_motion, "turn the head as recorded; otherwise it stays upright");
  command.Option("identity", &identity, "whose face, of an avatar of several people; default: the first one's");
  if (!command.Parse(argc, argv)) return 0;

  const std::filesystem::path avatar_file = AvatarFile(avatar_path);
  const SafetensorsFile file = SafetensorsFile::Map(avatar_file);
  const Avatar avatar = AvatarFrom(file);
  const ArkitMap map = ReadLiveLinkMap(file, avatar.architecture.latent);
  if (!identity.empty()) options.identity = FindIdentity(avatar, identity);
  const Performance performance = PerformanceOf(ReadLiveLink(recording), avatar, map, options);
  WritePerformance(out, performance);
  WriteFile(std::filesystem::path(out).replace_extension(".toml"), command.ResolvedToml());
  fmt::print("{}: {} frames, {:.1f} s\n", out.string(), performance.frame_count(), performance.seconds.back());
  return 0;
}

}  // namespace likeness
