// What may be wrong with where files put a mesh before a camera, and how well a capture fits if it is.

#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "likeness/validate/examination.h"

namespace likeness {

// A mistake, as the change that undoes it. Parts that are not set leave things as they are.
struct Hypothesis {
  std::string code;  // the finding's
  std::string what;  // "cam_from_world is stored inverted ..."
  std::string advice;
  std::function<Camera(const Camera&)> camera;
  std::function<RigidTransform(const RigidTransform&)> pose;
  Eigen::Matrix3d mesh = Eigen::Matrix3d::Identity();

  Placement Apply(const Placement& placement) const;
};

// Mistakes of cameras alone, which all or one of them may have.
std::vector<Hypothesis> CameraHypotheses();
// Those that all cameras share: the world's axes, units of translations.
std::vector<Hypothesis> WorldHypotheses();
// Of all head poses.
std::vector<Hypothesis> PoseHypotheses();
// Of all meshes (and what may share their units): axes, mirrored, and, if its size is not a head's, units.
std::vector<Hypothesis> MeshHypotheses(double mesh_size_in_file);

// How much larger than in millimetres a head's mesh with this diagonal seems to be written small: 1000 for metres, 10
// for centimetres, 25.4 for inches, 1 when it is millimetres or nothing fits. Heads measure 200 to 600 mm from corner
// to corner, with or without neck.
double UnitFromSize(double diagonal);
std::string UnitName(double scale);  // "metres"

// One picture held against one frame's mesh.
struct Look {
  size_t frame = 0, camera = 0;
  const View* view = nullptr;
};

// All pictures of these frames and cameras.
std::vector<Look> LooksAt(const Examination& e, const std::vector<int>& frames, const std::vector<size_t>& cameras);

// With the hypothesis if there is one. Uses all threads.
std::vector<ViewFit> FitLooks(const Examination& e, const std::vector<Look>& looks,
                              const Hypothesis* hypothesis = nullptr);

// Overlaps of all looks, agreements of those at the same frame.
FitScore ScoreLooks(const std::vector<Look>& looks, const std::vector<ViewFit>& fits);
// The same for every frame.
std::vector<FitScore> ScoreFrames(const std::vector<Look>& looks, const std::vector<ViewFit>& fits);

// The scale and offset of pixels that bring the mesh's box to the foreground's, as hypotheses about K. None where the
// mesh lies behind the cameras or no foreground is known.
std::vector<Hypothesis> IntrinsicsFits(const Examination& e, const std::vector<Look>& looks);

// "overlap 31% -> 88%, agreement 0.02 -> 0.61 over 18 pictures"
std::string DescribeGain(const FitScore& before, const FitScore& after);
// 0.5 for no gain, towards 1.
double ConfidenceOf(double gain);

// Two rows of pictures with the mesh over them: as the files say, and as the hypothesis does.
std::function<ImageU8()> DrawLooks(const Examination& e, std::vector<Look> looks, const Hypothesis& hypothesis,
                                   const std::string& before, const std::string& after);

}  // namespace likeness
