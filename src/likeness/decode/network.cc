#include "likeness/decode/network.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/error.h"

namespace likeness {

namespace {

// Reads tensors; what it gives points into the file where that is possible.
class Reader {
 public:
  explicit Reader(DecoderNetwork& network) : network_(network) {}

  std::span<const float> Floats(const std::string& name, const std::vector<int64_t>& shape) {
    const SafetensorsFile& file = network_.file;
    const bool fits = file.Has(name) && file.DTypeOf(name) == DType::kF32 && file.ShapeOf(name) == shape;
    const std::span<const std::byte> bytes = fits ? file.Bytes(name) : std::span<const std::byte>();
    if (!fits || reinterpret_cast<uintptr_t>(bytes.data()) % alignof(float) != 0) {
      return network_.copies[name] = file.Floats(name, shape);  // or the error that says what does not fit
    }
    const std::span values(reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float));
    CheckFinite(name, values);
    return values;
  }

  // The layer `name`, with activation or without.
  DenseLayer Dense(const std::string& name, float slope) {
    const LayerInfo* info = Find(name);
    if (info == nullptr) return {};
    const std::span<const float> weight = Floats(name + ".weight", info->WeightShape());
    const std::span<const float> bias = Floats(name + ".bias", info->BiasShape());
    return {info->in, info->out, {weight.begin(), weight.end()}, {bias.begin(), bias.end()}, slope};
  }

  const LayerInfo* Find(const std::string& name) const {
    const auto found = std::find_if(infos_.begin(), infos_.end(), [&](const LayerInfo& l) { return l.name == name; });
    return found == infos_.end() ? nullptr : &*found;
  }

  double Number(const char* key) const {
    const std::string& text = network_.file.Metadata(key);
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(value > 0) || !std::isfinite(value)) {
      throw FileError(network_.file.path(), fmt::format("{} is '{}'; expected a positive number", key, text));
    }
    return value;
  }

 private:
  // A value that is not finite makes the sum of all v x 0 something other than 0; the sum can be vectorised.
  void CheckFinite(const std::string& name, std::span<const float> values) const {
    constexpr size_t kLanes = 16;
    float sums[kLanes] = {};
    size_t i = 0;
    for (; i + kLanes <= values.size(); i += kLanes) {
      for (size_t k = 0; k < kLanes; ++k) sums[k] += values[i + k] * 0.0f;
    }
    bool finite = std::all_of(sums, sums + kLanes, [](float s) { return s == 0; });
    for (; i < values.size(); ++i) finite = finite && std::isfinite(values[i]);
    if (!finite)
      throw FileError(network_.file.path(), fmt::format("tensor '{}' holds values that are not finite", name));
  }

  DecoderNetwork& network_;
  const std::vector<LayerInfo> infos_ = Layers(network_.architecture);
};

// [in, out, 4, 4], or [out, in, 3, 3] -> [ky, kx, in, out].
std::vector<float> TapsOf(const LayerInfo& info, std::span<const float> weight) {
  const bool transposed = info.kind == LayerKind::kTransposedConvolution;
  const int side = transposed ? kKernel : kSameKernel, area = side * side;
  std::vector<float> taps(weight.size());
  for (int i = 0; i < info.in; ++i) {
    for (int o = 0; o < info.out; ++o) {
      const size_t from =
          (transposed ? static_cast<size_t>(i) * info.out + o : static_cast<size_t>(o) * info.in + i) * area;
      for (int k = 0; k < area; ++k) taps[(static_cast<size_t>(k) * info.in + i) * info.out + o] = weight[from + k];
    }
  }
  return taps;
}

// Repeating every texel and convolving 3 x 3 is a transposed convolution 4 x 4: along one axis, an even output sees
// the texel before it with tap 0 and its own with 1 and 2; an odd one its own with 0 and 1 and the next with 2.
std::vector<float> UpsampledTaps(const std::vector<float>& taps, int values) {
  // By tap of the transposed convolution, those of the 3 x 3 one that it is the sum of.
  const std::array<std::vector<int>, kKernel> parts = {{{2}, {1, 2}, {0, 1}, {0}}};
  std::vector<float> up(static_cast<size_t>(kKernel * kKernel) * values, 0.0f);
  for (int y = 0; y < kKernel; ++y) {
    for (int x = 0; x < kKernel; ++x) {
      float* const to = up.data() + static_cast<size_t>(y * kKernel + x) * values;
      for (const int ky : parts[y]) {
        for (const int kx : parts[x]) {
          const float* const from = taps.data() + static_cast<size_t>(ky * kSameKernel + kx) * values;
          for (int v = 0; v < values; ++v) to[v] += from[v];
        }
      }
    }
  }
  return up;
}

void ScaleOutputs(std::vector<float>& taps, const std::array<float, 3>& gain) {
  for (size_t i = 0; i < taps.size(); ++i) taps[i] *= gain[i % 3];
}

void ReadConvolutions(Reader& reader, DecoderNetwork& network) {
  for (int i = 0, size = InnerSize(network.architecture); size < network.architecture.texture_size; ++i, size *= 2) {
    const std::string name = fmt::format("decoder.texture_conv.{}", i);
    const LayerInfo& info = *reader.Find(name);
    ConvolutionLayer layer{ConvolutionLayer::Kind::kUp, info.in, info.out, size, 2 * size, {}, {}, kLeakySlope, {}};
    layer.taps = TapsOf(info, reader.Floats(name + ".weight", info.WeightShape()));
    if (info.kind == LayerKind::kUpsampledConvolution) layer.taps = UpsampledTaps(layer.taps, info.in * info.out);
    layer.bias = reader.Floats(name + ".bias", info.BiasShape());
    layer.view_add = reader.Dense(fmt::format("decoder.view_add.{}", i), 1);
    const bool last = 2 * size == network.architecture.texture_size;
    if (last) layer.slope = 1;
    network.layers.push_back(std::move(layer));

    const std::string residual = fmt::format("decoder.texture_res.{}", i);
    if (const LayerInfo* same = reader.Find(residual); same != nullptr) {
      ConvolutionLayer next{
          ConvolutionLayer::Kind::kSame, same->in, same->out, 2 * size, 2 * size, {}, {}, kLeakySlope, {}};
      next.taps = TapsOf(*same, reader.Floats(residual + ".weight", same->WeightShape()));
      // act(h + conv(h)): the identity is the middle tap.
      constexpr int kMiddle = kSameKernel * kSameKernel / 2;
      for (int c = 0; c < same->in; ++c) next.taps[(static_cast<size_t>(kMiddle) * same->in + c) * same->out + c] += 1;
      next.bias = reader.Floats(residual + ".bias", same->BiasShape());
      if (last) next.slope = 1;
      network.layers.push_back(std::move(next));
    }
  }
  ScaleOutputs(network.layers.back().taps, network.gain);
}

// `decoder.texture_fc` takes the view's features and the code's, or the code's alone.
void SplitInner(Reader& reader, DecoderNetwork& network) {
  DenseLayer both = reader.Dense("decoder.texture_fc", kLeakySlope);
  const int view = ViewInAllLayers(network.architecture) ? 0 : ViewChannels(network.architecture);
  network.inner = {both.in - view, both.out, {}, std::move(both.bias), both.slope};
  if (view > 0) network.inner_view = {view, both.out, {}, {}, 1};
  for (int o = 0; o < both.out; ++o) {
    const auto row = both.weight.begin() + static_cast<ptrdiff_t>(o) * both.in;
    network.inner_view.weight.insert(network.inner_view.weight.end(), row, row + view);
    network.inner.weight.insert(network.inner.weight.end(), row + view, row + both.in);
  }
}

// The condition vector (avatar/conditions.h) of a person. Without values the named conditions are at their means, whose
// part of it is 0.
std::vector<float> ConditionOf(Reader& reader, const Architecture& a, int person, std::span<const float> values) {
  std::vector<float> condition(ConditionChannels(a), 0.0f);
  if (a.identity == IdentityConditioning::kOneHot) condition[person] = 1;
  if (a.identity == IdentityConditioning::kLearned) {
    const std::span<const float> vectors = reader.Floats(kIdentityVectors, {a.identities, a.identity_size});
    std::copy_n(vectors.begin() + static_cast<ptrdiff_t>(person) * a.identity_size, a.identity_size, condition.begin());
  }
  if (values.empty()) return condition;
  const int64_t named = NamedChannels(a);
  const std::span<const float> mean = reader.Floats("condition.mean", {named});
  const std::span<const float> deviation = reader.Floats("condition.deviation", {named});
  for (size_t i = 0; i < values.size(); ++i) {
    condition[IdentityChannels(a) + i] = (values[i] - mean[i]) / deviation[i];
  }
  return condition;
}

// Drops the last columns, which meet a constant: what they give goes into the bias. The last `named` are kept aside.
void FoldCondition(std::span<const float> condition, size_t named, DenseLayer* layer) {
  if (layer->empty() || condition.empty()) return;
  const size_t in = layer->in, kept = in - condition.size();
  std::vector<float> weight;
  for (int o = 0; o < layer->out; ++o) {
    const float* const row = layer->weight.data() + o * in;
    weight.insert(weight.end(), row, row + kept);
    layer->named.insert(layer->named.end(), row + in - named, row + in);
    for (size_t i = 0; i < condition.size(); ++i) layer->bias[o] += row[kept + i] * condition[i];
  }
  layer->weight = std::move(weight);
  layer->in = static_cast<int>(kept);
}

// The person's own row of a table that has one for each where there are several.
std::span<const float> OwnMean(Reader& reader, const Architecture& a, int person, const char* name,
                               std::vector<int64_t> shape) {
  const auto count = static_cast<size_t>(ElementCount(shape));
  if (a.identities == 1) return reader.Floats(name, shape);
  shape.insert(shape.begin(), a.identities);
  return reader.Floats(name, shape).subspan(person * count, count);
}

void ReadTexels(Reader& reader, DecoderNetwork& network) {
  network.texels = reader.Dense("decoder.texture_fc", 1);
  DenseLayer& texels = network.texels;
  for (int o = 0; o < texels.out; ++o) {
    const float gain = network.gain[o % 3];
    for (int i = 0; i < texels.in; ++i) texels.weight[static_cast<size_t>(o) * texels.in + i] *= gain;
    texels.bias[o] = texels.bias[o] * gain + network.texture_mean[o] * network.mean_gain[o % 3] + network.offset[o % 3];
  }
}

void ReadMesh(Reader& reader, DecoderNetwork& network, int person) {
  const float deviation = static_cast<float>(std::sqrt(reader.Number("vertex.variance")));
  network.mesh = reader.Dense("decoder.mesh_fc", 1);
  const std::span<const float> mean =
      OwnMean(reader, network.architecture, person, "vertex.mean", {network.architecture.vertex_count, 3});
  for (float& v : network.mesh.weight) v *= deviation;
  for (size_t i = 0; i < mean.size(); ++i) network.mesh.bias[i] = network.mesh.bias[i] * deviation + mean[i];
}

void ReadTopology(DecoderNetwork& network) {
  const SafetensorsFile& file = network.file;
  network.triangles = file.Integers("topology.triangles", {-1, 3});
  network.triangle_uvs =
      file.Integers("topology.triangle_uvs", {static_cast<int64_t>(network.triangles.size() / 3), 3});
  network.uvs = file.Floats("topology.uvs", {-1, 2});
  const auto check = [&](const std::vector<int32_t>& indices, int64_t count, const char* what) {
    for (const int32_t index : indices) {
      if (index < 0 || index >= count) {
        throw FileError(file.path(), fmt::format("{} has the index {}; there are {}", what, index, count));
      }
    }
  };
  check(network.triangles, network.architecture.vertex_count, "topology.triangles");
  check(network.triangle_uvs, static_cast<int64_t>(network.uvs.size() / 2), "topology.triangle_uvs");
}

void ReadCodes(Reader& reader, DecoderNetwork& network) {
  const int latent = network.architecture.latent;
  network.mean_code.assign(latent, 0.0f);
  if (!network.file.Has("codes.mu") || network.file.ShapeOf("codes.mu").size() != 2) {
    throw FileError(network.file.path(), "has no table 'codes.mu'");
  }
  const int64_t frames = network.file.ShapeOf("codes.mu")[0];
  const std::span<const float> codes = reader.Floats("codes.mu", {frames, latent});
  if (frames == 0) return;
  std::vector<double> sum(latent, 0.0);
  for (size_t i = 0; i < codes.size(); ++i) sum[i % latent] += codes[i];
  for (int i = 0; i < latent; ++i) network.mean_code[i] = static_cast<float>(sum[i] / static_cast<double>(frames));
  constexpr int64_t kSome = 3;
  for (int64_t k = 0; k < std::min(kSome, frames); ++k) {
    const auto at = codes.begin() + k * frames / std::min(kSome, frames) * latent;
    network.some_codes.emplace_back(at, at + latent);
  }
}

}  // namespace

void DecoderNetwork::BiasRow(const ConvolutionLayer& layer, int y, float* row) const {
  const int size = layer.out_size, channels = layer.out;
  const bool untied = layer.bias.size() != static_cast<size_t>(channels);
  for (int c = 0; c < channels; ++c) {
    const float* from = layer.bias.data() + (untied ? (static_cast<size_t>(c) * size + y) * size : c);
    for (int x = 0; x < size; ++x) row[x * channels + c] = untied ? from[x] : *from;
  }
  if (&layer != &layers.back()) return;
  const float* mean = texture_mean.data() + static_cast<size_t>(y) * size * 3;
  for (int i = 0; i < 3 * size; ++i) row[i] = row[i] * gain[i % 3] + mean[i] * mean_gain[i % 3] + offset[i % 3];
}

DecoderNetwork NetworkFrom(SafetensorsFile opened, const DisplayTransform& display, int person,
                           std::span<const float> conditions) {
  DecoderNetwork network(std::move(opened));
  const SafetensorsFile& file = network.file;
  const auto format = file.metadata().find("format");
  if (format == file.metadata().end() || format->second != "likeness-avatar") {
    throw FileError(file.path(), "is no avatar (its metadata lack format = likeness-avatar)");
  }
  if (const std::string& version = file.Metadata("version"); version != "1" && version != "2" && version != "3") {
    throw FileError(file.path(), fmt::format("is an avatar of version '{}'; this run time reads 1 to 3", version));
  }
  try {
    network.architecture = ArchitectureFromJson(file.Metadata("architecture"));
    network.architecture.Check();
  } catch (const Error& error) {
    throw FileError(file.path(), error.what());
  }
  const Architecture& a = network.architecture;
  // Nothing is computed from a shape before the file was found to hold as many bytes.
  for (const TensorInfo& info : NetworkTensors(a)) {
    if (!info.name.starts_with("decoder.")) continue;
    if (!file.Has(info.name) || file.DTypeOf(info.name) != DType::kF32 || file.ShapeOf(info.name) != info.shape) {
      throw FileError(file.path(), fmt::format("tensor '{}' is {}; expected F32 [{}]", info.name,
                                               file.Has(info.name) ? "of another type or shape" : "missing",
                                               fmt::join(info.shape, ", ")));
    }
  }
  for (const std::string& name : file.names()) {
    if (!name.starts_with("decoder.")) continue;
    const std::vector<TensorInfo> infos = NetworkTensors(a);
    if (std::none_of(infos.begin(), infos.end(), [&](const TensorInfo& info) { return info.name == name; })) {
      throw FileError(file.path(), fmt::format("has a tensor '{}', which this run time does not know", name));
    }
  }

  if (person < 0 || person >= a.identities) {
    throw FileError(file.path(), fmt::format("shows {} people; there is no person {}", a.identities, person));
  }
  if (!conditions.empty() && conditions.size() != static_cast<size_t>(NamedChannels(a))) {
    throw FileError(file.path(), fmt::format("has {} values of named conditions; there are {} given", NamedChannels(a),
                                             conditions.size()));
  }
  if (a.model == ModelKind::kBilinear && ConditionChannels(a) > 0) {
    throw FileError(file.path(),
                    "is a bilinear model of several people or with named conditions, which this run time "
                    "does not decode; train a deep or a linear one");
  }

  Reader reader(network);
  const std::vector<float> condition = ConditionOf(reader, a, person, conditions);
  const float deviation = static_cast<float>(std::sqrt(reader.Number("texture.variance")));
  network.texture_mean = OwnMean(reader, a, person, "texture.mean", {a.texture_size, a.texture_size, 3});
  network.mean_gain = display.gain;
  network.offset = display.offset;
  for (int c = 0; c < 3; ++c) network.gain[c] = display.gain[c] * deviation;

  network.code = a.model == ModelKind::kDeep ? reader.Dense("decoder.code_fc", kLeakySlope) : DenseLayer();
  const size_t named = NamedChannels(a);
  FoldCondition(condition, named, &network.code);
  ReadMesh(reader, network, person);
  if (a.model == ModelKind::kDeep) {
    network.view = reader.Dense("decoder.view_fc", kLeakySlope);
    SplitInner(reader, network);
    ReadConvolutions(reader, network);
  } else {
    ReadTexels(reader, network);
    FoldCondition(condition, named, &network.mesh);
    FoldCondition(condition, named, &network.texels);
  }
  ReadTopology(network);
  ReadCodes(reader, network);
  return network;
}

}  // namespace likeness
