#include "likeness/render/frame_renderer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "likeness/base/error.h"
#include "likeness/image/srgb.h"
#include "likeness/render/raster_kernels.h"

namespace likeness {
namespace {

constexpr int kMostThreads = 64;
constexpr int kMostPixels = 16384;

uint32_t Rgba(uint32_t red, uint32_t green, uint32_t blue, uint32_t opacity) {
  const uint8_t bytes[4] = {static_cast<uint8_t>(red), static_cast<uint8_t>(green), static_cast<uint8_t>(blue),
                            static_cast<uint8_t>(opacity)};
  uint32_t packed = 0;
  std::memcpy(&packed, bytes, sizeof(packed));
  return packed;
}

std::array<uint8_t, 4> Channels(uint32_t packed) {
  std::array<uint8_t, 4> channels;
  std::memcpy(channels.data(), &packed, sizeof(packed));
  return channels;
}

// Values at the three corners, divided by depth, as a function of the pixel; (x, y) is the plane's origin.
Plane PlaneOf(const Eigen::Matrix3d& weights, const Eigen::Vector3d& corners, int x, int y) {
  const Eigen::Vector3d function = weights.transpose() * corners;
  return {static_cast<float>(function.dot(Eigen::Vector3d(x + 0.5, y + 0.5, 1))), static_cast<float>(function.x()),
          static_cast<float>(function.y())};
}

// The part of `count` things that falls to one of several threads.
std::pair<int, int> ShareOf(int count, int thread, int threads) {
  return {static_cast<int>(int64_t{count} * thread / threads),
          static_cast<int>(int64_t{count} * (thread + 1) / threads)};
}

}  // namespace

struct FrameRenderer::Eye {
  explicit Eye(int texture_size, int vertex_count) : mips(texture_size), points(vertex_count) {}

  View view;
  MipChain mips;
  std::vector<ProjectedPoint> points;
  int columns = 0, tiles = 0;  // of the picture
  int first_tile = 0;          // in a thread's list for both eyes
};

// What one thread has set up, and the tile that it draws.
struct FrameRenderer::Share {
  // Triangles of a tile in their order: a chain through `links`.
  struct Chain {
    int first = -1, last = -1;
  };
  struct Link {
    int triangle = 0, next = -1;
  };
  std::vector<RasterTriangle> triangles;
  std::vector<Chain> chains;  // one a tile
  std::vector<Link> links;
  std::vector<float> over_depth;
  std::vector<uint32_t> colours;
};

void FrameRendererOptions::Check() const {
  FindRasterKernel(kernel);
  if (!(near_mm > 0 && std::isfinite(near_mm)))
    throw Error("the near plane must lie at more than 0 mm, not {}", near_mm);
  if (threads < 1 || threads > kMostThreads) throw Error("threads is {}; expected 1 to {}", threads, kMostThreads);
}

FrameRenderer::FrameRenderer(const MeshTopology& topology, int texture_size, const FrameRendererOptions& options)
    : options_(options),
      kernel_((options.Check(), FindRasterKernel(options.kernel))),
      topology_(topology),
      texture_size_(texture_size),
      background_(options.transparent ? 0
                                      : Rgba(options.background[0], options.background[1], options.background[2], 255)),
      team_(options.team) {
  topology.Check("the mesh to draw");
  if (team_ == nullptr) {
    Team::Options team;
    team.threads = options.threads;
    team_ = std::make_shared<Team>(team);
  }
  shares_.resize(team_->threads());
  const size_t samples = options.anti_alias ? kMostSamples : 1;
  for (Share& share : shares_) {
    const size_t triangles = kMostViews * topology.triangles.size() / shares_.size() + 1;
    share.triangles.reserve(triangles);
    share.links.reserve(4 * triangles);
    share.over_depth.resize(samples * kTileTexels);
    share.colours.resize(samples * kTileTexels);
  }
  for (int i = 0; i < kMostViews; ++i) eyes_.emplace_back(texture_size, topology.vertex_count);
}

FrameRenderer::~FrameRenderer() = default;

void FrameRenderer::Draw(std::span<const float> vertices, std::span<const View> views) {
  LIKENESS_CHECK(vertices.size() == static_cast<size_t>(topology_.vertex_count) * 3);
  LIKENESS_CHECK(!views.empty() && views.size() <= kMostViews);
  eye_count_ = static_cast<int>(views.size());
  vertices_ = vertices;
  int tiles = 0;
  for (int e = 0; e < eye_count_; ++e) {
    const View& view = views[e];
    LIKENESS_CHECK(view.width > 0 && view.height > 0 && view.width <= kMostPixels && view.height <= kMostPixels);
    LIKENESS_CHECK(view.texture != nullptr && view.pixels != nullptr && view.row_bytes >= int64_t{4} * view.width);
    Eye& eye = eyes_[e];
    eye.view = view;
    eye.mips.SetTexture(view.texture);
    eye.columns = (view.width + kTileWidth - 1) / kTileWidth;
    eye.tiles = eye.columns * ((view.height + kTileHeight - 1) / kTileHeight);
    eye.first_tile = tiles;
    tiles += eye.tiles;
  }
  for (Share& share : shares_) share.chains.assign(tiles, {});
  next_part_ = next_tile_ = 0;
  team_->Run(*this, kPhases);
  began_[kPhases] = std::chrono::steady_clock::now();
  const auto between = [&](int from, int to) {
    return std::chrono::duration<double, std::milli>(began_[to] - began_[from]).count();
  };
  times_ = {between(kMipMaps, kVertices), between(kVertices, kTiles), between(kTiles, kPhases)};
}

void FrameRenderer::Run(int phase, int thread) {
  if (thread == 0) began_[phase] = std::chrono::steady_clock::now();
  switch (phase) {
    case kMipMaps:
      return MakeMipMaps();
    case kVertices:
      return Project(thread);
    case kTriangles:
      return SetUpTriangles(thread);
    default:
      return DrawTiles(thread);
  }
}

void FrameRenderer::MakeMipMaps() {
  for (int i; (i = next_part_.fetch_add(1)) < eye_count_ * MipChain::kParts;) {
    eyes_[i / MipChain::kParts].mips.MakePart(kernel_, i % MipChain::kParts);
  }
}

void FrameRenderer::Project(int thread) {
  if (thread == 0) {
    for (int e = 0; e < eye_count_; ++e) eyes_[e].mips.MakeRest(kernel_);
  }
  const auto [begin, end] = ShareOf(topology_.vertex_count, thread, team_->threads());
  for (int i = begin; i < end; ++i) {
    const Eigen::Vector3f point(vertices_[3 * i], vertices_[3 * i + 1], vertices_[3 * i + 2]);
    for (int e = 0; e < eye_count_; ++e) {
      eyes_[e].points[i] = ProjectPoint(eyes_[e].view.pixel_from_mesh, point, options_.near_mm);
    }
  }
}

void FrameRenderer::SetUpTriangles(int thread) {
  Share& share = shares_[thread];
  share.triangles.clear();
  share.links.clear();
  const auto [begin, end] = ShareOf(static_cast<int>(topology_.triangles.size()), thread, team_->threads());
  ScreenTriangle seen;
  for (int e = 0; e < eye_count_; ++e) {
    const Eye& eye = eyes_[e];
    const Screen screen = {eye.view.width, eye.view.height, options_.anti_alias ? kSampleReach * kSubpixels / 16 : 0,
                           options_.cull_back_faces, options_.near_mm};
    for (int t = begin; t < end; ++t) {
      const Eigen::Vector3i& corners = topology_.triangles[t];
      const auto& points = eye.points;
      if (!SetUpTriangle(points[corners[0]], points[corners[1]], points[corners[2]], screen, &seen)) continue;
      AddTriangle(share, eye, t, seen);
    }
  }
}

void FrameRenderer::AddTriangle(Share& share, const Eye& eye, int triangle, const ScreenTriangle& seen) const {
  Eigen::Matrix<double, 3, 2> texels;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2f& uv = topology_.uvs[topology_.triangle_uvs[triangle][k]];
    texels.row(k) << uv.x() * static_cast<double>(texture_size_), (1.0 - uv.y()) * texture_size_;
  }
  for (int i = 0; i < seen.count; ++i) {
    const ScreenPiece& piece = seen.pieces[i];
    RasterTriangle t;
    for (int e = 0; e < 3; ++e) {
      t.a[e] = static_cast<int32_t>(piece.edges[e].a);
      t.b[e] = static_cast<int32_t>(piece.edges[e].b);
      t.c[e] = piece.edges[e].At(kSubpixels / 2, kSubpixels / 2);
    }
    t.x_begin = piece.x_begin, t.x_end = piece.x_end;
    t.y_begin = piece.y_begin, t.y_end = piece.y_end;
    t.over_depth = PlaneOf(seen.weights, Eigen::Vector3d::Ones(), t.x_begin, t.y_begin);
    t.u = PlaneOf(seen.weights, texels.col(0), t.x_begin, t.y_begin);
    t.v = PlaneOf(seen.weights, texels.col(1), t.x_begin, t.y_begin);
    t.least_over_depth = static_cast<float>(seen.least_over_depth);
    t.most_over_depth = static_cast<float>(seen.most_over_depth);
    t.least_u = static_cast<float>(texels.col(0).minCoeff()), t.most_u = static_cast<float>(texels.col(0).maxCoeff());
    t.least_v = static_cast<float>(texels.col(1).minCoeff()), t.most_v = static_cast<float>(texels.col(1).maxCoeff());
    const int index = static_cast<int>(share.triangles.size());
    share.triangles.push_back(t);
    for (int y = t.y_begin / kTileHeight; y <= (t.y_end - 1) / kTileHeight; ++y) {
      for (int x = t.x_begin / kTileWidth; x <= (t.x_end - 1) / kTileWidth; ++x) {
        Share::Chain& chain = share.chains[eye.first_tile + y * eye.columns + x];
        const int link = static_cast<int>(share.links.size());
        share.links.push_back({index, -1});
        (chain.first < 0 ? chain.first : share.links[chain.last].next) = link;
        chain.last = link;
      }
    }
  }
}

void FrameRenderer::DrawTiles(int thread) {
  const Eye& last = eyes_[eye_count_ - 1];
  for (int i; (i = next_tile_.fetch_add(1)) < last.first_tile + last.tiles;) {
    const Eye& eye = i < last.first_tile ? eyes_[0] : last;
    DrawTile(shares_[thread], eye, i - eye.first_tile);
  }
}

void FrameRenderer::DrawTile(Share& own, const Eye& eye, int index) const {
  RasterTile tile;
  tile.x = index % eye.columns * kTileWidth;
  tile.y = index / eye.columns * kTileHeight;
  tile.width = std::min(kTileWidth, eye.view.width - tile.x);
  tile.height = std::min(kTileHeight, eye.view.height - tile.y);
  tile.over_depth = own.over_depth.data();
  tile.colours = own.colours.data();
  const auto chain = [&](const Share& share) { return share.chains[eye.first_tile + index].first; };
  if (std::all_of(shares_.begin(), shares_.end(), [&](const Share& share) { return chain(share) < 0; })) {
    return FillTile(eye.view, tile);
  }
  std::fill(own.over_depth.begin(), own.over_depth.end(), 0.0f);
  std::fill(own.colours.begin(), own.colours.end(), options_.anti_alias ? 0 : background_);
  const auto draw = options_.anti_alias ? kernel_.draw_samples : kernel_.draw;
  for (const Share& share : shares_) {
    for (int link = chain(share); link >= 0; link = share.links[link].next) {
      draw(share.triangles[share.links[link].triangle], eye.mips.maps(), tile);
    }
  }
  WriteTile(eye.view, tile);
}

void FrameRenderer::FillTile(const View& view, const RasterTile& tile) const {
  std::array<uint32_t, kTileWidth> row;
  row.fill(background_);
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    std::memcpy(view.pixels + y * view.row_bytes + int64_t{4} * tile.x, row.data(), size_t{4} * tile.width);
  }
}

void FrameRenderer::WriteTile(const View& view, const RasterTile& tile) const {
  uint32_t row[kTilePitch];
  for (int y = 0; y < tile.height; ++y) {
    const uint32_t* from = tile.colours + y * kTilePitch;
    if (options_.anti_alias) {
      WriteSampledRow(tile, y, row);
      from = row;
    }
    std::memcpy(view.pixels + (tile.y + y) * view.row_bytes + int64_t{4} * tile.x, from, size_t{4} * tile.width);
  }
}

void FrameRenderer::WriteSampledRow(const RasterTile& tile, int row, uint32_t* pixels) const {
  const uint32_t* const samples = tile.colours + row * kTilePitch;
  kernel_.average(samples, tile.width, pixels);
  for (int x = 0; x < tile.width; ++x) {
    const uint8_t opacity = Channels(pixels[x])[3];  // samples without a mesh have none
    if (opacity == 255) continue;
    pixels[x] = opacity == 0 ? background_ : MixedPixel(samples + x);
  }
}

uint32_t FrameRenderer::MixedPixel(const uint32_t* samples) const {
  int sum[3] = {}, covered = 0;
  for (int s = 0; s < kMostSamples; ++s) {
    const std::array<uint8_t, 4> sample = Channels(samples[static_cast<ptrdiff_t>(s) * kTileTexels]);
    for (int c = 0; c < 3; ++c) sum[c] += sample[c];
    covered += sample[3] != 0;
  }
  const float share = static_cast<float>(covered) / kMostSamples;
  uint32_t mixed[3];
  for (int c = 0; c < 3; ++c) {
    const float mesh = static_cast<float>(sum[c]) / static_cast<float>(covered);
    const float colour = options_.transparent ? mesh : MixSrgb(options_.background[c], mesh, share);
    mixed[c] = static_cast<uint32_t>(colour + 0.5f);
  }
  return Rgba(mixed[0], mixed[1], mixed[2], options_.transparent ? static_cast<uint32_t>(255 * share + 0.5f) : 255);
}

}  // namespace likeness
