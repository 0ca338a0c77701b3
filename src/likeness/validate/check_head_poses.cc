// Frames whose head pose is wrong: the pose of another frame, none, or simply another one.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "likeness/validate/checks.h"
#include "likeness/validate/hypothesis.h"

namespace likeness {
namespace {

constexpr double kLeastGain = 0.1;
constexpr size_t kCameras = 5;
constexpr double kRadius_mm = 100;  // of a head: turns it into millimetres at the surface

double Distance(const RigidTransform& a, const RigidTransform& b) {
  return (a.translation - b.translation).norm() + kRadius_mm * (a.rotation - b.rotation).norm();
}

class PoseCheck {
 public:
  explicit PoseCheck(Examination* e) : e_(*e) {
    for (const int f : e->SampledFrames()) {
      const std::vector<View>& views = e->frames[static_cast<size_t>(f)].views;
      if (std::any_of(views.begin(), views.end(), [](const View& view) { return !view.empty(); })) frames_.push_back(f);
    }
    std::vector<size_t> cameras;
    for (size_t c = 0; c < e_.cameras.size(); ++c) {
      if (!LooksAt(e_, frames_, {c}).empty()) cameras.push_back(c);
    }
    for (size_t i = 0; i < std::min(kCameras, cameras.size()); ++i) {
      cameras_.push_back(cameras[cameras.size() <= kCameras ? i : i * (cameras.size() - 1) / (kCameras - 1)]);
    }
  }

  // All poses are one, though the head moves in the pictures.
  bool FindAbsent() {
    if (frames_.size() < 3) return false;
    for (size_t i = 1; i < frames_.size(); ++i) {
      if (Distance(frame(i).world_from_head, frame(0).world_from_head) > 0.05) return false;
    }
    const std::vector<FitScore> scores = ScoreAll();
    // Those that fit worst tell most; the search may end beside the mark in one of them.
    std::vector<size_t> order(scores.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return scores[a].Total() < scores[b].Total(); });
    order.resize(std::min<size_t>(order.size(), 4));
    for (const size_t i : order) {
      const auto [pose, score] = Refine(i, frame(i).world_from_head);
      if (score.Total() < scores[i].Total() + kLeastGain || Distance(pose, frame(i).world_from_head) < 4) continue;
      Tell("head-pose-absent", i, "all head poses are the same, but the head moves in the pictures: poses are missing",
           "write each frame's own pose, [R | t] from head to world, into its _transform.txt", scores[i], score, pose);
      e_.report.findings.back().where = "head poses, all frames";
      return true;
    }
    return false;
  }

  void Run() {
    const std::vector<FitScore> scores = ScoreAll();
    if (scores.empty()) return;
    std::vector<double> totals;
    for (const FitScore& score : scores) totals.push_back(score.Total());
    std::nth_element(totals.begin(), totals.begin() + static_cast<std::ptrdiff_t>(totals.size() / 2), totals.end());
    const double usual = totals[totals.size() / 2];
    for (size_t i = 0; i < scores.size(); ++i) {
      if (scores[i].Total() < usual - 0.06) Explain(i, scores[i], usual);
    }
  }

 private:
  ExaminedFrame& frame(size_t i) { return e_.frames[static_cast<size_t>(frames_[i])]; }

  std::vector<FitScore> ScoreAll() {
    std::vector<FitScore> scores;
    for (const int f : frames_) {
      looks_.push_back(LooksAt(e_, {f}, cameras_));
      scores.push_back(Score(looks_.size() - 1, frame(looks_.size() - 1).world_from_head));
    }
    return scores;
  }

  FitScore Score(size_t i, const RigidTransform& pose) {
    Hypothesis hypothesis;
    hypothesis.pose = [&pose](const RigidTransform&) { return pose; };
    return ScoreLooks(looks_[i], FitLooks(e_, looks_[i], &hypothesis));
  }

  // The pose near `start` that fits best, found by steps along and turns about each axis that grow smaller.
  std::pair<RigidTransform, FitScore> Refine(size_t i, const RigidTransform& start) {
    RigidTransform best = start;
    FitScore score = Score(i, best);
    for (double step_mm = 24; step_mm > 1; step_mm /= 2) {
      for (bool improved = true; improved;) {
        improved = false;
        for (int direction = 0; direction < 12; ++direction) {
          RigidTransform next = best;
          const double sign = direction % 2 == 0 ? 1 : -1;
          const Eigen::Vector3d axis = Eigen::Vector3d::Unit(direction / 2 % 3);
          if (direction < 6) {
            next.translation += sign * step_mm * axis;
          } else {
            next.rotation = Eigen::AngleAxisd(sign * step_mm / kRadius_mm, axis) * best.rotation;
          }
          const FitScore tried = Score(i, next);
          if (tried.Total() <= score.Total() + 1e-3) continue;
          best = next, score = tried, improved = true;
        }
      }
    }
    return {best, score};
  }

  std::string PoseFile(size_t i) { return e_.Relative(e_.layout.HeadPose(frame(i).id)); }

  void Tell(const char* code, size_t i, const std::string& what, const std::string& advice, const FitScore& before,
            const FitScore& after, const RigidTransform& pose) {
    Finding& finding = e_.Found(code, Severity::kMustFix, PoseFile(i), what, advice);
    finding.evidence = DescribeGain(before, after);
    finding.confidence = ConfidenceOf(after.Total() - before.Total());
    Hypothesis corrected;
    corrected.pose = [pose](const RigidTransform&) { return pose; };
    finding.draw = DrawLooks(e_, looks_[i], corrected, "as the file says", "corrected");
    frame(i).world_from_head = pose;
  }

  void Explain(size_t i, const FitScore& now, double usual) {
    const RigidTransform own = frame(i).world_from_head;
    struct Candidate {
      std::string code, what, advice;
      RigidTransform pose;
    };
    std::vector<Candidate> candidates = {{"head-pose-inverted", "the head pose of this frame is world to head",
                                          "invert it: R^T and -R^T t", own.Inverse()},
                                         {"head-pose-transposed",
                                          "R of this frame's head pose is transposed",
                                          "write R's rows as rows",
                                          {own.rotation.transpose(), own.translation}}};
    for (const ExaminedFrame& other : e_.frames) {
      if (&other == &frame(i) || !other.has_pose || Distance(other.world_from_head, own) < 1) continue;
      const bool near = std::abs(&other - &frame(i)) <= 3;
      if (!near && !other.sampled()) continue;
      candidates.push_back(
          {"head-pose-of-another-frame",
           fmt::format("the head pose fits worse than that of {}/{}", other.id.segment, other.id.frame),
           "export the head poses again: they may be shifted or exchanged", other.world_from_head});
    }
    const Candidate* best = nullptr;
    FitScore best_score = now;
    for (const Candidate& candidate : candidates) {
      const FitScore score = Score(i, candidate.pose);
      if (score.Total() < std::max(now.Total() + kLeastGain, best_score.Total() + 0.01)) continue;
      best = &candidate, best_score = score;
    }
    // A named cause must explain nearly all of what is missing.
    if (best != nullptr && best_score.Total() > usual - 0.12) {
      Tell(best->code.c_str(), i, best->what, best->advice, now, best_score, best->pose);
      return;
    }
    const auto [pose, score] = Refine(i, best != nullptr ? best->pose : own);
    const double moved = Distance(pose, own);
    if (score.Total() > now.Total() + kLeastGain && score.Total() > usual - 0.25 && moved > 6) {
      Tell("head-pose-wrong", i,
           fmt::format("another head pose fits far better: {:.0f} mm away, turned by {:.0f} degrees",
                       (pose.translation - own.translation).norm(),
                       Eigen::AngleAxisd(pose.rotation.transpose() * own.rotation).angle() * 57.2958),
           "track this frame again, or take it off frame_list.txt", now, score, pose);
    } else if (now.Total() < usual - 0.4 && now.Overlap() < 0.5) {
      Finding& finding =
          e_.Found("frame-misfit", Severity::kMustFix, e_.Relative(e_.layout.MeshBinary(frame(i).id)),
                   "the mesh does not lie on the head in this frame's pictures, though it does in others'",
                   "track this frame again, or take it off frame_list.txt");
      finding.evidence = fmt::format("mesh over foreground {:.0f}%, agreement of cameras {:.2f}", 100 * now.Overlap(),
                                     now.Agreement());
      finding.confidence = 0.8;
      finding.draw = DrawLooks(e_, looks_[i], Hypothesis(), "as the files say", "the same");
    }
  }

  Examination& e_;
  std::vector<int> frames_;  // with pictures
  std::vector<size_t> cameras_;
  std::vector<std::vector<Look>> looks_;  // of each frame
};

}  // namespace

void CheckPosesPresent(Examination* e) {
  // Without poses nothing finer can be told.
  if (e->placed && PoseCheck(e).FindAbsent()) e->placed = false;
}

void CheckHeadPoses(Examination* e) {
  if (e->placed) PoseCheck(e).Run();
}

}  // namespace likeness
