// Where on a face things are: functions of a point of the average head, before any identity, in millimetres from the
// middle between the eyes (x to the subject's left, y up, z out of the nose). They fit every identity, as shapes move
// the average head's skin and do not slide along it.

#pragma once

#include <Eigen/Core>

namespace likeness {

// Origin of this space on the base mesh.
inline const Eigen::Vector3f kRegionOrigin(0, 728, 125);

// All return weights in [0, 1].
float CheekWeight(const Eigen::Vector3f& p);     // the red of cheeks
float NoseTipWeight(const Eigen::Vector3f& p);   // tip and wings of the nose
float TZoneWeight(const Eigen::Vector3f& p);     // forehead, nose, chin: more oil
float FaceWeight(const Eigen::Vector3f& p);      // where skin shows pores: not scalp, ears, neck
float BeardWeight(const Eigen::Vector3f& p);     // moustache, chin, jaw, upper neck
float UnderEyeWeight(const Eigen::Vector3f& p);  // the thin, darker skin below the eyes
// Scalp hair; `hairline` 0 low ... 1 receding.
float ScalpWeight(const Eigen::Vector3f& p, float hairline);

// Depth of expression lines that stay at rest, mm at age 1, 0 or less: forehead, crow's feet, below the eyes.
float WrinkleHeight(const Eigen::Vector3f& p);

// A frontal map of the face: millimetres along the skin from the middle, and height.
Eigen::Vector2f FrontalCoordinates(const Eigen::Vector3f& p);

}  // namespace likeness
