// Mistakes that all cameras share. The mesh is laid over the pictures as the files say, then as if each known mistake
// had been made; what explains the pictures by far better is the mistake. It is corrected, and the search goes on:
// captures can have two.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "likeness/capture/contact_sheet.h"
#include "likeness/validate/checks.h"
#include "likeness/validate/hypothesis.h"

namespace likeness {
namespace {

constexpr size_t kFrames = 4, kCameras = 6;
constexpr int kMostMistakes = 3;

// Gains of overlap plus agreement. Good captures lose by every hypothesis; near misses gain by noise.
constexpr double kLeastGain = 0.08;
constexpr double kLeastAgreementGain = 0.03;
// Below both, the mesh does not lie on what the pictures show.
constexpr double kPoorInside = 0.75;
constexpr double kPoorAgreement = 0.12;
// From here on no change of axes or units can be called for.
constexpr double kGoodAgreement = 0.5;

double MotionOf(const RigidTransform& pose) {
  return pose.translation.norm() + 100 * (pose.rotation - Eigen::Matrix3d::Identity()).norm();
}

// Those whose poses move the head most, as these tell right from wrong poses.
std::vector<int> ChooseFrames(const Examination& e) {
  std::vector<int> frames = e.SampledFrames();
  std::stable_sort(frames.begin(), frames.end(), [&](int a, int b) {
    return MotionOf(e.frames[static_cast<size_t>(a)].world_from_head) >
           MotionOf(e.frames[static_cast<size_t>(b)].world_from_head);
  });
  // The very farthest may be a single wrong pose: leave it out where there are enough.
  if (frames.size() > kFrames) frames.erase(frames.begin());
  if (frames.size() > kFrames) frames.resize(kFrames);
  return frames;
}

double MeshSize(const Examination& e, const std::vector<int>& frames) {
  const Vertices& v = e.frames[static_cast<size_t>(frames.front())].vertices;
  Eigen::Array3f low = Eigen::Array3f::Constant(1e30f), high = -low;
  for (const Eigen::Vector3i& t : e.topology.triangles) {
    for (const int i : t) {
      low = low.min(v.row(i).transpose().array());
      high = high.max(v.row(i).transpose().array());
    }
  }
  return (high - low).matrix().norm();
}

struct Best {
  Hypothesis hypothesis;
  FitScore score;
  double first_total = 0;  // of the first frame
};

// Whether most frames agree that the hypothesis is better.
bool Consistent(const std::vector<FitScore>& before, const std::vector<FitScore>& after) {
  size_t better = 0;
  for (size_t i = 0; i < before.size(); ++i) better += after[i].Total() > before[i].Total();
  return 3 * better >= 2 * before.size();
}

// Whether the hypothesis may be worth a closer look: most of the surface falls on foreground. Far cheaper than a fit.
bool IsPossible(const Examination& e, const Look& look, const Hypothesis& hypothesis) {
  if (look.view->foreground.empty()) return true;
  const Placement placement = hypothesis.Apply(e.Place(e.frames[look.frame], look.camera));
  const Vertices& vertices = e.frames[look.frame].vertices;
  const ImageU8& foreground = look.view->foreground;
  size_t looked = 0, on = 0;
  for (size_t i = 0; i < e.points.size(); i += 8, ++looked) {
    const int vertex = e.topology.triangles[static_cast<size_t>(e.points[i].triangle)][0];
    const Eigen::Vector3d point = placement.mesh_from_file * vertices.row(vertex).transpose().cast<double>();
    const Eigen::Vector3d in_cam = placement.camera.cam_from_world * (placement.world_from_head * point);
    if (!(in_cam.z() > 0)) continue;
    const Eigen::Vector2d pixel = (placement.camera.intrinsics * in_cam).hnormalized();
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < foreground.width() && pixel.y() < foreground.height()))
      continue;
    on += *foreground.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())) != 0;
  }
  return 5 * on > 2 * looked;
}

// Whether the hypothesis is better by all that is asked of one.
bool IsBetter(const FitScore& now, const FitScore& score) {
  if (score.Total() < now.Total() + kLeastGain) return false;
  if (now.agreement_weight > 0 && score.Agreement() < now.Agreement() + kLeastAgreementGain) return false;
  return score.Overlap() >= now.Overlap() - 0.02 && (score.views_with_foreground == 0 || score.Inside() > 0.5);
}

// Looks at one frame first, and at all of them only with what helps there.
std::optional<Best> FindBest(const Examination& e, const std::vector<Look>& looks,
                             const std::vector<Hypothesis>& hypotheses) {
  std::vector<Look> first;
  for (const Look& look : looks) {
    if (look.frame == looks.front().frame) first.push_back(look);
  }
  const FitScore first_now = ScoreLooks(first, FitLooks(e, first));
  const std::vector<ViewFit> now_fits = FitLooks(e, looks);
  const FitScore now = ScoreLooks(looks, now_fits);
  const std::vector<FitScore> now_by_frame = ScoreFrames(looks, now_fits);
  std::optional<Best> best;
  for (const Hypothesis& hypothesis : hypotheses) {
    size_t possible = 0;
    for (const Look& look : first) possible += IsPossible(e, look, hypothesis);
    if (2 * possible < first.size()) continue;
    const FitScore first_score = ScoreLooks(first, FitLooks(e, first, &hypothesis));
    if (first_score.Total() < first_now.Total() + kLeastGain / 2 ||
        (best && first_score.Total() < best->first_total - 0.1)) {
      continue;
    }
    const std::vector<ViewFit> fits = FitLooks(e, looks, &hypothesis);
    const FitScore score = ScoreLooks(looks, fits);
    if (!IsBetter(now, score) || !Consistent(now_by_frame, ScoreFrames(looks, fits))) continue;
    // The earlier, simpler one wins when another is no better.
    if (!best || score.Total() > best->score.Total() + 0.01) best = {hypothesis, score, first_score.Total()};
  }
  return best;
}

void Correct(Examination* e, const Hypothesis& hypothesis) {
  if (hypothesis.camera) {
    for (Camera& camera : e->cameras) {
      if (camera.width > 0) camera = hypothesis.camera(camera);
    }
  }
  if (hypothesis.pose) {
    for (ExaminedFrame& frame : e->frames) frame.world_from_head = hypothesis.pose(frame.world_from_head);
  }
  e->mesh_from_file = hypothesis.mesh * e->mesh_from_file;
}

const char* WhereOf(const Hypothesis& hypothesis) {
  if (hypothesis.code.starts_with("images-")) return "images";
  if (hypothesis.camera && !hypothesis.mesh.isIdentity(0)) return "all files";
  if (hypothesis.camera) return "calibration, all cameras";
  return hypothesis.mesh.isIdentity(0) ? "head poses, all frames" : "meshes, all frames";
}

// Where all lengths share a wrong unit, everything fits, and only the head's size tells.
void TellUnits(Examination* e, const std::vector<int>& frames) {
  const double size = e->mesh_from_file.col(0).norm() * MeshSize(*e, frames);
  if (UnitFromSize(size) == 1) return;
  for (const Hypothesis& hypothesis : MeshHypotheses(size)) {
    if (hypothesis.code != "units-capture") continue;
    Finding& finding =
        e->Found(hypothesis.code.c_str(), Severity::kMustFix, WhereOf(hypothesis), hypothesis.what, hypothesis.advice);
    finding.evidence = fmt::format("the mesh measures {:.4g} from corner to corner; heads measure 200 to 600 mm", size);
    finding.confidence = 0.9;
    Correct(e, hypothesis);
  }
}

}  // namespace

void CheckPlacement(Examination* e) {
  const std::vector<int> frames = ChooseFrames(*e);
  if (frames.empty()) return;
  std::vector<size_t> cameras;
  for (size_t c = 0; c < e->cameras.size(); ++c) {
    if (!LooksAt(*e, frames, {c}).empty()) cameras.push_back(c);
  }
  std::vector<size_t> chosen;
  for (const size_t i : EvenlySpread(cameras.size(), kCameras)) chosen.push_back(cameras[i]);
  const std::vector<Look> looks = LooksAt(*e, frames, chosen);
  if (looks.empty()) return;

  FitScore score;
  for (int mistake = 0; mistake <= kMostMistakes; ++mistake) {
    const std::vector<ViewFit> fits = FitLooks(*e, looks);
    score = ScoreLooks(looks, fits);
    if (mistake == kMostMistakes) break;
    std::vector<Hypothesis> hypotheses = IntrinsicsFits(*e, looks);
    const auto add = [&](std::vector<Hypothesis> list) {
      std::move(list.begin(), list.end(), std::back_inserter(hypotheses));
    };
    // Cameras that mirror are known already (check_calibration.cc); the pictures tell which axis it is.
    const bool mirrors = std::any_of(e->cameras.begin(), e->cameras.end(), [](const Camera& camera) {
      return camera.cam_from_world.rotation.determinant() < 0;
    });
    for (Hypothesis& hypothesis : CameraHypotheses()) {
      if (mirrors != (hypothesis.code == "camera-axes-mirrored")) continue;
      hypotheses.push_back(std::move(hypothesis));
    }
    add(PoseHypotheses());
    if (score.Agreement() < kGoodAgreement || score.Inside() < kPoorInside) {
      add(MeshHypotheses(e->mesh_from_file.col(0).norm() * MeshSize(*e, frames)));
      add(WorldHypotheses());
    }
    const auto best = FindBest(*e, looks, hypotheses);
    if (!best) break;
    Finding* known = nullptr;
    for (Finding& earlier : e->report.findings) {
      if (mirrors && earlier.code == "rotation-mirrors") known = &earlier;
    }
    Finding& finding = known != nullptr ? *known
                                        : e->Found(best->hypothesis.code.c_str(), Severity::kMustFix,
                                                   WhereOf(best->hypothesis), "", best->hypothesis.advice);
    finding.what = best->hypothesis.what;
    finding.advice = best->hypothesis.advice;
    finding.evidence = DescribeGain(score, best->score);
    finding.confidence = ConfidenceOf(best->score.Total() - score.Total());
    finding.draw = DrawLooks(*e, looks, best->hypothesis, "as the files say", "corrected");
    Correct(e, best->hypothesis);
  }
  TellUnits(e, frames);
  e->report.overlap = score.Overlap();
  e->report.agreement = score.Agreement();
  const bool off = score.views_with_foreground > 0 ? score.Inside() < kPoorInside && score.Agreement() < 0.3
                                                   : score.agreement_weight > 0 && score.Agreement() < kPoorAgreement;
  if (!off && (score.agreement_weight == 0 || score.Agreement() > kPoorAgreement)) {
    e->placed = true;
    return;
  }
  if (!off && score.Inside() > 0.9 && score.Overlap() > 0.75) {
    e->placed = true;  // a surface without detail
    return;
  }
  Finding& finding =
      e->Found("mesh-off-head", Severity::kMustFix, "calibration, head poses or meshes",
               "the mesh does not lie on the head in the pictures, and no known mistake explains it",
               "draw it with --overlay or likeness inspect; see whether the calibration belongs to this capture");
  finding.evidence = fmt::format("{:.0f}% of the mesh lies on foreground, agreement of cameras {:.2f}, in {} pictures",
                                 100 * score.Inside(), score.Agreement(), score.views);
  finding.confidence = 0.8;
  finding.draw = DrawLooks(*e, looks, Hypothesis(), "as the files say", "the same");
}

}  // namespace likeness
