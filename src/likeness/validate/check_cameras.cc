// Mistakes of single cameras: what explains one camera's pictures, the others being right.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "likeness/validate/checks.h"
#include "likeness/validate/hypothesis.h"

namespace likeness {
namespace {

constexpr size_t kFrames = 4;
constexpr double kLeastGain = 0.12;
constexpr double kGoodAgreement = 0.3;  // a mistake that explains a camera leaves it agreeing with the others

// How one camera fits: its silhouettes, and the median of its agreements with each other camera.
struct CameraFit {
  double overlap = -1, agreement = 0;
  bool has_agreement = false;
  double Total() const { return std::max(0.0, overlap) + agreement; }
};

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

class CameraCheck {
 public:
  explicit CameraCheck(Examination* e) : e_(*e) {
    const std::vector<int> sampled = e_.SampledFrames();
    for (size_t i = 0; i < std::min(kFrames, sampled.size()); ++i) {
      frames_.push_back(sampled[sampled.size() <= kFrames ? i : i * (sampled.size() - 1) / (kFrames - 1)]);
    }
    for (size_t c = 0; c < e_.cameras.size(); ++c) {
      if (!LooksAt(e_, frames_, {c}).empty()) cameras_.push_back(c);
    }
  }

  void Run() {
    if (cameras_.size() < 2) return;
    looks_ = LooksAt(e_, frames_, cameras_);
    for (int round = 0; round < 4; ++round) {
      fits_ = FitLooks(e_, looks_);
      now_.clear();
      for (const size_t c : cameras_) now_[c] = FitOf(c, OwnLooks(c), OwnFits(c));
      if (!FindExchange() && !FindMistake()) break;
    }
    FindMisfits();
  }

 private:
  std::vector<Look> OwnLooks(size_t camera) const { return LooksAt(e_, frames_, {camera}); }
  std::vector<ViewFit> OwnFits(size_t camera) const {
    std::vector<ViewFit> own;
    for (size_t i = 0; i < looks_.size(); ++i) {
      if (looks_[i].camera == camera) own.push_back(fits_[i]);
    }
    return own;
  }

  // Of fits that stand for a camera, against the other cameras as they are. `without` is left out, too.
  CameraFit FitOf(size_t camera, const std::vector<Look>& looks, const std::vector<ViewFit>& fits,
                  std::optional<size_t> without = {}) const {
    CameraFit result;
    std::map<size_t, std::pair<double, double>> by_camera;  // sum, weight
    double overlap = 0;
    int overlaps = 0;
    for (size_t i = 0; i < looks.size(); ++i) {
      if (fits[i].overlap >= 0) overlap += fits[i].overlap, ++overlaps;
      for (size_t k = 0; k < looks_.size(); ++k) {
        if (looks_[k].frame != looks[i].frame || looks_[k].camera == camera || looks_[k].camera == without) continue;
        const Agreement agreement = Agree(fits[i], fits_[k]);
        if (agreement.points < kLeastPoints) continue;
        auto& [sum, weight] = by_camera[looks_[k].camera];
        sum += agreement.points * agreement.correlation, weight += agreement.points;
      }
    }
    if (overlaps > 0) result.overlap = overlap / overlaps;
    std::vector<double> agreements;
    for (const auto& [other, sum] : by_camera) agreements.push_back(sum.first / sum.second);
    if (!agreements.empty()) result.agreement = Median(agreements), result.has_agreement = true;
    return result;
  }

  // Cameras that fit worse than is usual, the worst first.
  std::vector<size_t> Suspects() const {
    std::vector<double> overlaps, agreements;
    for (const auto& [c, fit] : now_) {
      if (fit.overlap >= 0) overlaps.push_back(fit.overlap);
      if (fit.has_agreement) agreements.push_back(fit.agreement);
    }
    const double usual_overlap = overlaps.empty() ? 0 : Median(overlaps),
                 usual = agreements.empty() ? 0 : Median(agreements);
    std::vector<size_t> suspects;
    for (const auto& [c, fit] : now_) {
      const bool overlap_is_low = fit.overlap >= 0 && fit.overlap < usual_overlap - 0.06;
      const bool agreement_is_low = fit.agreement < 0.75 * usual && !agreements.empty();
      if (overlap_is_low || agreement_is_low) suspects.push_back(c);
    }
    std::sort(suspects.begin(), suspects.end(),
              [&](size_t a, size_t b) { return now_.at(a).Total() < now_.at(b).Total(); });
    if (suspects.size() > 8) suspects.resize(8);
    return suspects;
  }

  std::string Gain(const CameraFit& before, const CameraFit& after) const {
    std::string text;
    if (after.overlap >= 0)
      text = fmt::format("mesh over foreground {:.0f}% -> {:.0f}%, ", 100 * before.overlap, 100 * after.overlap);
    return text + fmt::format("agreement with other cameras {:.2f} -> {:.2f}", before.agreement, after.agreement);
  }

  // The pictures of `pictures` as seen through the calibration of `camera`.
  CameraFit FitWithPicturesOf(size_t camera, size_t pictures) const {
    std::vector<Look> looks = OwnLooks(pictures);
    for (Look& look : looks) look.camera = camera;
    return FitOf(camera, looks, FitLooks(e_, looks), pictures);
  }

  bool FindExchange() {
    struct Exchange {
      size_t a = 0, b = 0;
      double gain = 0;
      CameraFit before, after;
    } best;
    for (const size_t a : Suspects()) {
      for (const size_t b : cameras_) {
        if (a == b || e_.cameras[a].width != e_.cameras[b].width || e_.cameras[a].height != e_.cameras[b].height)
          continue;
        const CameraFit new_a = FitWithPicturesOf(a, b), new_b = FitWithPicturesOf(b, a);
        const double gain_a = new_a.Total() - now_[a].Total(), gain_b = new_b.Total() - now_[b].Total();
        if (gain_a + gain_b < best.gain || gain_a + gain_b < 2 * kLeastGain) continue;
        if (std::min(gain_a, gain_b) < 0 || (new_a.has_agreement && new_a.agreement < now_[a].agreement)) continue;
        best = {a, b, gain_a + gain_b, now_[a], new_a};
      }
    }
    if (best.gain == 0) return false;
    if (e_.cameras[best.a].name > e_.cameras[best.b].name) {
      std::swap(best.a, best.b);
      best.before = now_[best.a];
      best.after = FitWithPicturesOf(best.a, best.b);
    }
    const std::string &a = e_.cameras[best.a].name, &b = e_.cameras[best.b].name;
    Finding& finding =
        e_.Found("cameras-exchanged", Severity::kMustFix, fmt::format("cameras {} and {}", a, b),
                 "the cameras' names are exchanged: each one's images fit the other's calibration",
                 fmt::format("exchange the names {} and {} in KRT, or their image folders (and masks)", a, b));
    finding.evidence = fmt::format("camera {}: {}", a, Gain(best.before, best.after));
    finding.confidence = ConfidenceOf(best.gain);
    Hypothesis exchanged;
    const Camera other[] = {e_.cameras[best.a], e_.cameras[best.b]};
    exchanged.camera = [first = e_.SmallCamera(other[0]), second = e_.SmallCamera(other[1])](const Camera& camera) {
      Camera changed = camera.name == first.name ? second : first;
      changed.name = camera.name;
      return changed;
    };
    finding.draw = DrawLooks(e_, LooksAt(e_, {frames_[0]}, {best.a, best.b}), exchanged, "as named", "exchanged");
    std::swap(e_.cameras[best.a], e_.cameras[best.b]);
    std::swap(e_.cameras[best.a].name, e_.cameras[best.b].name);
    return true;
  }

  bool FindMistake() {
    struct Mistake {
      size_t camera = 0;
      Hypothesis hypothesis;
      double gain = 0;
      CameraFit after;
    } best;
    for (const size_t c : Suspects()) {
      const std::vector<Look> looks = OwnLooks(c);
      std::vector<Hypothesis> hypotheses = IntrinsicsFits(e_, looks);
      for (Hypothesis& hypothesis : CameraHypotheses()) hypotheses.push_back(std::move(hypothesis));
      for (Hypothesis& hypothesis : WorldHypotheses()) {
        if (hypothesis.code == "units-calibration") hypotheses.push_back(std::move(hypothesis));
      }
      for (const Hypothesis& hypothesis : hypotheses) {
        const CameraFit fit = FitOf(c, looks, FitLooks(e_, looks, &hypothesis));
        const double gain = fit.Total() - now_[c].Total();
        if (gain < kLeastGain || gain < best.gain + 0.01) continue;
        if (fit.has_agreement && fit.agreement < kGoodAgreement) continue;
        if (now_[c].has_agreement && fit.has_agreement && fit.agreement < now_[c].agreement + 0.05) continue;
        best = {c, hypothesis, gain, fit};
      }
    }
    if (best.gain == 0) return false;
    const Camera& camera = e_.cameras[best.camera];
    Finding& finding = e_.Found(best.hypothesis.code.c_str(), Severity::kMustFix, "camera " + camera.name,
                                best.hypothesis.what, best.hypothesis.advice + " (of this camera alone)");
    finding.evidence = Gain(now_[best.camera], best.after);
    finding.confidence = ConfidenceOf(best.gain);
    finding.draw = DrawLooks(e_, OwnLooks(best.camera), best.hypothesis, "as the files say", "corrected");
    e_.cameras[best.camera] = best.hypothesis.camera(camera);
    return true;
  }

  // What is left over: a camera that fits far worse than the others, by no known mistake.
  void FindMisfits() {
    std::vector<double> overlaps, agreements;
    for (const auto& [c, fit] : now_) {
      if (fit.overlap >= 0) overlaps.push_back(fit.overlap);
      if (fit.has_agreement) agreements.push_back(fit.agreement);
    }
    if (now_.size() < 3) return;
    const double usual_overlap = overlaps.empty() ? 0 : Median(overlaps),
                 usual = agreements.empty() ? 0 : Median(agreements);
    for (const auto& [c, fit] : now_) {
      const bool overlap_is_low = fit.overlap >= 0 && fit.overlap < 0.75 * usual_overlap;
      const bool agreement_is_low = fit.has_agreement && usual > 0.2 && fit.agreement < 0.3 * usual;
      if (!overlap_is_low && !(agreement_is_low && fit.overlap < usual_overlap - 0.05)) continue;
      Finding& finding =
          e_.Found("camera-misfit", Severity::kMustFix, "camera " + e_.cameras[c].name,
                   "the mesh does not lie on the head in this camera's pictures, though it does in others'",
                   "calibrate this camera again, or take it out of KRT");
      finding.evidence = fmt::format(
          "mesh over foreground {:.0f}% (usual {:.0f}%), agreement with other cameras {:.2f} (usual {:.2f})",
          100 * fit.overlap, 100 * usual_overlap, fit.agreement, usual);
      finding.confidence = 0.8;
      finding.draw = DrawLooks(e_, OwnLooks(c), Hypothesis(), "as the files say", "the same");
    }
  }

  Examination& e_;
  std::vector<int> frames_;
  std::vector<size_t> cameras_;
  std::vector<Look> looks_;
  std::vector<ViewFit> fits_;
  std::map<size_t, CameraFit> now_;
};

}  // namespace

void CheckCameras(Examination* e) {
  if (e->placed) CameraCheck(e).Run();
}

}  // namespace likeness
