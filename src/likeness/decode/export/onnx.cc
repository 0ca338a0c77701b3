#include "likeness/decode/export/onnx.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <vector>

#include "likeness/avatar/avatar_id.h"
#include "likeness/decode/network.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

using Type = OnnxGraph::Type;
constexpr int64_t kBatch = OnnxGraph::kBatch;
constexpr int64_t kRest = -1;  // in a shape that is asked for: whatever is left, which is the batch

// [rows x columns, channels] -> [channels, rows x columns]
std::vector<float> ByChannel(const std::vector<float>& texels, size_t channels) {
  const size_t area = texels.size() / channels;
  std::vector<float> by_channel(texels.size());
  for (size_t i = 0; i < texels.size(); ++i) by_channel[i % channels * area + i / channels] = texels[i];
  return by_channel;
}

// What is another for each of an avatar's people, one after another: biases.
struct OwnBiases {
  std::vector<float> code;     // [people, features]; empty in linear models
  std::vector<float> mesh;     // [people, 3 V]
  std::vector<float> colours;  // [people, 3, S, S], with the mean texture

  void Append(const DecoderNetwork& network) {
    code.insert(code.end(), network.code.bias.begin(), network.code.bias.end());
    mesh.insert(mesh.end(), network.mesh.bias.begin(), network.mesh.bias.end());
    std::vector<float> texels = network.texels.bias;
    if (!network.layers.empty()) {
      const int size = network.architecture.texture_size;
      texels.resize(static_cast<size_t>(size) * size * 3);
      for (int y = 0; y < size; ++y)
        network.BiasRow(network.layers.back(), y, &texels[static_cast<size_t>(y) * size * 3]);
    }
    texels = ByChannel(texels, 3);
    colours.insert(colours.end(), texels.begin(), texels.end());
  }
};

// Nodes and tensors have the avatar file's names where they do what its layers do.
class DecoderGraph {
 public:
  DecoderGraph(const DecoderNetwork& network, const OwnBiases& own, int64_t people, OnnxGraph* graph)
      : network_(network), a_(network.architecture), own_(own), people_(people), graph_(*graph) {}

  void Build() {
    code_ = graph_.Input("code", Type::kFloat, {kBatch, a_.latent},
                         "latent code; the metadata's mean_code is a face at rest");
    if (a_.model != ModelKind::kLinear) {
      view_ = graph_.Input("view", Type::kFloat, {kBatch, 3},
                           "unit vector from the head's centre to the viewer; x to the subject's left, y up, z out of "
                           "the nose");
    }
    code_ = WithConditions();
    if (people_ > 1) {
      person_ =
          graph_.Input("person", Type::kInt64, {kBatch}, "whose face: from 0, in the order of the metadata's people");
    }
    if (a_.model == ModelKind::kDeep) {
      code_ = Activated(
          Dense("decoder.code_fc", code_, network_.code, Own("decoder.code_fc.bias", {network_.code.out}, own_.code)),
          network_.code.slope);
    }
    Mesh();
    Clamped(a_.model == ModelKind::kDeep ? DeepTexture() : LinearTexture());
    graph_.Output("texture", {kBatch, 3, a_.texture_size, a_.texture_size},
                  "red, green, blue from 0 to 255 as in training; row 0 is v = 1");
    graph_.Output("vertices", {kBatch, a_.vertex_count, 3},
                  "x y z in millimetres; x to the subject's left, y up, z out of the nose");
  }

 private:
  // The code, and what stands beside it: the named conditions, standardised.
  std::string WithConditions() {
    if (a_.conditions.empty()) return code_;
    std::vector<std::string> values;
    for (const NamedCondition& condition : a_.conditions) {
      values.push_back(graph_.Input("condition." + condition.name, Type::kFloat, {kBatch, condition.size},
                                    condition.name + " of the frame, as captured"));
    }
    const int64_t named = NamedChannels(a_);
    const std::string mean = graph_.Tensor("conditions.mean", {named}, network_.file.Floats("condition.mean", {named}));
    const std::string deviation =
        graph_.Tensor("conditions.deviation", {named}, network_.file.Floats("condition.deviation", {named}));
    const std::string all = graph_.Node("Concat", "conditions", values, {{"axis", int64_t{1}}});
    const std::string centred = graph_.Node("Sub", "conditions.centred", {all, mean});
    const std::string standard = graph_.Node("Div", "conditions.standardised", {centred, deviation});
    return graph_.Node("Concat", "code_and_conditions", {code_, standard}, {{"axis", int64_t{1}}});
  }

  // A bias of the person's own: [shape], or [batch, shape].
  std::string Own(const std::string& name, OnnxGraph::Shape shape, const std::vector<float>& values) {
    if (people_ == 1) return graph_.Tensor(name, shape, values);
    shape.insert(shape.begin(), people_);
    return graph_.Node("Gather", name + ".own", {graph_.Tensor(name, shape, values), person_}, {{"axis", int64_t{0}}});
  }

  // Without its activation.
  std::string Dense(const std::string& name, const std::string& x, const DenseLayer& layer, const std::string& bias) {
    const size_t in = layer.in, named = layer.named.size() / layer.out;
    std::vector<float> weight;
    weight.reserve(layer.weight.size() + layer.named.size());
    for (int o = 0; o < layer.out; ++o) {
      weight.insert(weight.end(), layer.weight.begin() + o * in, layer.weight.begin() + (o + 1) * in);
      weight.insert(weight.end(), layer.named.begin() + o * named, layer.named.begin() + (o + 1) * named);
    }
    const auto columns = static_cast<int64_t>(in + named);
    return graph_.Node("Gemm", name, {x, graph_.Tensor(name + ".weight", {layer.out, columns}, weight), bias},
                       {{"transB", int64_t{1}}});
  }
  std::string Dense(const std::string& name, const std::string& x, const DenseLayer& layer) {
    return Dense(name, x, layer, graph_.Tensor(name + ".bias", {layer.out}, layer.bias));
  }

  std::string Activated(const std::string& x, float slope) {
    return slope == 1 ? x : graph_.Node("LeakyRelu", x + ".act", {x}, {{"alpha", slope}});
  }

  std::string Reshaped(const std::string& x, const std::string& name, const std::vector<int64_t>& shape) {
    return graph_.Node("Reshape", name, {x, graph_.Tensor(name + ".shape", shape)});
  }

  void Mesh() {
    const DenseLayer& mesh = network_.mesh;
    const std::string flat = Dense("decoder.mesh_fc", code_, mesh, Own("decoder.mesh_fc.bias", {mesh.out}, own_.mesh));
    Reshaped(flat, "vertices", {kRest, a_.vertex_count, 3});
  }

  std::string DeepTexture() {
    const std::string view =
        network_.view.empty() ? view_ : Activated(Dense("decoder.view_fc", view_, network_.view), network_.view.slope);
    std::string x = Inner(view);
    int number = 0;
    for (const ConvolutionLayer& layer : network_.layers) {
      const bool up = layer.kind == ConvolutionLayer::Kind::kUp;
      const std::string index = std::to_string(up ? number++ : number - 1);
      if (!layer.view_add.empty()) {
        const std::string add = "decoder.view_add." + index;
        const std::string every = Reshaped(Dense(add, view, layer.view_add), add + ".texel", {kRest, layer.in, 1, 1});
        x = graph_.Node("Add", add + ".sum", {x, every});
      }
      x = Convolution((up ? "decoder.texture_conv." : "decoder.texture_res.") + index, x, layer);
    }
    return x;
  }

  // The view's features and the code's, or the code's alone, to the first texture features.
  std::string Inner(const std::string& view) {
    const DenseLayer& by_code = network_.inner;
    const DenseLayer& by_view = network_.inner_view;
    DenseLayer both{by_view.in + by_code.in, by_code.out, {}, by_code.bias, by_code.slope};
    for (int o = 0; o < both.out; ++o) {
      const auto row = [o](const DenseLayer& layer) {
        return layer.weight.begin() + static_cast<ptrdiff_t>(o) * layer.in;
      };
      both.weight.insert(both.weight.end(), row(by_view), row(by_view) + by_view.in);
      both.weight.insert(both.weight.end(), row(by_code), row(by_code) + by_code.in);
    }
    std::string x = code_;
    if (by_view.in > 0) x = graph_.Node("Concat", "view_and_code", {view, code_}, {{"axis", int64_t{1}}});
    x = Activated(Dense("decoder.texture_fc", x, both), both.slope);
    const int64_t side = InnerSize(a_);
    return Reshaped(x, "decoder.texture", {kRest, both.out / (side * side), side, side});
  }

  std::string Convolution(const std::string& name, const std::string& x, const ConvolutionLayer& layer) {
    const bool up = layer.kind == ConvolutionLayer::Kind::kUp;
    const int64_t side = layer.taps_a_side(), in = layer.in, out = layer.out, size = layer.out_size;
    // [ky, kx, in, out] -> [in, out, ky, kx], or [out, in, ky, kx]
    std::vector<float> weight(layer.taps.size());
    for (int64_t tap = 0; tap < side * side; ++tap) {
      for (int64_t i = 0; i < in; ++i) {
        for (int64_t o = 0; o < out; ++o) {
          weight[(up ? i * out + o : o * in + i) * side * side + tap] = layer.taps[(tap * in + i) * out + o];
        }
      }
    }
    const OnnxGraph::Shape shape = up ? OnnxGraph::Shape{in, out, side, side} : OnnxGraph::Shape{out, in, side, side};
    std::vector<std::string> inputs = {x, graph_.Tensor(name + ".weight", shape, weight)};
    std::vector<OnnxGraph::Attribute> attributes = {{"kernel_shape", std::vector<int64_t>{side, side}},
                                                    {"pads", std::vector<int64_t>{1, 1, 1, 1}}};
    if (up) attributes.push_back({"strides", std::vector<int64_t>{2, 2}});
    const char* const operation = up ? "ConvTranspose" : "Conv";
    if (!network_.HasBiasForEveryTexel(layer)) {
      inputs.push_back(graph_.Tensor(name + ".bias", {out}, layer.bias));
      return Activated(graph_.Node(operation, name, inputs, attributes), layer.slope);
    }
    const bool last = &layer == &network_.layers.back();
    const std::string bias = last ? Own(name + ".bias", {out, size, size}, own_.colours)
                                  : graph_.Tensor(name + ".bias", {out, size, size}, layer.bias);
    const std::string without = graph_.Node(operation, name, inputs, attributes);
    return Activated(graph_.Node("Add", name + ".sum", {without, bias}), layer.slope);
  }

  // Texels of a dense layer are red, green, blue side by side; the model's are in planes.
  std::string LinearTexture() {
    const std::string name = "decoder.texture_fc";
    std::string x = code_;
    if (a_.model == ModelKind::kBilinear) {
      // The code times the view's x, then times its y, then times its z.
      const std::string view = Reshaped(view_, "view.column", {kRest, 3, 1});
      const std::string code = Reshaped(code_, "code.row", {kRest, 1, a_.latent});
      x = Reshaped(graph_.Node("Mul", "view_times_code", {view, code}), "view_times_code.flat", {kRest, 3 * a_.latent});
    }
    const DenseLayer& texels = network_.texels;
    DenseLayer planes{texels.in, texels.out, {}, {}, 1};
    for (int channel = 0; channel < 3; ++channel) {
      for (int o = channel; o < texels.out; o += 3) {
        const auto append = [o](const std::vector<float>& rows, size_t width, std::vector<float>* to) {
          to->insert(to->end(), rows.begin() + o * width, rows.begin() + (o + 1) * width);
        };
        append(texels.weight, texels.in, &planes.weight);
        append(texels.named, texels.named.size() / texels.out, &planes.named);
      }
    }
    const std::string flat = Dense(name, x, planes, Own(name + ".bias", {texels.out}, own_.colours));
    return Reshaped(flat, "decoder.texture", {kRest, 3, a_.texture_size, a_.texture_size});
  }

  void Clamped(const std::string& colours) {
    const float least = 0, most = 255;
    graph_.Node(
        "Clip", "texture",
        {colours, graph_.Tensor("texture.least", {}, {&least, 1}), graph_.Tensor("texture.most", {}, {&most, 1})});
  }

  const DecoderNetwork& network_;
  const Architecture& a_;
  const OwnBiases& own_;
  const int64_t people_;
  OnnxGraph& graph_;
  std::string code_;  // with all that stands beside it; then its features
  std::string view_, person_;
};

std::map<std::string, std::string> MetadataOf(const DecoderNetwork& network, const OnnxOptions& options) {
  std::map<std::string, std::string> metadata = {{"avatar", AvatarId(network.file)},
                                                 {"mean_code", fmt::format("{}", fmt::join(network.mean_code, ","))}};
  const auto people = network.file.metadata().find("identities");
  if (!options.person && people != network.file.metadata().end()) metadata["people"] = people->second;
  return metadata;
}

}  // namespace

std::string OnnxBytes(const fs::path& avatar_file, const OnnxOptions& options) {
  const auto open = [&](int person) { return NetworkFrom(SafetensorsFile::Map(avatar_file), {}, person); };
  const DecoderNetwork network = open(options.person.value_or(0));
  const int people = options.person ? 1 : network.architecture.identities;
  OwnBiases own;
  own.Append(network);
  for (int person = 1; person < people; ++person) own.Append(open(person));
  OnnxGraph graph(avatar_file, options.most_bytes);
  DecoderGraph(network, own, people, &graph).Build();
  return graph.ModelBytes("likeness decoder", MetadataOf(network, options));
}

}  // namespace likeness
