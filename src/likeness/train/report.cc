#include "likeness/train/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "likeness/base/progress.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/image/resize.h"
#include "likeness/train/comparison.h"
#include "likeness/train/loss_chart.h"
#include "likeness/train/report_style.h"

namespace likeness {
namespace {

// What a group is called on the page, and whether something in it is new to the avatar.
struct GroupWords {
  const char* name;
  const char* meaning;
};

GroupWords WordsFor(EvaluationGroup group) {
  switch (group) {
    case EvaluationGroup::kTraining:
      return {"Training", "cameras and segments it was trained on"};
    case EvaluationGroup::kHeldOutCameras:
      return {"Held-out cameras", "views it never saw, of expressions it was trained on"};
    case EvaluationGroup::kHeldOutSegments:
      return {"Held-out segments", "expressions it never saw, from cameras it was trained on"};
    case EvaluationGroup::kHeldOutBoth:
      return {"Held out, both", "views and expressions it never saw"};
  }
  return {"", ""};
}

std::string PsnrText(const GroupResult& group) {
  if (group.images == 0) return "none";
  const double psnr = PsnrDb(group.error.Mean());
  return std::isinf(psnr) ? "exact" : fmt::format("{:.2f} dB", psnr);
}

std::string ImageTag(const ImageU8& image, const std::string& alt) {
  return fmt::format(
      "<div class=\"cell\"><img alt=\"{}\" width=\"{}\" height=\"{}\" style=\"height:auto\" "
      "src=\"data:image/jpeg;base64,{}\"></div>",
      EscapeHtml(alt), image.width(), image.height(), Base64(EncodeJpeg(image, 90)));
}

std::string Figure(const ImageU8& image, const std::string& caption) {
  return fmt::format("<figure>{}<div class=\"under\">{}</div></figure>", ImageTag(image, caption), EscapeHtml(caption));
}

std::string Card(const std::string& value, const std::string& caption) {
  return fmt::format("<div class=\"card\"><b>{}</b><span>{}</span></div>", EscapeHtml(value), EscapeHtml(caption));
}

std::string Header(const ReportContent& content) {
  const Capture& capture = content.capture;
  const Architecture& a = content.avatar.architecture;
  std::string html = "<h1>An avatar and what it is worth</h1>";
  html += fmt::format(
      "<p class=\"soft\"><code>{}</code> (preset {}, {} x {} texels, latent code of {}), judged on <code>{}</code>: {} "
      "training and {} held-out cameras, {} training and {} held-out frames.</p>",
      EscapeHtml(content.avatar_path), EscapeHtml(a.preset), a.texture_size, a.texture_size, a.latent,
      EscapeHtml(capture.root().string()), capture.split().training_cameras.size(),
      capture.split().held_out_cameras.size(), capture.TrainingFrames().size(), capture.HeldOutFrames().size());
  html += "<div class=\"cards\">";
  for (const EvaluationGroup group : {EvaluationGroup::kHeldOutCameras, EvaluationGroup::kHeldOutSegments,
                                      EvaluationGroup::kHeldOutBoth, EvaluationGroup::kTraining}) {
    html += Card(PsnrText(content.result.Of(group)), std::string("PSNR, ") + WordsFor(group).meaning);
  }
  return html + "</div>";
}

std::string DifferenceLegend() {
  std::string stops;
  for (int i = 0; i <= 10; ++i) {
    const Colour c = HeatColour(static_cast<float>(i) / 10);
    stops += fmt::format(",rgb({} {} {})", c[0], c[1], c[2]);
  }
  return fmt::format(
      "<div class=\"legend\">squared difference 0 <i style=\"background:linear-gradient(90deg{})\"></i> {:g} "
      "and more, mean over RGB, head pixels only, 0 to 255 units squared</div>",
      stops, kDifferenceFullScale);
}

std::string Comparisons(const ReportContent& content) {
  if (content.result.pictures.empty()) return "";
  std::string html = "<h2>Ground truth and ours, with the squared difference</h2>" + DifferenceLegend();
  for (const EvaluationGroup group : {EvaluationGroup::kHeldOutCameras, EvaluationGroup::kHeldOutBoth,
                                      EvaluationGroup::kHeldOutSegments, EvaluationGroup::kTraining}) {
    for (const EvaluatedPicture& picture : content.result.pictures) {
      if (picture.group != group) continue;
      const Comparison comparison = Compare(picture, HeadFraming(picture.mask));
      html += fmt::format(
          "<figure class=\"row\"><figcaption><span class=\"tag{}\">{}</span><span>{} {}, camera "
          "{}</span><span class=\"soft\">PSNR {:.2f} dB, SSIM {:.3f}</span></figcaption>",
          group == EvaluationGroup::kTraining ? "" : " held-out", WordsFor(group).name,
          EscapeHtml(picture.frame.segment), EscapeHtml(picture.frame.frame), EscapeHtml(picture.camera),
          PsnrDb(picture.mse), picture.ssim);
      html += fmt::format("<div class=\"two\">{}{}</div></figure>", Figure(comparison.truth, "ground truth"),
                          Figure(comparison.ours, "ours; inset: squared difference"));
    }
  }
  return html;
}

std::string Table(const EvaluationResult& result) {
  std::string html =
      "<h2>Figures</h2><p class=\"soft\">Image-space error over head pixels, in units of 0 to 255. The code is the "
      "mean "
      "of the encoder, not a sample; averages for encoding come from training cameras alone. Head pixels that the mesh "
      "does not cover count as black.</p><div class=\"scroll\"><table><tr><th></th><th>images</th><th>MSE</th>"
      "<th>PSNR</th><th>SSIM</th><th>vertex error</th><th>uncovered</th></tr>";
  int unmasked = 0;
  for (const GroupResult& group : result.groups) {
    unmasked += group.images_unmasked;
    if (group.images == 0) {
      html += fmt::format("<tr><td>{}</td><td>0</td><td colspan=\"5\"></td></tr>", WordsFor(group.group).name);
      continue;
    }
    html += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{:.2f}</td><td>{}</td><td>{:.4f}</td><td>{:.2f} mm</td>"
        "<td>{:.2f} %</td></tr>",
        WordsFor(group.group).name, group.images, group.error.Mean(), PsnrText(group), group.ssim, group.vertex_mm,
        100 * group.uncovered);
  }
  html += "</table></div>";
  if (unmasked > 0) {
    html += fmt::format("<p class=\"soft\">{} images have no head mask: the tracked mesh's outline stood in.</p>",
                        unmasked);
  }
  return html;
}

std::string Textures(const ReportContent& content) {
  const auto& pictures = content.result.pictures;
  if (pictures.empty()) return "";
  const auto held_out = std::find_if(pictures.begin(), pictures.end(),
                                     [](const auto& p) { return p.group == EvaluationGroup::kHeldOutCameras; });
  const EvaluatedPicture& picture = held_out != pictures.end() ? *held_out : pictures.front();
  return fmt::format(
      "<h2>Textures</h2><p class=\"soft\">Left: the mean over all training frames and cameras. Right: what the network "
      "paints for {} {}, seen from camera {}.</p><div class=\"two\">{}{}</div>",
      EscapeHtml(picture.frame.segment), EscapeHtml(picture.frame.frame), EscapeHtml(picture.camera),
      Figure(FitInto(ToU8(content.avatar.identities.at(content.identity).texture_mean), 512, 512), "mean texture"),
      Figure(FitInto(picture.texture, 512, 512), "decoded texture"));
}

std::string Training(const ReportContent& content) {
  if (!content.loss) return "";
  const std::string chart = LossChart(*content.loss);
  if (chart.empty()) return "";
  return fmt::format(
      "<h2>Training</h2><p class=\"soft\">{:.0f} iterations in {}. Loss on standardised data, "
      "logarithmic scale; the total is the weighted sum of the three terms.</p>{}",
      content.loss->iteration.back(), FormatDuration(content.loss->elapsed_s.back()), chart);
}

std::string Stages(const ReportContent& content) {
  if (content.stages.empty()) return "";
  double longest = 1e-9, total = 0;
  for (const StageTime& stage : content.stages) {
    longest = std::max(longest, stage.seconds);
    total += stage.seconds;
  }
  std::string html = fmt::format("<h2>Time</h2><p class=\"soft\">{} in all.</p>", FormatDuration(total));
  for (const StageTime& stage : content.stages) {
    html += fmt::format("<div class=\"stage\"><span>{}</span><i style=\"width:{:.1f}%\"></i><span>{}</span></div>",
                        EscapeHtml(stage.name), 100 * stage.seconds / longest, FormatDuration(stage.seconds));
  }
  return html;
}

// `code` becomes an element.
std::string WithCode(const std::string& sentence) {
  std::string html;
  bool inside = false;
  for (const char c : EscapeHtml(sentence)) {
    if (c != '`') {
      html += c;
      continue;
    }
    html += inside ? "</code>" : "<code>";
    inside = !inside;
  }
  return html;
}

std::string Next(const ReportContent& content) {
  std::string html = "<h2>What to try next</h2><ul>";
  for (const std::string& sentence : Advice(content)) html += "<li>" + WithCode(sentence) + "</li>";
  return html + "</ul>";
}

}  // namespace

std::vector<std::string> Advice(const ReportContent& content) {
  const EvaluationResult& result = content.result;
  const auto has = [&](EvaluationGroup group) { return result.Of(group).images > 0; };
  const auto psnr = [&](EvaluationGroup group) { return PsnrDb(std::max(1e-3, result.Of(group).error.Mean())); };
  constexpr double kGapDb = 2;  // a difference that one sees
  const std::string capture = content.capture.root().string();
  std::vector<std::string> advice;
  constexpr double kPaperIterations = 200000;
  if (content.loss && !content.loss->iteration.empty() && content.loss->iteration.back() < kPaperIterations) {
    advice.push_back(fmt::format(
        "Train longer: the paper takes {:.0f} iterations, this run had {:.0f} in {}. For an "
        "hour: `likeness train {} OUT --minutes 60`.",
        kPaperIterations, content.loss->iteration.back(), FormatDuration(content.loss->elapsed_s.back()), capture));
  }
  if (has(EvaluationGroup::kTraining) && has(EvaluationGroup::kHeldOutCameras) &&
      psnr(EvaluationGroup::kTraining) - psnr(EvaluationGroup::kHeldOutCameras) > kGapDb) {
    advice.push_back(
        fmt::format("New cameras are {:.1f} dB behind training cameras: more training cameras, or a mesh "
                    "that follows the surface more closely, close this gap.",
                    psnr(EvaluationGroup::kTraining) - psnr(EvaluationGroup::kHeldOutCameras)));
  }
  if (has(EvaluationGroup::kTraining) && has(EvaluationGroup::kHeldOutSegments) &&
      psnr(EvaluationGroup::kTraining) - psnr(EvaluationGroup::kHeldOutSegments) > kGapDb) {
    advice.push_back(
        fmt::format("New expressions are {:.1f} dB behind those trained on: more frames with more varied "
                    "expressions close this gap.",
                    psnr(EvaluationGroup::kTraining) - psnr(EvaluationGroup::kHeldOutSegments)));
  }
  double uncovered = 0;
  for (const GroupResult& group : result.groups) uncovered = std::max(uncovered, group.uncovered);
  if (uncovered > 0.01) {
    advice.push_back(
        fmt::format("Up to {:.1f} % of the head pixels are outside the mesh (hair, lashes, the neck's "
                    "edge) and count as black: no training can paint them.",
                    100 * uncovered));
  }
  if (content.avatar.architecture.texture_size < 1024) {
    const int size = 2 * content.avatar.architecture.texture_size;
    advice.push_back(
        fmt::format("Finer detail: unwrap and train at twice the texture size, with `likeness unwrap {0} "
                    "--size {1}` and `likeness train {0} OUT --size {1}`.",
                    capture, size));
  }
  advice.push_back(
      fmt::format("Look from elsewhere: `likeness render {} face.png --view 40,10`.", content.avatar_path));
  return advice;
}

std::string EscapeHtml(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string Base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) {
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    }
    for (size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string ReportHtml(const ReportContent& content) {
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><title>Avatar report</title><style>";
  html += kReportStyle;
  html += "</style></head><body><main>\n";
  for (const std::string& section : {Header(content), Comparisons(content), Table(content.result), Textures(content),
                                     Training(content), Stages(content), Next(content)}) {
    if (!section.empty()) html += section + "\n";
  }
  return html + "</main></body></html>\n";
}

}  // namespace likeness
