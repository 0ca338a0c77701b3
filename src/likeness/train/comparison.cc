#include "likeness/train/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "likeness/base/file.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/image/resize.h"

namespace likeness {
namespace {

struct Box {
  int x = 0, y = 0, width = 0, height = 0;
};

// The mask's bounding box with a margin; the whole image when the mask is empty.
Box BoxOf(const ImageU8& mask) {
  constexpr int kMargin = 12;
  int x0 = mask.width(), y0 = mask.height(), x1 = -1, y1 = -1;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      if (*mask.at(x, y) == 0) continue;
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
  }
  if (x1 < 0) return {0, 0, mask.width(), mask.height()};
  x0 = std::max(0, x0 - kMargin), y0 = std::max(0, y0 - kMargin);
  x1 = std::min(mask.width() - 1, x1 + kMargin), y1 = std::min(mask.height() - 1, y1 + kMargin);
  return {x0, y0, x1 - x0 + 1, y1 - y0 + 1};
}

ImageU8 CutAndFit(const ImageU8& image, const Box& box, int width, int height) {
  ImageU8 cut(box.width, box.height, 3);
  Blit(&cut, image, -box.x, -box.y);
  return box.width > width || box.height > height ? FitInto(cut, width, height) : cut;
}

}  // namespace

Comparison Compare(const EvaluatedPicture& picture, int width, int height) {
  ImageU8 difference = DifferenceHeat(picture.truth, picture.ours, kDifferenceFullScale);
  for (size_t i = 0; i < picture.mask.values().size(); ++i) {
    if (picture.mask.values()[i] == 0) std::fill_n(&difference.values()[3 * i], 3, uint8_t{0});
  }
  const Box box = BoxOf(picture.mask);
  return {CutAndFit(picture.truth, box, width, height), CutAndFit(picture.ours, box, width, height),
          CutAndFit(difference, box, width, height)};
}

ImageU8 ComparisonPanel(const EvaluatedPicture& picture) {
  constexpr int kLeastWidth = 320;  // captions need this much
  Comparison comparison = Compare(picture);
  for (ImageU8* image : {&comparison.truth, &comparison.ours, &comparison.difference}) {
    if (image->width() < kLeastWidth) *image = FitInto(*image, kLeastWidth, 3 * kLeastWidth);
  }
  const ImageU8 row = SideBySide(
      {{comparison.truth, "ground truth"},
       {comparison.ours, fmt::format("ours: PSNR {:.2f} dB, SSIM {:.3f}", PsnrDb(picture.mse), picture.ssim)},
       {comparison.difference, fmt::format("difference: MSE {:.1f}", picture.mse)}});
  const int width = row.width() - 2 * kPanelGap;
  const std::string title = fmt::format("{}: {} {}, camera {}", ToString(picture.group), picture.frame.segment,
                                        picture.frame.frame, picture.camera);
  return Stacked({SideBySide({{ImageU8(width, 1, 3), title}}), row,
                  SideBySide({{HeatLegend(width, kDifferenceFullScale),
                               "scale of the difference: mean absolute over RGB, head pixels"}})});
}

std::vector<std::filesystem::path> WriteComparisons(const std::vector<EvaluatedPicture>& pictures,
                                                    const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  nlohmann::ordered_json index = nlohmann::ordered_json::array();
  for (const EvaluatedPicture& picture : pictures) {
    const std::string name = fmt::format("{}_{}_{}_{}.png", ToString(picture.group), picture.frame.segment,
                                         picture.frame.frame, picture.camera);
    paths.push_back(folder / name);
    WritePng(paths.back(), ComparisonPanel(picture));
    nlohmann::ordered_json entry = {{"file", name},
                                    {"group", ToString(picture.group)},
                                    {"segment", picture.frame.segment},
                                    {"frame", picture.frame.frame},
                                    {"camera", picture.camera},
                                    {"mse", picture.mse},
                                    {"psnr_db", nullptr},
                                    {"ssim", picture.ssim}};
    if (picture.mse > 0) entry["psnr_db"] = PsnrDb(picture.mse);
    index.push_back(std::move(entry));
  }
  WriteFile(folder / "index.json", index.dump(2) + "\n");
  return paths;
}

}  // namespace likeness
