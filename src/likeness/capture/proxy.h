// Makes a capture whose meshes are coarser than the tracked ones, to find out what good geometry is worth (Lombardi et
// al. 2018, "Effect of Geometric and Viewpoint Coarseness").

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "likeness/avatar/architecture.h"
#include "likeness/capture/capture.h"

namespace likeness {

struct ProxyOptions {
  std::filesystem::path out;
  std::string kind = "taubin";  // see ProxyKinds()
  int iterations = 1000;        // of Taubin smoothing

  void Check() const;  // throws Error
};

// "taubin": each frame's mesh, smoothed (geometry/smooth.h).
// "ellipsoid": the smallest ellipsoid around the vertices of all frames, with texture coordinates of its own.
// "billboard": a board that faces the head's front, at the mean depth of what faces the front, so large that every
//   camera within 60 degrees of the front sees the whole mesh on it.
// The last two stand still in head space. Vertices without a triangle do not count.
const std::vector<std::string>& ProxyKinds();
Geometry ProxyGeometry(const std::string& kind);

struct ProxyReport {
  Geometry geometry = Geometry::kTracked;
  int frames = 0, vertices = 0, triangles = 0;
  int64_t files_linked = 0;  // images and masks, now
  int64_t files_kept = 0;    // from an earlier run
};

// Writes calibration, frame list, split, head poses, meshes and geometry.json (proxy_record.h) into `options.out`.
// Images and masks are symbolic links, relative, to those of `source`, which is only read and must stay where it is:
// what is written over a link later replaces the link. Textures are not carried, as they belong to the other mesh.
//
// `source` must lie in the layout that is written (likeness convert makes one of any other). Goes on where an earlier
// run with the same source and options stopped. Throws Error as ClaimFolder and CheckApart do, where the disk knows no
// links, and on Ctrl-C.
ProxyReport MakeProxy(const Capture& source, const ProxyOptions& options);

}  // namespace likeness
