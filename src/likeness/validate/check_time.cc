// Images that are a frame early or late: their neighbour's mesh would fit them better.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "likeness/validate/checks.h"
#include "likeness/validate/hypothesis.h"

namespace likeness {
namespace {

// Mean gain, in overlap plus agreement, that tells; and in how many of the frames it must be seen.
constexpr double kLeastGain = 0.03;
constexpr double kConsistent = 0.75;
constexpr double kGoodAgreement = 0.3;

struct Shift {
  int by = 0;  // images show the frame that is so much later in the segment
  double gain = 0;
  double share = 0;  // of frames that gain
  int frames = 0;
  FitScore before, after;

  // Silhouettes alone may gain by chance where a camera is misplaced: what cameras agree on must come out right.
  bool Tells() const {
    const bool agrees =
        after.agreement_weight == 0 || (after.Agreement() > kGoodAgreement && after.Agreement() > before.Agreement());
    return frames >= 2 && gain > kLeastGain && share >= kConsistent && agrees;
  }
};

// Frame `by` places further in the segment, where it was sampled.
const ExaminedFrame* Neighbour(const Examination& e, size_t frame, int by) {
  const auto index = static_cast<std::ptrdiff_t>(frame) + by;
  if (index < 0 || index >= static_cast<std::ptrdiff_t>(e.frames.size())) return nullptr;
  const ExaminedFrame& neighbour = e.frames[static_cast<size_t>(index)];
  return neighbour.sampled() && neighbour.id.segment == e.frames[frame].id.segment ? &neighbour : nullptr;
}

void Add(FitScore* sum, const FitScore& score) {
  sum->views += score.views;
  sum->views_with_foreground += score.views_with_foreground;
  sum->overlap_sum += score.overlap_sum;
  sum->inside_sum += score.inside_sum;
  sum->agreement_sum += score.agreement_sum;
  sum->agreement_weight += score.agreement_weight;
}

// The frames as they are, fitted once.
class Fits {
 public:
  Fits(const Examination& e, const std::vector<size_t>& cameras) : e_(e) {
    for (const int f : e.SampledFrames()) {
      const auto frame = static_cast<size_t>(f);
      if (Neighbour(e, frame, 1) == nullptr && Neighbour(e, frame, -1) == nullptr) continue;
      std::vector<Look> looks = LooksAt(e, {f}, cameras);
      std::vector<ViewFit> fits = FitLooks(e, looks);
      frames_.push_back({frame, std::move(looks), std::move(fits)});
    }
  }

  // Of some cameras (all, or one): the picture of frame - by is held against the mesh of each frame. One camera alone
  // is weighed against the others, which stay as they are.
  Shift Try(const std::vector<size_t>& moved, int by) const {
    Shift shift;
    shift.by = by;
    int gained = 0;
    double sum = 0;
    for (const Frame& frame : frames_) {
      const ExaminedFrame* neighbour = Neighbour(e_, frame.frame, -by);
      if (neighbour == nullptr) continue;
      std::vector<Look> looks;
      std::vector<size_t> which;
      for (size_t i = 0; i < frame.looks.size(); ++i) {
        if (std::find(moved.begin(), moved.end(), frame.looks[i].camera) == moved.end()) continue;
        const View& view = neighbour->views[frame.looks[i].camera];
        if (view.empty()) continue;
        looks.push_back({frame.frame, frame.looks[i].camera, &view});
        which.push_back(i);
      }
      if (looks.empty()) continue;
      std::vector<ViewFit> after = frame.fits, own = FitLooks(e_, looks);
      for (size_t i = 0; i < which.size(); ++i) after[which[i]] = std::move(own[i]);
      const FitScore a = Score(frame.looks, frame.fits, moved), b = Score(frame.looks, after, moved);
      Add(&shift.before, a);
      Add(&shift.after, b);
      ++shift.frames;
      sum += b.Total() - a.Total();
      gained += b.Total() > a.Total();
    }
    if (shift.frames > 0) {
      shift.gain = sum / shift.frames;
      shift.share = static_cast<double>(gained) / shift.frames;
    }
    return shift;
  }

 private:
  struct Frame {
    size_t frame = 0;
    std::vector<Look> looks;
    std::vector<ViewFit> fits;
  };

  // Overlaps of the moved cameras, and agreements that one of them has part in.
  static FitScore Score(const std::vector<Look>& looks, const std::vector<ViewFit>& fits,
                        const std::vector<size_t>& moved) {
    FitScore score;
    for (size_t i = 0; i < looks.size(); ++i) {
      const bool is_moved = std::find(moved.begin(), moved.end(), looks[i].camera) != moved.end();
      if (is_moved) score.Add(fits[i]);
      for (size_t k = i + 1; k < looks.size(); ++k) {
        if (is_moved || std::find(moved.begin(), moved.end(), looks[k].camera) != moved.end())
          score.Add(Agree(fits[i], fits[k]));
      }
    }
    return score;
  }

  const Examination& e_;
  std::vector<Frame> frames_;
};

// Moves the pictures of some cameras to the frames that they show.
void Correct(Examination* e, const std::vector<size_t>& moved, int by) {
  std::vector<std::vector<View>> views(e->frames.size());
  for (size_t f = 0; f < e->frames.size(); ++f) {
    if (!e->frames[f].sampled()) continue;
    views[f] = e->frames[f].views;
    const ExaminedFrame* neighbour = Neighbour(*e, f, -by);
    for (const size_t c : moved) views[f][c] = neighbour != nullptr ? neighbour->views[c] : View();
  }
  for (size_t f = 0; f < e->frames.size(); ++f) {
    if (e->frames[f].sampled()) e->frames[f].views = std::move(views[f]);
  }
}

void Tell(Examination* e, const char* code, const std::string& where, const std::string& who, const Shift& shift) {
  Finding& finding = e->Found(
      code, Severity::kMustFix, where,
      fmt::format("{} are {} frame {}: each fits the mesh of the frame {} it", who, std::abs(shift.by),
                  shift.by > 0 ? "early" : "late", shift.by > 0 ? "after" : "before"),
      fmt::format("give each image the number of the frame {} it in its segment", shift.by > 0 ? "after" : "before"));
  finding.evidence = fmt::format("{}; better in {:.0f}% of {} frames", DescribeGain(shift.before, shift.after),
                                 100 * shift.share, shift.frames);
  finding.confidence = ConfidenceOf(2 * shift.gain);
}

}  // namespace

void CheckTime(Examination* e) {
  if (!e->placed) return;
  std::vector<size_t> all;
  for (size_t c = 0; c < e->cameras.size(); ++c) {
    if (!LooksAt(*e, e->SampledFrames(), {c}).empty()) all.push_back(c);
  }
  Shift best;
  {
    const Fits fits(*e, all);
    for (const int by : {1, -1}) {
      const Shift shift = fits.Try(all, by);
      if (shift.Tells() && shift.gain > best.gain) best = shift;
    }
  }
  if (best.by != 0) {
    Tell(e, "images-out-of-sync", "images, all cameras", "images", best);
    Correct(e, all, best.by);
  }
  // A camera that is out of step drags its neighbours' agreement down: the worst is corrected first.
  for (size_t round = 0; all.size() >= 2 && round < all.size(); ++round) {
    const Fits fits(*e, all);
    Shift worst;
    size_t which = 0;
    for (const size_t camera : all) {
      for (const int by : {1, -1}) {
        const Shift shift = fits.Try({camera}, by);
        if (shift.Tells() && shift.gain > worst.gain) worst = shift, which = camera;
      }
    }
    if (worst.by == 0) break;
    Tell(e, "camera-out-of-sync", "camera " + e->cameras[which].name, "the camera's images", worst);
    Correct(e, {which}, worst.by);
  }
}

}  // namespace likeness
