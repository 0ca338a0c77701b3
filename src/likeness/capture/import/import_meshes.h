// Tracked meshes and head poses for an imported capture.

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "likeness/capture/import/file_pattern.h"
#include "likeness/capture/import/import_capture.h"

namespace likeness {

// Millimetres in one of "m", "cm", "mm", "inch". Throws Error for other words.
double MillimetresPer(const std::string& unit);

// The pose of a head whose vertices are given in world space: the definition in import_capture.h. `up` is a direction
// in the world. Throws Error when the cameras stand exactly above or below.
RigidTransform HeadAxes(const Eigen::MatrixX3d& vertices_in_world, const Eigen::Vector3d& camera_centre,
                        const Eigen::Vector3d& up);

// Writes what tracked_mesh/ holds for `frames`, as far as options.meshes and options.poses give it, and adds what is
// missing to result->remarks. `cameras` are in millimetres.
void ImportMeshes(const ImportOptions& options, const std::vector<FrameId>& frames, const std::vector<Camera>& cameras,
                  ImportResult* result);

}  // namespace likeness
