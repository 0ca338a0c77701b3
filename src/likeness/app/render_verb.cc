// likeness render AVATAR OUT

#include <fmt/format.h>

#include <charconv>
#include <cstring>
#include <filesystem>

#include "likeness/app/avatar_painter.h"
#include "likeness/app/clip.h"
#include "likeness/app/command.h"
#include "likeness/app/picture_output.h"
#include "likeness/app/shots.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/progress.h"
#include "likeness/image/panels.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path avatar;
  fs::path out;
  ClipOptions clip;
  ShotOptions shot;
  int sheet = 0;
  std::string background = "0,0,0";
  bool transparent = false;
};

Command Describe(Arguments& a) {
  Command command("render", "Draws an avatar, as any of its people: a picture, a folder of pictures or a video.",
                  "likeness render avatars/demo turn.mp4 --turntable 6 --view 0,10 --background 32,34,38");
  command.Positional("AVATAR", &a.avatar, "avatar file, or the folder of its training run");
  command.Positional("OUT", &a.out, "NAME.png; NAME/ for a folder of pictures; NAME.mp4, .webm or .mkv, by ffmpeg");
  AddClipFlags(&command, &a.clip);
  AddShotFlags(&command, &a.shot);
  command.Option(
      "sheet", &a.sheet,
      "so many of --identity's frames, spread evenly, each drawn as everybody: rows of one code, columns of one "
      "person");
  command.Option("background", &a.background, "R,G,B, each 0 to 255");
  command.Option("transparent", &a.transparent, "pictures with opacity instead of a background");
  return command;
}

std::array<uint8_t, 3> ParseBackground(const std::string& text) {
  std::array<uint8_t, 3> colour = {};
  const char *at = text.data(), *const end = at + text.size();
  for (size_t c = 0; c < 3; ++c) {
    const auto [next, error] = std::from_chars(at, end, colour[c]);
    const bool parted = c == 2 ? next == end : next != end && *next == ',';
    if (error != std::errc() || !parted) {
      throw UsageError(fmt::format("--background is R,G,B, each 0 to 255, such as 32,34,38; not '{}'", text));
    }
    at = next + 1;
  }
  return colour;
}

// One picture at the right of the other; of one height, and as many channels as the first.
ImageU8 Beside(const ImageU8& left, const ImageU8& right) {
  LIKENESS_CHECK(left.height() == right.height());
  ImageU8 both(left.width() + right.width(), left.height(), left.channels(), 255);
  for (int y = 0; y < left.height(); ++y) {
    std::memcpy(both.row(y), left.row(y), static_cast<size_t>(left.width()) * left.channels());
    for (int x = 0; x < right.width(); ++x) {
      std::memcpy(both.at(left.width() + x, y), right.at(x, y), std::min(left.channels(), right.channels()));
    }
  }
  return both;
}

ImageU8 Draw(const ClipFrame& frame, const Shots& shots, AvatarPainter* painter) {
  const Shot shot = shots.Of(frame);
  const std::vector<ImageU8> eyes = painter->Paint(frame.code, frame.conditions, shot.cameras, shot.world_from_head);
  return eyes.size() == 2 ? Beside(eyes[0], eyes[1]) : eyes[0];
}

// Rows of one code, columns of one person.
ImageU8 DrawSheet(const Arguments& a, AvatarPainter* painter) {
  const Avatar& avatar = painter->avatar();
  const int identity = a.clip.identity.empty() ? 0 : FindIdentity(avatar, a.clip.identity);
  std::vector<const FrameCode*> codes;
  for (const FrameCode& code : avatar.codes) {
    if (code.identity == identity) codes.push_back(&code);
  }
  if (codes.empty()) throw Error("{}: knows no codes of frames; --sheet needs them", a.avatar.string());
  ShotOptions options = a.shot;
  if (options.width == 0) options.width = 240;
  if (options.height == 0) options.height = 320;
  const Shots shots(avatar, options);
  const int people = avatar.architecture.identities;
  const size_t count = std::min(codes.size(), static_cast<size_t>(a.sheet));
  std::vector<std::vector<Panel>> panels(count);
  // Person by person: the decoder is opened for one.
  for (int person = 0; person < people; ++person) {
    for (size_t row = 0; row < count; ++row) {
      const FrameCode& code = *codes[row * codes.size() / count];
      ClipFrame frame;
      frame.code = code.mu;
      frame.conditions = ConditionsOf(code);
      frame.conditions.identity = person;
      for (const std::string& assignment : a.clip.conditions) SetCondition(avatar, assignment, &frame.conditions);
      panels[row].push_back({Draw(frame, shots, painter),
                             person == identity ? code.segment + " " + code.frame : avatar.identities[person].name});
    }
  }
  std::vector<ImageU8> rows;
  for (const std::vector<Panel>& row : panels) rows.push_back(SideBySide(row));
  return Stacked(rows);
}

void DrawClip(const Arguments& a, AvatarPainter* painter) {
  const std::vector<ClipFrame> clip = MakeClip(painter->avatar(), a.clip);
  const Shots shots(painter->avatar(), a.shot);
  const auto output = OpenPictureOutput(a.out, clip.size(), a.transparent, a.clip.frames_per_s);
  const InterruptScope interrupt;
  Progress progress("draw frames", static_cast<int64_t>(clip.size()), "frames");
  for (const ClipFrame& frame : clip) {
    if (interrupt.Requested()) throw Error("{}: interrupted; nothing was written", a.out.string());
    ImageU8 picture = Draw(frame, shots, painter);
    if (!a.shot.beside_truth.empty()) picture = Beside(picture, shots.TruthOf(frame));
    output->Write(picture);
    progress.Advance();
  }
  progress.Finish();
  output->Finish();
}

void Check(const Arguments& a) {
  a.clip.Check();
  a.shot.Check();
  if (a.sheet < 0 || a.sheet > 100) throw UsageError("--sheet has 1 to 100 rows");
  if (a.sheet > 0 &&
      (!a.shot.camera.empty() || !a.clip.code.empty() || !a.clip.codes.empty() || !a.clip.segment.empty() ||
       !a.clip.performance.empty() || a.clip.turntable_s > 0 || a.shot.stereo != "off" || a.transparent)) {
    throw UsageError(
        "--sheet draws frames of the avatar's own from --view; of the other options --identity, --condition, the "
        "size and --background go with it");
  }
}

}  // namespace

int RunRender(int argc, const char* const* argv) {
  Arguments a;
  Command command = Describe(a);
  if (!command.Parse(argc, argv)) return 0;
  Check(a);
  AvatarPainter painter(AvatarFile(a.avatar), ParseBackground(a.background), a.transparent);
  if (a.sheet > 0) {
    const auto output = OpenPictureOutput(a.out, 1, false, a.clip.frames_per_s);
    output->Write(DrawSheet(a, &painter));
    output->Finish();
  } else {
    DrawClip(a, &painter);
  }
  WriteFile(TomlBeside(a.out), command.ResolvedToml());
  fmt::print("{}\n", a.out.string());
  return 0;
}

}  // namespace likeness
