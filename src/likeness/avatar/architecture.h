// What an avatar's network is: the choices that the paper compares, and the layers that follow from them.
//
// The deep model (Lombardi et al. 2018, section 4, figure 3):
//
//   average texture [3, S, S] -> stride-2 convolutions -> [C, 4, 4] -> FC 256 ─┐
//   mesh [3 V] -----------------------------------------> FC 256 ──────────────┴> mu, log sigma [latent]
//   z [latent] -> FC 256 ─┬-> FC 3 V: mesh
//   view [3] ---> FC 8 ───┴-> FC C x 4 x 4 -> stride-2 transposed convolutions -> texture [3, S, S]
//
// Leaky ReLU 0.2 follows every layer but those that make mu, log sigma, the mesh and the texture. The enumerations
// below say what can be chosen otherwise.
//
// A network for several people, or for frames that differ in more than the face (gaze, light), has a condition vector c
// (section 4, "Identity Conditioning"): who it is, then the named conditions of the frame. It stands beside the code
// wherever the decoder reads z, [z, c], and beside the two sub-encodings where the encoder makes mu and log sigma, so
// that z need not carry what c tells. In the linear models the encoder has it beside the mesh.

#pragma once

#include <string>
#include <vector>

namespace likeness {

enum class ModelKind {
  kDeep,
  kLinear,    // mesh and texture are affine in the code, whatever the view: an active appearance model
  kBilinear,  // the mesh the same; the texture affine in the products of each of the code's and the view's values
};

// How the view vector enters the texture decoder. "All": an affine map of the view, one for each transposed
// convolution, is added to that convolution's input features at every texel; the code's FC then stands alone.
enum class Conditioning {
  kRaw,     // as it is, beside the code's FC
  kFc8,     // after an FC 3-8, beside the code's FC (the paper's choice)
  kFc32,    // after an FC 3-32, beside the code's FC
  kRawAll,  // as it is, added in every layer
  kFc8All,  // after an FC 3-8, added in every layer
};

// How training reparameterises weights or features. Files hold effective weights, without any of it.
enum class Normalisation {
  kNone,
  kBatch,   // Ioffe & Szegedy 2015: every convolution's features, but for the texture itself, over batch and texels
  kWeight,  // Salimans & Kingma 2016: one norm for each output channel (the paper's choice)
  kWeightTensor,  // one norm for a whole weight, a gain for each output channel (Multiface)
};

// Which convolutional layers have a bias for every channel and texel; the others have one for every channel.
enum class UntiedBias {
  kNone,
  kDecoder,
  kDecoderAndChannel,  // and in training a bias for every channel besides; files hold the sum (Multiface)
  kEverywhere,         // the paper's choice
};

// Widths of the layers, and how the code leaves the encoder.
enum class Layout {
  kPaper,      // see EncoderChannels; mu and log sigma by a layer each
  kMultiface,  // always eight convolutions each way, to S / 256 texels a side; mu and log sigma by one layer, scaled
};

// How a convolution of the decoder doubles its side.
enum class Upsampling {
  kTransposed,  // a transposed convolution 4 x 4, stride 2
  kNearest,     // every texel four times, then a convolution 3 x 3 (Multiface calls it bilinear)
};

// How the network is told whose face it is, the first part of the condition vector.
enum class IdentityConditioning {
  kNone,     // not at all
  kOneHot,   // 1 at the person's place, 0 elsewhere (the paper's choice)
  kLearned,  // a vector of identity_size values for each person, trained with the network
};

// A named condition of every frame: "gaze".
struct NamedCondition {
  std::string name;
  int size = 0;  // values

  bool operator==(const NamedCondition&) const = default;
};

// The mesh that textures are unwrapped onto and that the decoder gives.
enum class Geometry { kTracked, kSmoothed, kEllipsoid, kBillboard };

struct Architecture {
  std::string preset = "paper";
  ModelKind model = ModelKind::kDeep;  // the others use neither conditioning, biases, layout nor what follows it
  int texture_size = 1024;             // texels a side: a power of two, 16 ... 4096
  int vertex_count = 0;                // of the mesh, as the capture has it
  int latent = 128;                    // values in a code
  Conditioning conditioning = Conditioning::kFc8;
  Normalisation normalisation = Normalisation::kWeight;
  UntiedBias untied_bias = UntiedBias::kEverywhere;
  Layout layout = Layout::kPaper;
  Upsampling upsampling = Upsampling::kTransposed;
  bool residual = false;  // after each convolution h = act(h + conv3x3(h)); without act where h is the texture
  Geometry geometry = Geometry::kTracked;
  int identities = 1;  // people that one network holds
  IdentityConditioning identity = IdentityConditioning::kNone;
  int identity_size = 0;                   // values of a learned identity vector; 0 otherwise
  std::vector<NamedCondition> conditions;  // in the order of the condition vector

  // Throws Error for values out of range and for choices that are not available yet.
  void Check() const;

  bool operator==(const Architecture&) const = default;
};

inline constexpr int kSubEncoding = 256;  // values that texture and mesh are each reduced to
inline constexpr int kKernel = 4;         // side of the kernels that change the side; stride 2, padding 1
inline constexpr int kSameKernel = 3;     // side of the others; stride 1, padding 1
inline constexpr float kLeakySlope = 0.2f;

// Channels after each stride-2 convolution of the encoder, from the image inwards; the decoder runs them in reverse.
// 1024 x 1024: 16-32-32-64-64-128-128-256, down to 4 x 4. A smaller texture drops layers at the inner end (512: the
// last, 256 channels), so that the layers at the image, where the time goes, are as narrow as in the paper and cost
// falls with the number of texels. A larger one repeats the innermost width. Multiface: 16-16-32-32-64-64-128-128 at
// any size.
std::vector<int> EncoderChannels(const Architecture& architecture);

// Channels of the decoder's features from the inside to the image, the first before any convolution, the last 3.
// Multiface: L-L-64-64-32-32-16-16-3 for a code of L.
std::vector<int> DecoderChannels(const Architecture& architecture);

// Side of the feature map between convolutions and FC layers: 4; S / 256 in Multiface's layout.
int InnerSize(const Architecture& architecture);

// mu and log sigma are the encoder's outputs times these: 1; 0.1 and 0.01 in Multiface's layout.
struct EncoderScales {
  double mu = 1, log_sigma = 1;
};
EncoderScales ScalesOf(const Architecture& architecture);

// Whether the view is added in every layer of the texture decoder, rather than joined to the code.
bool ViewInAllLayers(const Architecture& architecture);

// Values that the view vector becomes before it is joined or added: 3, 8 or 32.
int ViewChannels(const Architecture& architecture);

// Values in the condition vector: those that say who it is, those of the named conditions, and both.
int IdentityChannels(const Architecture& architecture);
int NamedChannels(const Architecture& architecture);
int ConditionChannels(const Architecture& architecture);

// Whether a condition may have this name, which is also a file's: letters, digits, '-' and '_'.
bool IsConditionName(const std::string& name);

// Names as configuration and files spell them. Parse throws Error naming what is known; `what` is the option's name.
std::string ToString(ModelKind value);
std::string ToString(Conditioning value);
std::string ToString(Normalisation value);
std::string ToString(UntiedBias value);
std::string ToString(Layout value);
std::string ToString(Upsampling value);
std::string ToString(IdentityConditioning value);
std::string ToString(Geometry value);
ModelKind ParseModelKind(const std::string& text);
Conditioning ParseConditioning(const std::string& text);
Normalisation ParseNormalisation(const std::string& text);
UntiedBias ParseUntiedBias(const std::string& text);
Layout ParseLayout(const std::string& text);
Upsampling ParseUpsampling(const std::string& text);
IdentityConditioning ParseIdentityConditioning(const std::string& text);
Geometry ParseGeometry(const std::string& text);
const std::vector<std::string>& ModelKindNames();
const std::vector<std::string>& ConditioningNames();
const std::vector<std::string>& NormalisationNames();
const std::vector<std::string>& UntiedBiasNames();
const std::vector<std::string>& LayoutNames();
const std::vector<std::string>& UpsamplingNames();
const std::vector<std::string>& IdentityConditioningNames();
const std::vector<std::string>& GeometryNames();

// One line of JSON, as avatar files and checkpoints keep it. Parse throws Error (without a file name).
std::string ArchitectureToJson(const Architecture& architecture);
Architecture ArchitectureFromJson(const std::string& json);

}  // namespace likeness
