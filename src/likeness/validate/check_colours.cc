// Red and blue exchanged (BGR), in one camera or in all.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "likeness/image/panels.h"
#include "likeness/validate/checks.h"
#include "likeness/validate/hypothesis.h"

namespace likeness {
namespace {

struct Warmth {
  size_t camera = 0;
  double value = 0;  // mean log(red / blue) over the surface that the camera sees
};

std::vector<Warmth> MeasureWarmth(const Examination& e) {
  std::vector<int> frames = e.SampledFrames();
  if (frames.size() > 3) frames.resize(3);
  std::vector<Warmth> list;
  for (size_t c = 0; c < e.cameras.size(); ++c) {
    double red = 0, blue = 0;
    const std::vector<Look> looks = LooksAt(e, frames, {c});
    const std::vector<ViewFit> fits = FitLooks(e, looks);
    for (size_t i = 0; i < looks.size(); ++i) {
      for (size_t p = 0; p < fits[i].seen.size(); ++p) {
        if (fits[i].seen[p] == 0) continue;
        const uint8_t* pixel =
            looks[i].view->colour.at(static_cast<int>(fits[i].at[p].x()), static_cast<int>(fits[i].at[p].y()));
        red += pixel[0], blue += pixel[2];
      }
    }
    if (red > 0 && blue > 0) list.push_back({c, std::log(red / blue)});
  }
  return list;
}

ImageU8 Exchanged(const ImageU8& image) {
  ImageU8 exchanged = image;
  for (size_t i = 0; i + 2 < exchanged.values().size(); i += 3)
    std::swap(exchanged.values()[i], exchanged.values()[i + 2]);
  return exchanged;
}

}  // namespace

void CheckColours(Examination* e) {
  if (!e->placed) return;
  const std::vector<Warmth> list = MeasureWarmth(*e);
  if (list.empty()) return;
  std::vector<double> values;
  for (const Warmth& warmth : list) values.push_back(warmth.value);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  const double usual = values[values.size() / 2];
  const auto draw = [&](size_t camera) -> std::function<ImageU8()> {
    const std::vector<Look> looks = LooksAt(*e, e->SampledFrames(), {camera});
    if (looks.empty()) return {};
    return [picture = looks.front().view->colour, name = e->cameras[camera].name] {
      return SideBySide({{picture, "camera " + name}, {Exchanged(picture), "red and blue exchanged"}});
    };
  };
  if (usual < -0.15) {
    Finding& finding = e->Found("colours-swapped", Severity::kWarning, "images, all cameras",
                                "skin is bluish in all cameras: red and blue may be exchanged (BGR)",
                                "exchange the first and third channel of the images");
    finding.evidence = fmt::format("blue is {:.2f} times red over the face", std::exp(-usual));
    finding.confidence = 0.7;
    finding.draw = draw(list.front().camera);
  }
  if (list.size() < 3 || std::abs(usual) < 0.1) return;
  for (const Warmth& warmth : list) {
    // Nearer to the others' exchanged colours than to their colours.
    if (std::abs(warmth.value + usual) > 0.35 * std::abs(warmth.value - usual)) continue;
    Finding& finding =
        e->Found("camera-colours-swapped", Severity::kMustFix, "camera " + e->cameras[warmth.camera].name,
                 "red and blue are exchanged (BGR) in this camera's images",
                 "exchange the first and third channel of this camera's images");
    finding.evidence = fmt::format("red is {:.2f} times blue over the face; in the other cameras {:.2f} times",
                                   std::exp(warmth.value), std::exp(usual));
    finding.confidence = 0.9;
    finding.draw = draw(warmth.camera);
  }
}

}  // namespace likeness
