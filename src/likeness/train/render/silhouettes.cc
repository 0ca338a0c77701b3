#include "likeness/train/render/silhouettes.h"

#include <limits>

namespace likeness {
namespace {

constexpr double kNear = 1e-3;  // mm; an edge that reaches behind this depth is left out

// Homogeneous pixel coordinates (x z, y z, z): [N, V, 3].
torch::Tensor Projected(const torch::Tensor& vertices, const torch::Tensor& projections) {
  const torch::Tensor matrix = projections.to(vertices.options().requires_grad(false));
  return vertices.matmul(matrix.narrow(2, 0, 3).transpose(1, 2)) + matrix.select(2, 3).unsqueeze(1);
}

// [N, T]: which triangles are seen counter-clockwise. With y downwards this is a negative determinant.
torch::Tensor FaceTheCamera(const torch::Tensor& projected, const RenderTopology& topology) {
  const auto corner = [&](int64_t j) { return projected.index_select(1, topology.triangles.select(1, j)); };
  return (corner(0) * torch::linalg_cross(corner(1), corner(2))).sum(2) < 0;
}

// Edges of outlines. E edges; coordinates are pixels and have gradients.
struct Outline {
  torch::Tensor image;           // [E] which image
  torch::Tensor x0, y0, x1, y1;  // [E] counter-clockwise about their triangle
  torch::Tensor z0, z1;          // [E] depth, mm; without gradient
};

Outline FindOutline(const torch::Tensor& projected, const RenderTopology& topology) {
  torch::Tensor image, from, to;
  {
    const torch::NoGradGuard no_grad;
    const torch::Tensor facing = FaceTheCamera(projected, topology);
    const torch::Tensor across = topology.neighbours.flatten().clamp_min(0);
    const torch::Tensor beyond = facing.index_select(1, across).view({facing.size(0), -1, 3});
    const torch::Tensor open = (topology.neighbours < 0).unsqueeze(0).logical_or(beyond.logical_not());
    const torch::Tensor where = facing.unsqueeze(2).logical_and(open).nonzero();
    image = where.select(1, 0);
    const torch::Tensor corner = 3 * where.select(1, 1), j = where.select(1, 2), next = (j + 1).remainder(3);
    const torch::Tensor vertices = topology.triangles.flatten();
    from = image * projected.size(1) + vertices.index_select(0, corner + j);
    to = image * projected.size(1) + vertices.index_select(0, corner + next);
    const torch::Tensor z = projected.select(2, 2).flatten();
    const torch::Tensor in_front =
        (z.index_select(0, from) > kNear).logical_and(z.index_select(0, to) > kNear).nonzero().squeeze(1);
    image = image.index_select(0, in_front);
    from = from.index_select(0, in_front);
    to = to.index_select(0, in_front);
  }
  const torch::Tensor flat = projected.flatten(0, 1);
  const torch::Tensor a = flat.index_select(0, from), b = flat.index_select(0, to);
  const torch::Tensor za = a.select(1, 2), zb = b.select(1, 2);
  return {image,       a.select(1, 0) / za, a.select(1, 1) / za, b.select(1, 0) / zb, b.select(1, 1) / zb,
          za.detach(), zb.detach()};
}

// Where outlines pass between the centres of two pixels of a line. K crossings.
struct Crossings {
  torch::Tensor surface, beyond;  // [K] pixels of [N H W]: on the triangle's side, on the other
  torch::Tensor share;            // [K] s, with gradient
  torch::Tensor depth;            // [K] mm
};

// Lines are rows, or columns when `down`.
Crossings FindCrossings(const Outline& outline, int64_t height, int64_t width, bool down) {
  const torch::Tensor& along0 = down ? outline.y0 : outline.x0;
  const torch::Tensor& along1 = down ? outline.y1 : outline.x1;
  const torch::Tensor& across0 = down ? outline.x0 : outline.y0;
  const torch::Tensor& across1 = down ? outline.x1 : outline.y1;
  const int64_t lines = down ? width : height, length = down ? height : width;

  // Each edge, as often as there are lines whose centre it passes.
  torch::Tensor edge, line;
  {
    const torch::NoGradGuard no_grad;
    const auto first_line = [&](const torch::Tensor& at) {
      return (at - 0.5).ceil().clamp(0, lines).to(torch::kInt64);
    };
    const torch::Tensor begin = first_line(torch::minimum(across0, across1));
    const torch::Tensor count = first_line(torch::maximum(across0, across1)) - begin;
    edge = torch::arange(count.size(0), count.options()).repeat_interleave(count);
    const torch::Tensor before = count.cumsum(0) - count;
    line = begin.index_select(0, edge) + torch::arange(edge.size(0), edge.options()) - before.index_select(0, edge);
  }
  const torch::Tensor start = across0.index_select(0, edge), run = across1.index_select(0, edge) - start;
  const torch::Tensor way = (line + 0.5 - start) / run;
  const torch::Tensor from = along0.index_select(0, edge);
  const torch::Tensor at = from + way * (along1.index_select(0, edge) - from);

  const torch::Tensor pixel = (at.detach() - 0.5).floor();
  const torch::Tensor kept = (pixel >= 0).logical_and(pixel < length - 1).nonzero().squeeze(1);
  const torch::Tensor first = pixel.index_select(0, kept);
  const torch::Tensor position = at.index_select(0, kept) - (first + 0.5);
  const torch::Tensor whole = first.to(torch::kInt64), line_kept = line.index_select(0, kept);
  const torch::Tensor edge_kept = edge.index_select(0, kept), image = outline.image.index_select(0, edge_kept);
  const torch::Tensor place =
      down ? (image * height + whole) * width + line_kept : (image * height + line_kept) * width + whole;
  const torch::Tensor next = place + (down ? width : 1);
  // The triangle lies at the left of its edges, counter-clockwise with y upwards.
  const torch::Tensor rises = run.detach().index_select(0, kept) > 0;
  const torch::Tensor surface_is_next = down ? rises.logical_not() : rises;

  Crossings crossings;
  crossings.surface = torch::where(surface_is_next, next, place);
  crossings.beyond = torch::where(surface_is_next, place, next);
  crossings.share = torch::where(surface_is_next, 1 - position, position);
  const torch::Tensor t = way.detach().index_select(0, kept);
  const torch::Tensor near0 = 1 / outline.z0.index_select(0, edge_kept),
                      near1 = 1 / outline.z1.index_select(0, edge_kept);
  crossings.depth = 1 / (near0 + t * (near1 - near0));
  return crossings;
}

// Depth of what pixels show at their centres, [K] of pixels of [N H W]; infinite where they show nothing.
torch::Tensor DepthAt(const torch::Tensor& pixel, const torch::Tensor& triangle, const torch::Tensor& projected,
                      const RenderTopology& topology) {
  const int64_t height = triangle.size(1), width = triangle.size(2);
  const torch::Tensor shown = triangle.flatten().index_select(0, pixel).to(torch::kInt64);
  const torch::Tensor image = pixel.div(height * width, "floor");
  const torch::Tensor vertex =
      topology.triangles.index_select(0, shown.clamp_min(0)) + (image * projected.size(1)).unsqueeze(1);
  const torch::Tensor at = projected.flatten(0, 1).index_select(0, vertex.flatten()).view({-1, 3, 3});
  const torch::Tensor z = at.select(2, 2);
  const torch::Tensor px = at.select(2, 0) - (pixel.remainder(width) + 0.5).unsqueeze(1) * z;
  const torch::Tensor py = at.select(2, 1) - (pixel.div(width, "floor").remainder(height) + 0.5).unsqueeze(1) * z;
  const torch::Tensor areas = px.roll(-1, 1) * py.roll(1, 1) - px.roll(1, 1) * py.roll(-1, 1);
  const torch::Tensor depth = (areas * z).sum(1) / areas.sum(1);
  return depth.masked_fill(shown < 0, std::numeric_limits<double>::infinity());
}

// The crossings that are seen: what is beyond is deeper, and no other one is nearer between the same two pixels.
// Something that hides an outline from one of them alone has an outline of its own between them.
torch::Tensor Visible(const Crossings& crossings, const torch::Tensor& triangle, const torch::Tensor& projected,
                      const RenderTopology& topology) {
  const torch::NoGradGuard no_grad;
  const torch::Tensor inside = DepthAt(crossings.surface, triangle, projected, topology);
  const torch::Tensor outside = DepthAt(crossings.beyond, triangle, projected, topology);
  const torch::Tensor seen = (outside > crossings.depth).logical_and(inside < outside);
  constexpr double kNothing = std::numeric_limits<double>::infinity();
  const torch::Tensor depth = crossings.depth.masked_fill(seen.logical_not(), kNothing);
  const torch::Tensor pair = torch::minimum(crossings.surface, crossings.beyond);
  const torch::Tensor nearest = torch::full({triangle.numel()}, kNothing, depth.options())
                                    .scatter_reduce(0, pair, depth, "amin", /*include_self=*/true);
  return seen.logical_and(depth == nearest.index_select(0, pair)).nonzero().squeeze(1);
}

}  // namespace

torch::Tensor BlendSilhouettes(const torch::Tensor& colour, const torch::Tensor& triangle,
                               const torch::Tensor& vertices, const RenderTopology& topology,
                               const torch::Tensor& projections) {
  const int64_t count = colour.size(0), channels = colour.size(1), height = colour.size(2), width = colour.size(3);
  const torch::Tensor projected = Projected(vertices, projections);
  const Outline outline = FindOutline(projected, topology);
  const torch::Tensor colours = colour.permute({0, 2, 3, 1}).reshape({-1, channels});
  torch::Tensor sum = colours;
  for (const bool down : {false, true}) {
    const Crossings all = FindCrossings(outline, height, width, down);
    const torch::Tensor seen = Visible(all, triangle, projected.detach(), topology);
    const torch::Tensor surface = all.surface.index_select(0, seen), beyond = all.beyond.index_select(0, seen);
    const torch::Tensor share = all.share.index_select(0, seen).unsqueeze(1);
    const torch::Tensor difference = colours.index_select(0, surface) - colours.index_select(0, beyond);
    sum = sum.index_add(0, beyond, torch::relu(share - 0.5) * difference)
              .index_add(0, surface, -torch::relu(0.5 - share) * difference);
  }
  return sum.view({count, height, width, channels}).permute({0, 3, 1, 2});
}

}  // namespace likeness
