// The checks, in the order in which they run: each may lean on what those before it corrected.

#pragma once

#include "likeness/validate/examination.h"

namespace likeness {

// Files by themselves.
void CheckCalibration(Examination* e);  // KRT as numbers: transposed or malformed K, R that is no rotation, distortion
void CheckFrameList(Examination* e);    // listed but absent, present but not listed, listed twice
void CheckTopology(Examination* e);     // faces, texture coordinates
void CheckMeshes(Examination* e);       // vertex count, numbers that are none, outliers; poses that are not rigid
void CheckImageFiles(Examination* e);   // absent, unreadable, of another size, the same bytes under several numbers
void CheckSplit(Examination* e);        // cameras and segments that the capture lacks

// Pictures by themselves. LoadSample reads what all later checks look at.
void LoadSample(Examination* e);
void CheckExposure(Examination* e);  // black or overexposed
void CheckMasks(Examination* e);     // inverted, empty, of another size, of another picture

// Geometry against pictures.
void CheckPlacement(Examination* e);     // mistakes that all cameras share: units, axes, inverses, resolution
void CheckMeshSpace(Examination* e);     // handedness, which way is up, texture coordinates upside down
void CheckPosesPresent(Examination* e);  // all poses alike though the head moves
void CheckTime(Examination* e);          // images a frame early or late, of all cameras or of one
void CheckCameras(Examination* e);       // names exchanged, and mistakes of single cameras
void CheckHeadPoses(Examination* e);     // frames whose pose is wrong
void CheckColours(Examination* e);       // cameras with red and blue exchanged

// What was made from the capture.
void CheckTextures(Examination* e);    // flipped, shifted, red and blue exchanged
void CheckStatistics(Examination* e);  // means and variances that do not belong to the textures

struct NamedCheck {
  const char* name;
  void (*run)(Examination*);
};
inline constexpr NamedCheck kChecks[] = {
    {"calibration", CheckCalibration},
    {"frame list", CheckFrameList},
    {"topology", CheckTopology},
    {"meshes", CheckMeshes},
    {"image files", CheckImageFiles},
    {"split", CheckSplit},
    {"reading a sample", LoadSample},
    {"exposure", CheckExposure},
    {"masks", CheckMasks},
    {"placement", CheckPlacement},
    {"mesh space", CheckMeshSpace},
    {"poses present", CheckPosesPresent},
    {"time", CheckTime},
    {"cameras", CheckCameras},
    {"head poses", CheckHeadPoses},
    {"colours", CheckColours},
    {"textures", CheckTextures},
    {"statistics", CheckStatistics},
};

}  // namespace likeness
