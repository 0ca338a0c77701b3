#include "likeness/train/render/shade.h"

#include <ATen/Parallel.h>
#include <torch/csrc/autograd/custom_function.h>

#include "likeness/base/error.h"
#include "likeness/train/render/interpolate.h"
#include "likeness/train/render/sample.h"
#include "likeness/train/render/shade_kernel.h"

namespace likeness {
namespace {

using torch::autograd::AutogradContext;
using torch::autograd::tensor_list;

// [N, 3, H, W] whose values lie as [N, H, W, 3].
torch::Tensor ChannelsLast(const torch::Tensor& tensor) { return tensor.contiguous(torch::MemoryFormat::ChannelsLast); }

// Contiguous, the texture and images with channels last.
struct Operands {
  torch::Tensor triangle, texture, vertices, uvs, triangles, triangle_uvs, projections;

  // Of image i.
  template <typename Real>
  ShadeOperands<Real> Image(int64_t i) const {
    ShadeOperands<Real> o;
    o.height = static_cast<int>(triangle.size(1));
    o.width = static_cast<int>(triangle.size(2));
    o.triangle = triangle.const_data_ptr<int32_t>() + i * o.height * o.width;
    o.projection = projections.const_data_ptr<double>() + i * 12;
    o.vertex_count = vertices.size(1);
    o.triangle_count = triangles.size(0);
    o.vertices = vertices.const_data_ptr<Real>() + i * o.vertex_count * 3;
    o.triangles = triangles.const_data_ptr<int64_t>();
    o.triangle_uvs = triangle_uvs.const_data_ptr<int64_t>();
    o.uvs = uvs.const_data_ptr<Real>();
    o.texture_height = static_cast<int>(texture.size(2));
    o.texture_width = static_cast<int>(texture.size(3));
    o.texture = texture.const_data_ptr<Real>() + i * o.texture_height * o.texture_width * 3;
    return o;
  }
};

template <typename Real>
void Forward(const Operands& operands, const torch::Tensor& image) {
  const int64_t values = image.numel() / image.size(0);
  Real* const out = image.mutable_data_ptr<Real>();
  at::parallel_for(0, image.size(0), 1, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) ShadeForward(operands.Image<Real>(i), out + i * values);
  });
}

// Gradients that are undefined are left out; duvs has one for each image.
template <typename Real>
void Backward(const Operands& operands, const torch::Tensor& dimage, const torch::Tensor& dtexture,
              const torch::Tensor& dvertices, const torch::Tensor& duvs) {
  const auto part = [](const torch::Tensor& tensor, int64_t i) -> Real* {
    if (!tensor.defined()) return nullptr;
    return tensor.mutable_data_ptr<Real>() + i * (tensor.numel() / tensor.size(0));
  };
  const Real* const in = dimage.const_data_ptr<Real>();
  at::parallel_for(0, dimage.size(0), 1, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      ShadeBackward(operands.Image<Real>(i), in + i * (dimage.numel() / dimage.size(0)), part(dtexture, i),
                    part(dvertices, i), part(duvs, i));
    }
  });
}

class Shade : public torch::autograd::Function<Shade> {
 public:
  static torch::Tensor forward(AutogradContext* context, const torch::Tensor& texture, const torch::Tensor& vertices,
                               const torch::Tensor& uvs, const torch::Tensor& triangle, const torch::Tensor& triangles,
                               const torch::Tensor& triangle_uvs, const torch::Tensor& projections) {
    const Operands o = {triangle.contiguous(),  ChannelsLast(texture),     vertices.contiguous(),   uvs.contiguous(),
                        triangles.contiguous(), triangle_uvs.contiguous(), projections.contiguous()};
    context->save_for_backward({o.triangle, o.texture, o.vertices, o.uvs, o.triangles, o.triangle_uvs, o.projections});
    const torch::Tensor image = torch::empty({triangle.size(0), 3, triangle.size(1), triangle.size(2)},
                                             texture.options().memory_format(torch::MemoryFormat::ChannelsLast));
    texture.scalar_type() == torch::kFloat64 ? Forward<double>(o, image) : Forward<float>(o, image);
    return image;
  }

  static tensor_list backward(AutogradContext* context, tensor_list gradients) {
    const tensor_list s = context->get_saved_variables();
    const Operands o = {s[0], s[1], s[2], s[3], s[4], s[5], s[6]};
    const torch::NoGradGuard no_grad;
    const torch::Tensor dimage = ChannelsLast(gradients[0]);
    torch::Tensor dtexture, dvertices, duvs;
    if (context->needs_input_grad(0)) dtexture = torch::zeros_like(o.texture);
    if (context->needs_input_grad(1)) dvertices = torch::zeros_like(o.vertices);
    if (context->needs_input_grad(2)) duvs = torch::zeros({dimage.size(0), o.uvs.size(0), 2}, o.uvs.options());
    dimage.scalar_type() == torch::kFloat64 ? Backward<double>(o, dimage, dtexture, dvertices, duvs)
                                            : Backward<float>(o, dimage, dtexture, dvertices, duvs);
    if (duvs.defined()) duvs = duvs.sum(0);
    const torch::Tensor none;
    return {dtexture, dvertices, duvs, none, none, none, none};
  }
};

}  // namespace

torch::Tensor ShadePlain(const torch::Tensor& triangle, const torch::Tensor& texture, const torch::Tensor& vertices,
                         const RenderTopology& topology, const torch::Tensor& projections, bool mip_maps) {
  const torch::Tensor uv = TextureCoordinates(triangle, vertices, topology, projections);
  torch::Tensor colour;
  if (mip_maps) {
    const torch::NoGradGuard no_grad;
    colour = MipLevel(texture, uv, TextureCoordinates(triangle, vertices, topology, projections, {1, 0}),
                      TextureCoordinates(triangle, vertices, topology, projections, {0, 1}));
  }
  colour = mip_maps ? SampleMipMaps(texture, uv, colour) : SampleTextures(texture, uv);
  return colour * (triangle >= 0).unsqueeze(1).to(colour.scalar_type());
}

torch::Tensor ShadeFused(const torch::Tensor& triangle, const torch::Tensor& texture, const torch::Tensor& vertices,
                         const RenderTopology& topology, const torch::Tensor& projections) {
  const int64_t n = triangle.size(0);
  LIKENESS_CHECK(texture.is_cpu() && texture.dim() == 4 && texture.size(0) == n && texture.size(1) == 3);
  LIKENESS_CHECK(vertices.scalar_type() == texture.scalar_type() && vertices.size(0) == n && vertices.size(2) == 3);
  LIKENESS_CHECK(topology.uvs.scalar_type() == texture.scalar_type() && triangle.scalar_type() == torch::kInt32);
  LIKENESS_CHECK(projections.sizes() == torch::IntArrayRef({n, 3, 4}) && projections.scalar_type() == torch::kFloat64);
  return Shade::apply(texture, vertices, topology.uvs, triangle, topology.triangles, topology.triangle_uvs,
                      projections);
}

}  // namespace likeness
