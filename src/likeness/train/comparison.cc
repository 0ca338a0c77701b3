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

constexpr int kInsetDivisor = 3;  // of the width

ImageU8 CutAndFit(const ImageU8& image, const Framing& framing, int width, int height) {
  ImageU8 cut(framing.width, framing.height, 3);
  Blit(&cut, image, -framing.x, -framing.y);
  return framing.width > width || framing.height > height ? FitInto(cut, width, height) : cut;
}

// Chooses the corner where the fewest pixels of the mask lie; the lower right one of equals.
void ChooseCorner(const ImageU8& mask, Framing* framing) {
  const int width = framing->width / kInsetDivisor, height = framing->height / kInsetDivisor;
  int64_t least = -1;
  for (const bool bottom : {true, false}) {
    for (const bool right : {true, false}) {
      const int x0 = framing->x + (right ? framing->width - width : 0);
      const int y0 = framing->y + (bottom ? framing->height - height : 0);
      int64_t covered = 0;
      for (int y = y0; y < y0 + height; ++y) {
        for (int x = x0; x < x0 + width; ++x) covered += *mask.at(x, y) != 0 ? 1 : 0;
      }
      if (least >= 0 && covered >= least) continue;
      least = covered;
      framing->right = right;
      framing->bottom = bottom;
    }
  }
}

void DrawInset(const ImageU8& difference, const Framing& framing, ImageU8* ours) {
  constexpr Colour kFrame = {150, 155, 165};
  const ImageU8 inset =
      FitInto(difference, std::max(1, ours->width() / kInsetDivisor), std::max(1, ours->height() / kInsetDivisor));
  const int x = framing.right ? ours->width() - inset.width() : 0;
  const int y = framing.bottom ? ours->height() - inset.height() : 0;
  Blit(ours, inset, x, y);
  DrawRectangle(ours, x, y, inset.width(), inset.height(), kFrame);
}

}  // namespace

Framing HeadFraming(const ImageU8& mask) {
  constexpr int kMargin = 12;
  int x0 = mask.width(), y0 = mask.height(), x1 = -1, y1 = -1;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      if (*mask.at(x, y) == 0) continue;
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
  }
  if (x1 < 0) return WholeFraming(mask);
  x0 = std::max(0, x0 - kMargin), y0 = std::max(0, y0 - kMargin);
  x1 = std::min(mask.width() - 1, x1 + kMargin), y1 = std::min(mask.height() - 1, y1 + kMargin);
  Framing framing = {x0, y0, x1 - x0 + 1, y1 - y0 + 1};
  ChooseCorner(mask, &framing);
  return framing;
}

Framing WholeFraming(const ImageU8& mask) {
  Framing framing = {0, 0, mask.width(), mask.height()};
  ChooseCorner(mask, &framing);
  return framing;
}

Comparison Compare(const EvaluatedPicture& picture, const Framing& framing, int width, int height) {
  ImageU8 difference = SquaredDifferenceHeat(picture.truth, picture.ours, kDifferenceFullScale);
  for (size_t i = 0; i < picture.mask.values().size(); ++i) {
    if (picture.mask.values()[i] == 0) std::fill_n(&difference.values()[3 * i], 3, uint8_t{0});
  }
  Comparison comparison = {CutAndFit(picture.truth, framing, width, height),
                           CutAndFit(picture.ours, framing, width, height)};
  DrawInset(CutAndFit(difference, framing, width, height), framing, &comparison.ours);
  return comparison;
}

ImageU8 ComparisonPanel(const EvaluatedPicture& picture, const Framing& framing) {
  constexpr int kLeastWidth = 320;  // captions need this much
  Comparison comparison = Compare(picture, framing);
  for (ImageU8* image : {&comparison.truth, &comparison.ours}) {
    if (image->width() < kLeastWidth) *image = FitInto(*image, kLeastWidth, 3 * kLeastWidth);
  }
  const ImageU8 row = SideBySide({{comparison.truth, "ground truth"},
                                  {comparison.ours, fmt::format("ours: MSE {:.1f}, PSNR {:.2f} dB, SSIM {:.3f}",
                                                                picture.mse, PsnrDb(picture.mse), picture.ssim)}});
  const int width = row.width() - 2 * kPanelGap;
  const std::string title = fmt::format("{}: {} {}, camera {}", ToString(picture.group), picture.frame.segment,
                                        picture.frame.frame, picture.camera);
  return Stacked({SideBySide({{ImageU8(width, 1, 3), title}}), row,
                  SideBySide({{HeatLegend(width, kDifferenceFullScale),
                               "inset: squared difference, mean over RGB, head pixels, 0 ... 255 units squared"}})});
}

std::vector<std::filesystem::path> WriteComparisons(const std::vector<EvaluatedPicture>& pictures,
                                                    const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  nlohmann::ordered_json index = nlohmann::ordered_json::array();
  for (const EvaluatedPicture& picture : pictures) {
    const std::string name = fmt::format("{}_{}_{}_{}.png", ToString(picture.group), picture.frame.segment,
                                         picture.frame.frame, picture.camera);
    paths.push_back(folder / name);
    WritePng(paths.back(), ComparisonPanel(picture, HeadFraming(picture.mask)));
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
