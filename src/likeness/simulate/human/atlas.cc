#include "likeness/simulate/human/atlas.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "likeness/base/error.h"
#include "likeness/simulate/parametrise.h"

namespace likeness {
namespace {

// Texel centres of a 512 texture stay clear of the border, and the two charts are this far apart.
constexpr float kGap = 3.0f / 512;
constexpr float kMouthHeight = 0.17f;
constexpr int kRounds = 24;

const Eigen::Vector3f kFaceCentre(0, 695, 150);  // on the base mesh, between nose and mouth
const Eigen::Vector3f kMouthCentre(0, 662, 147);

float Smooth(float low, float high, float value) {
  const float t = std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// Wanted texels a millimetre, relative.
float FaceDensity(const Eigen::Vector3f& p) {
  const float far = Smooth(75, 150, (p - kFaceCentre).norm());
  float density = 1 - 0.68f * far;
  for (const float x : {-32.0f, 32.0f}) {
    density += 0.7f * (1 - Smooth(14, 32, (p - Eigen::Vector3f(x, 729, 135)).norm()));
  }
  density += 0.5f * (1 - Smooth(18, 38, (p - kMouthCentre).norm()));
  return density;
}

constexpr float kPatchDensity = 3.5f;  // eyes change more than any skin

float MouthDensity(const Eigen::Vector3f& p) { return 0.25f + 0.75f * Smooth(95, 130, p.z()); }

Eigen::Vector3f Centroid(const Vertices& vertices, const Quad& quad) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const int v : quad) sum += vertices.row(v).transpose();
  return sum / 4;
}

// Spreads the vertices of a row over a straight side by arc length; the last one is left to the next side.
struct Border {
  const std::vector<Eigen::Vector3f>& positions;
  std::vector<std::pair<int, Eigen::Vector2f>> points;

  template <typename Density>
  void AddSide(const std::vector<int>& row, Eigen::Vector2f from, Eigen::Vector2f to, const Density& density) {
    std::vector<float> length = {0};
    for (size_t i = 1; i < row.size(); ++i) {
      const Eigen::Vector3f& a = positions[row[i - 1]];
      const Eigen::Vector3f& b = positions[row[i]];
      length.push_back(length.back() + (b - a).norm() * density((a + b) / 2));
    }
    for (size_t i = 0; i + 1 < row.size(); ++i) {
      points.emplace_back(row[i], from + (to - from) * (length[i] / length.back()));
    }
  }
};

// The line at the back of the head along which the face chart is cut, from the neck upwards: vertices on the mirror
// plane where MakeHuman's own chart is cut, continued down the neck.
std::vector<int> BackSeam(const BaseMesh& base) {
  const auto on_plane = [&](int v) { return std::abs(base.vertices(v, 0)) < 0.01f; };
  struct Edge {
    int quads = 0;
    std::set<std::pair<float, float>> middles;  // of the edge in MakeHuman's UVs: two where its chart is cut
  };
  std::map<std::pair<int, int>, Edge> edges;
  for (size_t q = 0; q < base.face.quads.size(); ++q) {
    for (int k = 0; k < 4; ++k) {
      const int a = base.face.quads[q][k], b = base.face.quads[q][(k + 1) % 4];
      if (!on_plane(a) || !on_plane(b)) continue;
      const Eigen::Vector2f middle = base.face.uvs[q][k] + base.face.uvs[q][(k + 1) % 4];
      Edge& edge = edges[std::minmax(a, b)];
      ++edge.quads;
      edge.middles.emplace(middle.x(), middle.y());
    }
  }
  // Behind the ears (z below that of the neck's axis) every edge of the neck counts.
  constexpr float kNeckTopY = 665, kNeckAxisZ = 34;
  std::map<int, std::vector<int>> neighbours;
  for (const auto& [ends, edge] : edges) {
    const bool on_neck = base.vertices(ends.first, 1) < kNeckTopY && base.vertices(ends.second, 1) < kNeckTopY &&
                         base.vertices(ends.first, 2) < kNeckAxisZ;
    if (edge.quads != 2 || !(on_neck || edge.middles.size() == 2)) continue;
    if (base.vertices(ends.first, 2) > 100) continue;
    neighbours[ends.first].push_back(ends.second);
    neighbours[ends.second].push_back(ends.first);
  }
  int start = -1;
  for (const auto& [v, others] : neighbours) {
    if (others.size() == 1 && (start < 0 || base.vertices(v, 1) < base.vertices(start, 1))) start = v;
  }
  LIKENESS_CHECK(start >= 0);
  std::vector<int> seam = {start};
  while (true) {
    const auto& others = neighbours[seam.back()];
    LIKENESS_CHECK(others.size() <= 2);
    const auto next = std::find_if(others.begin(), others.end(),
                                   [&](int v) { return seam.size() < 2 || v != seam[seam.size() - 2]; });
    if (next == others.end()) break;
    seam.push_back(*next);
  }
  return seam;
}

// Part of a loop from `from` to `to` in its direction, both included.
std::vector<int> LoopPart(const std::vector<int>& loop, size_t from, size_t to) {
  std::vector<int> part = {loop[from]};
  for (size_t i = from; i != to;) {
    i = (i + 1) % loop.size();
    part.push_back(loop[i]);
  }
  return part;
}

}  // namespace

SlitLoop OpenSlit(const std::vector<int>& loop, const Vertices& vertices) {
  const size_t half = loop.size() / 2;
  LIKENESS_CHECK(loop.size() % 2 == 0 && half > 2);
  size_t low = 0;
  float widest = -1;
  for (size_t i = 0; i < loop.size(); ++i) {
    const float width = vertices(loop[(i + half) % loop.size()], 0) - vertices(loop[i], 0);
    if (width > widest) widest = width, low = i;
  }
  const size_t high = (low + half) % loop.size();
  std::vector<int> one = LoopPart(loop, low, high), two = LoopPart(loop, high, low);
  std::reverse(two.begin(), two.end());
  const auto mean_y = [&](const std::vector<int>& row) {
    float sum = 0;
    for (const int v : row) sum += vertices(v, 1);
    return sum;
  };
  return mean_y(one) > mean_y(two) ? SlitLoop{one, two} : SlitLoop{two, one};
}

HeadAtlas BuildAtlas(const BaseMesh& base) {
  HeadAtlas atlas;

  // The face, cut open along the seam: seam vertices below its end become two, one for each side.
  Disc disc;
  std::map<std::pair<int, int>, int> face_index;  // (base vertex, 1 on the left of the seam) -> disc vertex
  const std::vector<int> seam = BackSeam(base);
  const std::set<int> doubled(seam.begin(), seam.end() - 1);
  const auto disc_vertex = [&](int v, bool left) {
    const auto [it, added] =
        face_index.try_emplace({v, doubled.contains(v) && left}, static_cast<int>(disc.positions.size()));
    if (added) disc.positions.emplace_back(base.vertices.row(v));
    return it->second;
  };
  for (const Quad& quad : base.face.quads) {
    const Eigen::Vector3f centroid = Centroid(base.vertices, quad);
    Quad corners;
    for (int k = 0; k < 4; ++k) corners[k] = disc_vertex(quad[k], centroid.x() > 0);
    atlas.face.push_back(corners);
    disc.faces.emplace_back(corners.begin(), corners.end());
    disc.density.push_back(FaceDensity(centroid));
  }

  // The holes of the face: two lid openings, the lips, and the neck below.
  std::vector<int> neck;
  for (const std::vector<int>& loop : BorderLoops(base.face.quads)) {
    const Eigen::Vector3f p = base.vertices.row(loop[0]);
    if (p.y() < 630 && loop.size() > 38) {
      neck = loop;
    } else if (p.y() > 700) {
      atlas.lids[p.x() > 0 ? kLeft : kRight] = OpenSlit(loop, base.vertices);
    } else {
      // Rungs between the lips close the mouth, which gets no texels here.
      const SlitLoop lips = OpenSlit(loop, base.vertices);
      const auto at = [&](int v) { return disc_vertex(v, false); };
      for (int i = 0; i < lips.segments(); ++i) {
        std::vector<int> face = {at(lips.upper[i]), at(lips.lower[i])};
        if (i == 0) face.pop_back();
        if (i + 1 < lips.segments()) face.push_back(at(lips.lower[i + 1]));
        face.push_back(at(lips.upper[i + 1]));
        disc.faces.push_back(face);
        disc.density.push_back(0);
      }
    }
  }
  LIKENESS_CHECK(!neck.empty());
  for (const int side : {kLeft, kRight}) {
    const SlitLoop& lids = atlas.lids[side];
    LIKENESS_CHECK(lids.segments() > 2);
    auto& patch = atlas.patches[side];
    patch.resize(lids.segments() + 1);
    for (int c = 0; c <= lids.segments(); ++c) {
      const Eigen::Vector3f upper = base.vertices.row(lids.upper[c]), lower = base.vertices.row(lids.lower[c]);
      for (int r = 0; r <= kPatchRows; ++r) {
        if (r == 0 || lids.upper[c] == lids.lower[c]) {
          patch[c][r] = disc_vertex(lids.upper[c], false);
        } else if (r == kPatchRows) {
          patch[c][r] = disc_vertex(lids.lower[c], false);
        } else {
          patch[c][r] = static_cast<int>(disc.positions.size());
          disc.positions.push_back(upper + (lower - upper) * (static_cast<float>(r) / kPatchRows));
        }
      }
    }
    for (int c = 0; c < lids.segments(); ++c) {
      for (int r = 0; r < kPatchRows; ++r) {
        std::vector<int> face = {patch[c][r], patch[c][r + 1], patch[c + 1][r + 1], patch[c + 1][r]};
        face.erase(std::unique(face.begin(), face.end()), face.end());
        if (face.front() == face.back()) face.pop_back();
        disc.faces.push_back(face);
        disc.density.push_back(kPatchDensity);
      }
    }
  }

  // Borders: the neck below, both sides of the seam left, above and right. A corner lies where the seam leaves the back
  // of the head.
  const float left = kGap / 2, right = 1 - kGap / 2, top = 1 - kGap / 2, bottom = kMouthHeight + kGap / 2;
  Border border{disc.positions, {}};
  const auto start = static_cast<size_t>(std::find(neck.begin(), neck.end(), seam.front()) - neck.begin());
  LIKENESS_CHECK(start < neck.size());
  std::vector<int> bottom_row;
  std::vector<int> ring = LoopPart(neck, start, (start + neck.size() - 1) % neck.size());
  if (base.vertices(ring[1], 0) > 0) std::reverse(ring.begin() + 1, ring.end());  // over the subject's right first
  for (size_t i = 0; i < ring.size(); ++i) bottom_row.push_back(disc_vertex(ring[i], false));
  bottom_row.push_back(disc_vertex(ring[0], true));
  size_t corner = 1;
  while (corner + 2 < seam.size() && base.vertices(seam[corner], 1) < 790) ++corner;
  const auto seam_part = [&](size_t from, size_t to, bool side) {
    std::vector<int> row;
    for (size_t i = from; i <= to; ++i) row.push_back(disc_vertex(seam[i], side));
    return row;
  };
  const auto reversed = [](std::vector<int> row) {
    std::reverse(row.begin(), row.end());
    return row;
  };
  const size_t end = seam.size() - 1;
  border.AddSide(bottom_row, {left, bottom}, {right, bottom}, FaceDensity);
  border.AddSide(seam_part(0, corner, true), {right, bottom}, {right, top}, FaceDensity);
  border.AddSide(seam_part(corner, end, true), {right, top}, {0.5f, top}, FaceDensity);
  border.AddSide(reversed(seam_part(corner, end, false)), {0.5f, top}, {left, top}, FaceDensity);
  border.AddSide(reversed(seam_part(0, corner, false)), {left, top}, {left, bottom}, FaceDensity);
  disc.border = border.points;
  atlas.uvs = MapDiscToRectangle(disc, kRounds);

  // The mouth: upper lip above, lower lip below, corners at the middle of the sides.
  Disc mouth;
  std::map<int, int> mouth_index;
  for (const Quad& quad : base.mouth.quads) {
    Quad corners;
    for (int k = 0; k < 4; ++k) {
      const auto [it, added] = mouth_index.try_emplace(quad[k], static_cast<int>(mouth.positions.size()));
      if (added) mouth.positions.emplace_back(base.vertices.row(quad[k]));
      corners[k] = it->second;
    }
    mouth.faces.emplace_back(corners.begin(), corners.end());
    mouth.density.push_back(MouthDensity(Centroid(base.vertices, quad)));
    atlas.mouth.push_back(corners);
  }
  const auto mouth_loops = BorderLoops(base.mouth.quads);
  LIKENESS_CHECK(mouth_loops.size() == 1);
  SlitLoop lips = OpenSlit(mouth_loops[0], base.vertices);
  for (auto* row : {&lips.upper, &lips.lower}) {
    for (int& v : *row) v = mouth_index.at(v);
  }
  const float mouth_bottom = kGap / 2, mouth_top = kMouthHeight - kGap / 2;
  const auto even = [](const Eigen::Vector3f&) { return 1.0f; };
  const auto part = [](const std::vector<int>& row, int from, int to) {
    return std::vector<int>(row.begin() + from, row.begin() + to + 1);
  };
  const int n = lips.segments(), turn = 3;  // this many segments at each corner go round the sides
  Border mouth_border{mouth.positions, {}};
  const float half = (mouth_bottom + mouth_top) / 2;
  mouth_border.AddSide(part(lips.lower, 0, turn), {left, half}, {left, mouth_bottom}, even);
  mouth_border.AddSide(part(lips.lower, turn, n - turn), {left, mouth_bottom}, {right, mouth_bottom}, even);
  mouth_border.AddSide(part(lips.lower, n - turn, n), {right, mouth_bottom}, {right, half}, even);
  mouth_border.AddSide(reversed(part(lips.upper, n - turn, n)), {right, half}, {right, mouth_top}, even);
  mouth_border.AddSide(reversed(part(lips.upper, turn, n - turn)), {right, mouth_top}, {left, mouth_top}, even);
  mouth_border.AddSide(reversed(part(lips.upper, 0, turn)), {left, mouth_top}, {left, half}, even);
  mouth.border = mouth_border.points;
  const std::vector<Eigen::Vector2f> mouth_uvs = MapDiscToRectangle(mouth, kRounds);
  const int offset = static_cast<int>(atlas.uvs.size());
  atlas.uvs.insert(atlas.uvs.end(), mouth_uvs.begin(), mouth_uvs.end());
  for (Quad& quad : atlas.mouth) {
    for (int& v : quad) v += offset;
  }
  return atlas;
}

}  // namespace likeness
