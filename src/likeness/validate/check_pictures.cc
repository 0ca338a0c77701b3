// Pictures by themselves: exposure, and masks against what stands out from the background.

#include <fmt/format.h>

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/image/foreground.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/image/resize.h"
#include "likeness/validate/checks.h"

namespace likeness {
namespace {

constexpr int kBlack = 12;             // of 255: a picture whose brightest hundredth is below shows nothing
constexpr int kWhite = 253;            // clipped
constexpr double kMostClipped = 0.25;  // of the foreground, in two channels or more

// Brightest value but for a hundredth of the pixels.
int Brightest(const ImageU8& image) {
  std::vector<uint8_t> values(image.values().begin(), image.values().end());
  const auto most = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), most, values.end());
  return *most;
}

double ClippedShare(const View& view) {
  double clipped = 0, count = 0;
  for (int y = 0; y < view.colour.height(); ++y) {
    for (int x = 0; x < view.colour.width(); ++x) {
      if (!view.foreground.empty() && *view.foreground.at(x, y) == 0) continue;
      const uint8_t* p = view.colour.at(x, y);
      clipped += (p[0] >= kWhite) + (p[1] >= kWhite) + (p[2] >= kWhite) >= 2;
      count += 1;
    }
  }
  return count > 0 ? clipped / count : 0;
}

// Tells of pictures by camera where all of a camera's are so, otherwise one by one.
void TellPictures(Examination* e, const char* code, const std::vector<std::pair<size_t, size_t>>& found,
                  const std::string& what, const std::string& advice, const std::string& evidence) {
  if (found.empty()) return;
  std::vector<int> looked(e->cameras.size()), bad(e->cameras.size());
  for (const int f : e->SampledFrames()) {
    for (size_t c = 0; c < e->cameras.size(); ++c) looked[c] += !e->frames[static_cast<size_t>(f)].views[c].empty();
  }
  for (const auto& [f, c] : found) ++bad[c];
  std::vector<std::string> cameras, single;
  for (size_t c = 0; c < bad.size(); ++c) {
    if (bad[c] > 0 && bad[c] == looked[c]) cameras.push_back(e->cameras[c].name);
  }
  for (const auto& [f, c] : found) {
    if (bad[c] != looked[c]) single.push_back(e->Relative(e->layout.Image(e->frames[f].id, e->cameras[c].name)));
  }
  const std::string where = cameras.empty() ? single.front() : "camera " + SomeOf(cameras);
  const auto [f, c] = found.front();
  Finding& finding =
      e->Found(code, Severity::kMustFix, where,
               fmt::format("{}{}", what, single.empty() || cameras.empty() ? "" : ": also " + SomeOf(single)), advice);
  finding.evidence = fmt::format("{} in {} of {} pictures looked at", evidence, found.size(), e->report.views);
  finding.draw = [picture = e->frames[f].views[c].colour, name = e->cameras[c].name] {
    return SideBySide({{picture, "camera " + name}});
  };
}

ImageU8 ReadMask(const Examination& e, const FrameId& id, const Camera& camera) {
  if (!e.multiface) return e.capture->ReadHeadMask(id, camera).value_or(ImageU8());
  const auto path = e.layout.HeadMask(id, camera.name);
  return Exists(path) ? ReadImage(path, 1) : ImageU8();
}

}  // namespace

void CheckExposure(Examination* e) {
  std::vector<std::pair<size_t, size_t>> black, white;
  for (const int f : e->SampledFrames()) {
    const auto frame = static_cast<size_t>(f);
    for (size_t c = 0; c < e->cameras.size(); ++c) {
      View& view = e->frames[frame].views[c];
      if (view.empty()) continue;
      if (Brightest(view.colour) < kBlack) {
        black.emplace_back(frame, c);
      } else if (ClippedShare(view) > kMostClipped) {
        white.emplace_back(frame, c);
      }
    }
  }
  TellPictures(e, "image-black", black, "the picture is black", "export it again, or take the camera or frame out",
               fmt::format("99% of its values are below {}", kBlack));
  TellPictures(e, "image-overexposed", white, "the head is overexposed: its colours are lost",
               "export it again at a lower exposure, or take the camera or frame out",
               fmt::format("over {:.0f}% of the foreground is at 255", 100 * kMostClipped));
  for (const auto* list : {&black, &white}) {
    for (const auto& [f, c] : *list) e->frames[f].views[c] = View();
  }
}

void CheckMasks(Examination* e) {
  struct Complaint {
    const char* code;
    const char* what;
    const char* advice;
    std::vector<std::string> files;
    std::string evidence;
    ImageU8 picture, mask;
  };
  Complaint wrong_size = {
      "mask-size", "masks of another size than the image", "write masks of the image's own size", {}, "", {}, {}};
  Complaint unreadable = {"mask-unreadable", "masks that cannot be read", "copy them again", {}, "", {}, {}};
  Complaint inverted = {"mask-inverted",
                        "masks are inverted: they mark the background",
                        "write 255 where a pixel shows the head, 0 elsewhere",
                        {},
                        "",
                        {},
                        {}};
  Complaint empty = {
      "mask-empty", "masks that mark nothing, or everything", "make them again, or remove masks/", {}, "", {}, {}};
  Complaint other = {"mask-mismatch",
                     "masks that do not lie on what the image shows",
                     "see whether images and masks belong to the same camera and frame",
                     {},
                     "",
                     {},
                     {}};
  int looked = 0;
  for (const int f : e->SampledFrames()) {
    const ExaminedFrame& frame = e->frames[static_cast<size_t>(f)];
    for (size_t c = 0; c < e->cameras.size(); ++c) {
      const Camera& camera = e->cameras[c];
      const View& view = frame.views[c];
      if (view.empty()) continue;
      const auto complain = [&](Complaint* complaint, const std::string& evidence, const ImageU8& mask) {
        if (complaint->files.empty())
          complaint->evidence = evidence, complaint->picture = view.colour, complaint->mask = mask;
        complaint->files.push_back(e->Relative(e->layout.HeadMask(frame.id, camera.name)));
      };
      ImageU8 mask;
      try {
        mask = ReadMask(*e, frame.id, camera);
      } catch (const Error& error) {
        complain(&unreadable, error.what(), {});
        continue;
      }
      if (mask.empty()) continue;
      ++looked;
      if (mask.width() != camera.width || mask.height() != camera.height) {
        complain(
            &wrong_size,
            fmt::format("{} x {}, the image has {} x {}", mask.width(), mask.height(), camera.width, camera.height),
            mask);
        continue;
      }
      mask = ResizeArea(mask, view.colour.width(), view.colour.height());
      const double marked = Overlap(mask, mask).a, all = static_cast<double>(mask.width()) * mask.height();
      if (marked < 0.002 * all || marked > 0.998 * all) {
        complain(&empty, fmt::format("{:.1f}% of the picture is marked", 100 * marked / all), mask);
        continue;
      }
      const std::optional<ImageU8> foreground = FindForeground(view.colour);
      if (!foreground) continue;
      const MaskOverlap overlap = Overlap(mask, *foreground);
      const double inside = overlap.both / overlap.a;
      const std::string evidence =
          fmt::format("{:.0f}% of the mask lies on what differs from the background", 100 * inside);
      if (inside > 0.8) continue;
      const double uncovered = overlap.b - overlap.both;  // foreground that an inverted mask would mark
      complain(inside < 0.4 && uncovered > 0.6 * overlap.b ? &inverted : &other, evidence, mask);
    }
  }
  for (const Complaint* complaint : {&wrong_size, &unreadable, &inverted, &empty, &other}) {
    if (complaint->files.empty()) continue;
    Finding& finding = e->Found(complaint->code, Severity::kMustFix, complaint->files.front(),
                                fmt::format("{}: {}", complaint->what, SomeOf(complaint->files)), complaint->advice);
    finding.evidence =
        fmt::format("{}; {} of {} masks looked at", complaint->evidence, complaint->files.size(), looked);
    if (!complaint->mask.empty()) {
      finding.draw = [picture = complaint->picture, mask = complaint->mask] {
        return SideBySide({{picture, "image"}, {FitInto(mask, picture.width(), picture.height()), "mask"}});
      };
    }
  }
}

}  // namespace likeness
