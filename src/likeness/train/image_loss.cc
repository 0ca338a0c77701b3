#include "likeness/train/image_loss.h"

#include "likeness/base/error.h"
#include "likeness/train/ops/masked_loss.h"

namespace likeness {

ImageLoss::ImageLoss(const MeshTopology& topology, const std::vector<Statistics>& people, torch::TensorOptions options,
                     bool silhouettes)
    : topology_(topology, options), vertex_deviation_(people.front().vertex_deviation) {
  render_.silhouettes = silhouettes;
  std::vector<torch::Tensor> textures, vertices;
  for (const Statistics& person : people) {
    const ImageF& mean = person.texture_mean;
    textures.push_back(
        torch::from_blob(const_cast<float*>(mean.values().data()), {mean.height(), mean.width(), 3}, torch::kFloat32) /
        person.texture_deviation);
    vertices.push_back(torch::from_blob(const_cast<float*>(person.vertex_mean.data()), {person.vertex_mean.rows(), 3},
                                        torch::kFloat32));
  }
  texture_mean_ = torch::stack(textures).to(options).permute({0, 3, 1, 2});
  vertex_mean_ = torch::stack(vertices).to(options);
}

// Of one person the values are broadcast, not copied.
torch::Tensor ImageLoss::OfPeople(const torch::Tensor& values, const torch::Tensor& identity) const {
  return values.size(0) == 1 ? values : values.index_select(0, identity);
}

torch::Tensor ImageLoss::operator()(const Batch& batch, const Network::Decoding& decoding) const {
  const CropBatch& crops = batch.crops;
  LIKENESS_CHECK(crops.colour.defined());
  const int64_t count = crops.colour.size(0), height = crops.colour.size(2), width = crops.colour.size(3);
  const torch::Tensor identity =
      vertex_mean_.size(0) == 1 ? torch::Tensor() : batch.identity.repeat_interleave(count / batch.identity.size(0), 0);
  const torch::Tensor texture = decoding.texture + OfPeople(texture_mean_, identity);
  const torch::Tensor moved = decoding.vertices.repeat_interleave(count / decoding.vertices.size(0), 0);
  const torch::Tensor vertices = vertex_deviation_ * moved.view({count, -1, 3}) + OfPeople(vertex_mean_, identity);
  const RenderedImages drawn = RenderImages(texture, vertices, topology_, crops.projection, static_cast<int>(height),
                                            static_cast<int>(width), render_);
  const torch::Tensor covered = (drawn.triangle >= 0).unsqueeze(1).to(crops.head.scalar_type());
  const torch::Tensor counts = render_.silhouettes ? torch::maximum(crops.head, covered) : crops.head * covered;
  // A mean over all pixels, then over those that count.
  const torch::Tensor share = counts.mean().clamp_min(1 / static_cast<double>(counts.numel()));
  return MaskedSquaredError(drawn.colour, crops.colour, counts) / share;
}

}  // namespace likeness
