#include "likeness/capture/contact_sheet.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/capture/inspect.h"
#include "likeness/geometry/ray_scene.h"
#include "likeness/image/draw.h"
#include "likeness/image/resize.h"

namespace likeness {
namespace {

constexpr Colour kGround = {22, 24, 28};
constexpr Colour kCell = {36, 39, 45};
constexpr Colour kInk = {228, 231, 236};
constexpr Colour kFaintInk = {140, 147, 158};
constexpr Colour kHeldOutInk = {255, 181, 71};
constexpr Colour kWire = {92, 225, 230};

constexpr int kMargin = 24;
constexpr int kGap = 8;
constexpr int kTitleHeight = 60;
constexpr int kColumnHeadHeight = 40;
constexpr int kRowHeadWidth = 128;

struct Cell {
  ImageU8 picture;  // empty when there is none
  std::string note;
};

Cell DrawCell(const Capture& capture, const FrameId& frame, const TrackedFrame& tracked, const Camera& camera,
              const ContactSheetOptions& options) {
  if (!capture.HasCameraImage(frame, camera)) return {{}, "no image"};
  try {
    const ImageU8 image = capture.ReadCameraImage(frame, camera);
    Cell cell = {FitInto(image, options.thumbnail, options.thumbnail), ""};
    if (options.mesh) {
      DrawWireframe(&cell.picture, camera.Resized(cell.picture.width(), cell.picture.height()), tracked,
                    capture.topology());
    }
    return cell;
  } catch (const Error& error) {
    LogWarning("{}", error.what());
    return {{}, "unreadable"};
  }
}

void DrawCentredWords(ImageU8* sheet, int x, int y, int width, const std::string& words, Colour colour, int scale) {
  const std::string shown = ShortenWords(words, width, scale);
  DrawWords(sheet, x + (width - WordsWidth(shown, scale)) / 2, y, shown, colour, scale);
}

}  // namespace

void ContactSheetOptions::Check() const {
  if (cameras < 1 || cameras > 100) throw Error("a contact sheet shows 1 ... 100 cameras, not {}", cameras);
  if (frames < 1 || frames > 100) throw Error("a contact sheet shows 1 ... 100 frames, not {}", frames);
  if (thumbnail < 64 || thumbnail > 1024) throw Error("thumbnails have 64 ... 1024 pixels, not {}", thumbnail);
}

std::vector<size_t> EvenlySpread(size_t size, size_t count) {
  std::vector<size_t> chosen;
  for (size_t i = 0; i < std::min(size, count); ++i) {
    chosen.push_back(size <= count ? i : count == 1 ? 0 : (i * (size - 1) + (count - 1) / 2) / (count - 1));
  }
  return chosen;
}

void DrawWireframe(ImageU8* picture, const Camera& camera, const TrackedFrame& tracked, const MeshTopology& topology) {
  // Rays end a little before the vertex, so that its own triangles do not hide it.
  constexpr float kBeforeVertexMm = 2;
  RayScene scene;
  scene.Add(tracked.vertices_in_head, topology.triangles, /*one_sided=*/true);
  scene.Build();
  const Eigen::Vector3d centre_in_head = tracked.world_from_head.Inverse() * camera.CentreInWorld();
  std::vector<Eigen::Vector2d> pixels(tracked.vertices_in_head.rows());
  std::vector<bool> seen(pixels.size());
  for (size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d point = tracked.vertices_in_head.row(static_cast<Eigen::Index>(i)).transpose().cast<double>();
    const Eigen::Vector3d in_world = tracked.world_from_head * point;
    if ((camera.cam_from_world * in_world).z() < 1) continue;
    pixels[i] = camera.Project(in_world);
    Ray ray;
    ray.origin = centre_in_head.cast<float>();
    ray.direction = (point - centre_in_head).normalized().cast<float>();
    ray.t_max = static_cast<float>((point - centre_in_head).norm()) - kBeforeVertexMm;
    seen[i] = !scene.Occluded(ray);
  }
  std::set<std::pair<int, int>> edges;
  for (const Eigen::Vector3i& t : topology.triangles) {
    if (!seen[t[0]] || !seen[t[1]] || !seen[t[2]]) continue;
    const Eigen::Vector2d a = pixels[t[1]] - pixels[t[0]], b = pixels[t[2]] - pixels[t[0]];
    if (a.x() * b.y() - a.y() * b.x() >= 0) continue;  // clockwise on the screen: seen from behind
    for (int k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  }
  std::vector<double> lengths;
  for (const auto& [a, b] : edges) lengths.push_back((pixels[a] - pixels[b]).norm());
  if (lengths.empty()) return;
  std::nth_element(lengths.begin(), lengths.begin() + lengths.size() / 2, lengths.end());
  const auto opacity = static_cast<float>(std::clamp(lengths[lengths.size() / 2] / 20, 0.1, 0.7));
  for (const auto& [a, b] : edges) {
    DrawLine(picture, {static_cast<float>(pixels[a].x()), static_cast<float>(pixels[a].y())},
             {static_cast<float>(pixels[b].x()), static_cast<float>(pixels[b].y())}, kWire, 0.8f, opacity);
  }
}

ImageU8 DrawContactSheet(const Capture& capture, const ContactSheetOptions& options) {
  options.Check();
  std::vector<const Camera*> cameras;
  for (const size_t i : EvenlySpread(capture.cameras().size(), options.cameras))
    cameras.push_back(&capture.cameras()[i]);
  std::vector<FrameId> frames;
  for (const size_t i : EvenlySpread(capture.frames().size(), options.frames)) frames.push_back(capture.frames()[i]);

  std::vector<Cell> cells(cameras.size() * frames.size());
  ParallelFor(static_cast<int64_t>(frames.size()), [&](int64_t f) {
    const TrackedFrame tracked = capture.ReadTracked(frames[f]);
    for (size_t c = 0; c < cameras.size(); ++c) {
      cells[c * frames.size() + f] = DrawCell(capture, frames[f], tracked, *cameras[c], options);
    }
  });

  int cell_width = 64, cell_height = 64;
  for (const Cell& cell : cells) {
    cell_width = std::max(cell_width, cell.picture.width());
    cell_height = std::max(cell_height, cell.picture.height());
  }
  const int columns = static_cast<int>(frames.size()), rows = static_cast<int>(cameras.size());
  const int left = kMargin + kRowHeadWidth, top = kMargin + kTitleHeight + kColumnHeadHeight;
  ImageU8 sheet(std::max(left + columns * (cell_width + kGap) + kMargin, 480),
                top + rows * (cell_height + kGap) + kMargin, 3);
  FillRectangle(&sheet, 0, 0, sheet.width(), sheet.height(), kGround);

  const int words_width = sheet.width() - 2 * kMargin;
  const std::string name = std::filesystem::absolute(capture.root()).lexically_normal().filename().string();
  DrawWords(&sheet, kMargin, kMargin, ShortenWords(name.empty() ? "capture" : name, words_width, 3), kInk, 3);
  const std::string counts = fmt::format("{} of {} cameras x {} of {} frames    {} vertices, {} triangles", rows,
                                         capture.cameras().size(), columns, capture.frames().size(),
                                         capture.topology().vertex_count, capture.topology().triangles.size());
  DrawWords(&sheet, kMargin, kMargin + 32, ShortenWords(counts, words_width), kFaintInk);
  if (!capture.split().held_out_cameras.empty() || !capture.split().held_out_segments.empty()) {
    DrawWords(&sheet, kMargin, kMargin + 44, "held out from training", kHeldOutInk);
  }

  for (int f = 0; f < columns; ++f) {
    const bool held_out = capture.split().IsHeldOutSegment(frames[f].segment);
    const int x = left + f * (cell_width + kGap);
    DrawCentredWords(&sheet, x, top - 30, cell_width, frames[f].segment, held_out ? kHeldOutInk : kInk, 1);
    DrawCentredWords(&sheet, x, top - 16, cell_width, frames[f].frame, kFaintInk, 1);
  }
  for (int c = 0; c < rows; ++c) {
    const int y = top + c * (cell_height + kGap), middle = y + cell_height / 2;
    const bool held_out = capture.split().IsHeldOutCamera(cameras[c]->name);
    DrawWords(&sheet, kMargin, middle - 14, ShortenWords(cameras[c]->name, kRowHeadWidth - kGap, 2),
              held_out ? kHeldOutInk : kInk, 2);
    DrawWords(&sheet, kMargin, middle + 6, fmt::format("{} x {}", cameras[c]->width, cameras[c]->height), kFaintInk);
    for (int f = 0; f < columns; ++f) {
      const Cell& cell = cells[static_cast<size_t>(c) * columns + f];
      const int x = left + f * (cell_width + kGap);
      FillRectangle(&sheet, x, y, cell_width, cell_height, kCell);
      Blit(&sheet, cell.picture, x + (cell_width - cell.picture.width()) / 2,
           y + (cell_height - cell.picture.height()) / 2);
      DrawCentredWords(&sheet, x, middle - 4, cell_width, cell.note, kFaintInk, 1);
    }
  }
  return sheet;
}

}  // namespace likeness
