#include "likeness/decode/plan.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/decode/layout.h"

namespace likeness {

namespace {

// Phases of a frame; a step's own are kSteps + its index.
enum Phase { kFeatures, kInner, kMesh, kTexels, kCascadePhase, kColumns, kDerivatives, kSteps };

constexpr int kVerticesAtOnce = 16;  // 48 values, whole dense blocks
constexpr int kMeshBlocks = 3 * kVerticesAtOnce / kDenseBlock;
constexpr int kRingLines = 4;
constexpr int kMostBlockSize = 8;   // texels a side of inputs that are worked on as a whole, split by columns
constexpr int kMostSplitSize = 32;  // of those whose rows are split over threads with a wait after the layer
constexpr int64_t kAlignment = 64;
constexpr float kRangeMargin = 2;  // other codes and views may give larger features than those that were measured
constexpr float kLeastRange = 1e-6f;
constexpr int64_t kMargin = 1 << 15;  // bytes: more than a texel of features before a line

int RoundUp(int value, int step) { return (value + step - 1) / step * step; }
int64_t RoundUp64(int64_t value) { return (value + kAlignment - 1) / kAlignment * kAlignment; }

[[noreturn]] void Unrepresentable(const Kernel& kernel) {
  throw Error("the kernel '{}' cannot represent a value of this avatar", kernel.name);
}

}  // namespace

Plan::Plan(const DecoderNetwork& network, const Kernel& kernel, int threads, std::span<const float> ranges)
    : kernel_(kernel), architecture_(network.architecture), threads_(threads) {
  bilinear_ = architecture_.model == ModelKind::kBilinear;
  features_ = network.code.empty() ? architecture_.latent : network.code.out;
  view_features_ = network.view.empty() ? 3 : network.view.out;
  code_ = PackDense(network.code, network.code.bias);
  code_weight_ = network.code.weight;
  mesh_ = PackDense(network.mesh, network.mesh.bias);
  view_ = PackDense(network.view, network.view.bias);
  texels_ = PackDense(network.texels, network.texels.bias);
  const int inner_area = InnerSize(architecture_) * InnerSize(architecture_);
  const DenseLayer inner = TexelMajor(network.inner, inner_area), by_view = TexelMajor(network.inner_view, inner_area);
  inner_ = PackDense(inner, inner.bias);
  inner_view_ = PackDense(by_view, by_view.bias);
  steps_.resize(network.layers.size());
  LIKENESS_CHECK(ranges.size() == (kernel.fixed_point ? steps_.size() : 0));
  for (size_t i = 0; i < steps_.size(); ++i) PackLayer(network, network.layers[i], steps_[i], ranges);
  LayOut();
  MakeJobs();
  phases_.resize(steps_.size() + 8);
}

Plan::Dense Plan::PackDense(const DenseLayer& layer, std::span<const float> bias) {
  if (layer.empty()) return {};
  // The mesh is worked on by whole groups of vertices.
  const int outputs = RoundUp(layer.out, kDenseBlock * kMeshBlocks);
  Dense dense{nullptr, nullptr, layer.in, outputs / kDenseBlock, layer.slope};
  const int64_t block_values = static_cast<int64_t>(layer.in) * kDenseBlock;
  std::byte* const packed =
      static_cast<std::byte*>(memory_.Allocate(dense.blocks * block_values * kernel_.dense_bytes));
  std::atomic<bool> fits = true;
  constexpr int kBlocksAtOnce = 64;
  ParallelFor((dense.blocks + kBlocksAtOnce - 1) / kBlocksAtOnce, [&](int64_t part) {
    std::vector<float> values(static_cast<size_t>(block_values));
    const int first = static_cast<int>(part) * kBlocksAtOnce;
    for (int block = first; block < std::min(first + kBlocksAtOnce, dense.blocks); ++block) {
      for (int i = 0; i < layer.in; ++i) {
        for (int k = 0; k < kDenseBlock; ++k) {
          const int o = block * kDenseBlock + k;
          values[static_cast<size_t>(i) * kDenseBlock + k] =
              o < layer.out ? layer.weight[static_cast<size_t>(o) * layer.in + i] : 0.0f;
        }
      }
      if (!kernel_.pack_dense(values.data(), block_values, packed + block * block_values * kernel_.dense_bytes)) {
        fits = false;
      }
    }
  });
  if (!fits) Unrepresentable(kernel_);
  dense.weights = packed;
  if (!bias.empty()) {
    float* const to = static_cast<float*>(memory_.Allocate(static_cast<int64_t>(outputs) * 4));
    std::copy(bias.begin(), bias.end(), to);
    dense.bias = to;
  }
  return dense;
}

void Plan::PackLayer(const DecoderNetwork& network, const ConvolutionLayer& layer, Step& step,
                     std::span<const float> ranges) {
  const bool last = &layer == &network.layers.back();
  const int in = PaddedChannels(layer.in), out = last ? 4 : PaddedChannels(layer.out);
  step.up = layer.kind == ConvolutionLayer::Kind::kUp;
  step.in_size = layer.in_size;
  step.out_size = layer.out_size;
  step.out_channels = out;
  step.jobs = step.up ? layer.in_size + 1 : layer.in_size;
  PackedConvolution& packed = step.packed;
  packed.in_rows = step.up ? 2 : 3;
  packed.out_rows = step.up ? 2 : 1;
  packed.channels = in;
  packed.depth = packed.in_rows * in;
  packed.columns = RoundUp((step.up ? 4 : 1) * out, kChannelMultiple);
  packed.count = step.jobs;
  packed.slope = layer.slope;
  packed.colours = last;
  const size_t index = static_cast<size_t>(&step - steps_.data());
  if (kernel_.fixed_point) {
    const auto range = [&](size_t i) { return std::max(kRangeMargin * ranges[i], kLeastRange); };
    packed.in_range = range(index);
    if (!last) packed.out_range = range(index + 1);
  }
  void* const weights = memory_.Allocate(kernel_.weight_bytes(packed));
  if (!kernel_.pack_weights(GemmWeights(layer, in, out, packed.columns).data(), packed, weights)) {
    Unrepresentable(kernel_);
  }
  packed.weights = weights;

  const bool whole = step.up && layer.in_size <= kMostBlockSize && out % kColumnBlock == 0 && !last &&
                     (index == 0 || steps_[index - 1].mode == Mode::kBlock);
  step.mode = whole ? Mode::kBlock : layer.in_size <= kMostSplitSize && !last ? Mode::kRows : Mode::kCascade;
  step.add = PackDense(layer.view_add, layer.view_add.bias);
  PackBiases(network, layer, step);
}

void Plan::PackBiases(const DecoderNetwork& network, const ConvolutionLayer& layer, Step& step) {
  std::atomic<bool> fits = true;
  const int size = layer.out_size, channels = step.out_channels;
  // A row with padded channels and a texel of zeros at either end.
  const auto padded_row = [&](int y, float* row) {
    std::vector<float> values(static_cast<size_t>(size) * layer.out);
    network.BiasRow(layer, y, values.data());
    for (int x = 0; x < size; ++x) {
      float* const to = row + static_cast<size_t>(x + 1) * channels;
      std::copy_n(values.data() + static_cast<size_t>(x) * layer.out, layer.out, to);
      if (step.packed.colours) to[3] = 255;
    }
  };
  if (step.packed.colours) {
    step.pixel_bias_pitch = RoundUp64(kernel_.pixel_bias_bytes(step.packed));
    std::byte* const to = static_cast<std::byte*>(memory_.Allocate(step.pixel_bias_pitch * step.jobs + 4096));
    ParallelFor(step.jobs, [&](int64_t job) {
      const size_t row_values = static_cast<size_t>(size + 2 + 2 * kRowSlack) * channels;
      std::vector<float> rows(2 * row_values, 0.0f);
      const int first = step.up ? 2 * static_cast<int>(job) - 1 : static_cast<int>(job);
      for (int r = 0; r < step.packed.out_rows; ++r) {
        if (first + r >= 0 && first + r < size) padded_row(first + r, rows.data() + r * row_values);
      }
      // kUp begins with texel -1, kSame with texel 0.
      const size_t skip = step.up ? 0 : static_cast<size_t>(channels);
      const float* const pointers[2] = {rows.data() + skip, rows.data() + row_values + skip};
      if (!kernel_.pack_pixel_bias(pointers, step.packed, to + job * step.pixel_bias_pitch)) fits = false;
    });
    step.biases = to;
  } else {
    const bool every = network.HasBiasForEveryTexel(layer);
    const int64_t texel = static_cast<int64_t>(channels) * kernel_.bias_bytes, pitch = (size + 2) * texel;
    const int rows = every ? size : 1;
    std::byte* const to = static_cast<std::byte*>(memory_.Allocate(rows * pitch + (2 * kRowSlack) * texel + 4096));
    ParallelFor(rows, [&](int64_t y) {
      std::vector<float> row(static_cast<size_t>(size + 2) * channels, 0.0f);
      padded_row(static_cast<int>(y), row.data());
      if (!kernel_.pack_bias(step.packed, row.data(), static_cast<int>(row.size()), to + y * pitch)) fits = false;
    });
    step.biases = to;
    step.bias_pitch = every ? pitch : 0;
  }
  if (!fits) Unrepresentable(kernel_);
}

// Places everything that a frame writes.
void Plan::LayOut() {
  int64_t& at = view_bytes_;
  const auto take = [&](int64_t bytes) {
    const int64_t begin = at;
    at += RoundUp64(bytes);
    return begin;
  };
  // A map with a margin of zeros: rows -1 and `size`, and texels beside each row. With `shared`, the texel after a row
  // is the one before the next, so that a block job can run over all rows.
  const auto map = [&](int size, int channels, bool shared) {
    Map m{size, channels, shared ? size + 1 : size + 2 + 2 * kRowSlack, 0,
          static_cast<int64_t>(channels) * kernel_.element_bytes};
    const int64_t texels = (size + 2) * m.pitch + 2 + 4 * kRowSlack;
    m.offset = take(texels * m.texel_bytes) + (m.pitch + 1) * m.texel_bytes;
    return m;
  };
  view_features_at_ = take(RoundUp(view_features_, kDenseBlock * kMeshBlocks) * 4);
  factors_at_ = take(static_cast<int64_t>(3) * architecture_.latent * 4);
  inner_values_at_ = take(static_cast<int64_t>(inner_.blocks) * kDenseBlock * 4);
  int widest = 0;
  if (!steps_.empty()) {
    inner_map_ = map(InnerSize(architecture_), steps_[0].packed.channels, true);
    for (Step& step : steps_) {
      if (step.mode != Mode::kCascade) step.out = map(step.out_size, step.out_channels, step.mode == Mode::kBlock);
      if (step.add.weights != nullptr) step.view_add = take(static_cast<int64_t>(step.add.blocks) * kDenseBlock * 4);
      widest =
          std::max(widest, (step.out_size + 2 + 4 * kRowSlack) * std::max(step.out_channels, step.packed.channels));
    }
  }
  line_bytes_ = RoundUp64(static_cast<int64_t>(widest) * kernel_.element_bytes);
  zero_line_ = take(line_bytes_);
  // The threads' rings of lines: MakeJobs takes them.
  thread_.resize(threads_);
  for (Thread& thread : thread_) {
    int64_t scratch = kScratchBytes;
    int values = std::max(48 * architecture_.latent, 7 * architecture_.texture_size + kRowSlack);
    for (const Step& step : steps_) {
      scratch = std::max<int64_t>(scratch, static_cast<int64_t>(kRowSlack + 32) * step.packed.columns * 4);
      if (step.mode == Mode::kBlock) {
        values = std::max(values, ((step.in_size + 1) * (step.in_size + 1) + kRowSlack) * kColumnBlock);
      }
    }
    thread.scratch = static_cast<std::byte*>(memory_.Allocate(scratch));
    thread.values = static_cast<float*>(memory_.Allocate(static_cast<int64_t>(std::max(values, 4096)) * 4));
  }
  const auto floats = [&](int64_t count) { return static_cast<float*>(memory_.Allocate(count * 4)); };
  code_copy_ = floats(RoundUp(architecture_.latent, kDenseBlock));
  code_features_ = floats(RoundUp(features_, kDenseBlock * kMeshBlocks));
  inner_shared_ = floats(static_cast<int64_t>(inner_.blocks) * kDenseBlock);
  columns_ = floats(static_cast<int64_t>(architecture_.latent) * features_);
}

// What each thread does in the phases that go by rows.
struct Plan::Generator {
  struct Ring {
    int64_t lines = 0, pitch = 0;  // of texel 0 of the first line
    int row[kRingLines] = {-1, -1, -1, -1};
  };
  Plan& plan;
  size_t first;  // of the cascade
  std::vector<Ring> rings = {};
  std::vector<LineJob>* jobs = nullptr;
  int64_t trash = 0;  // a line for rows outside of the image, texel 0

  // Where row y of a step's input lies, texel -1; its making is scheduled if need be.
  int64_t Input(size_t index, int y) {
    const Step& step = plan.steps_[index];
    if (y < 0 || y >= step.in_size) return plan.zero_line_;
    if (index == 0) return plan.inner_map_.At(y, -1);
    const Step& before = plan.steps_[index - 1];
    if (before.mode != Mode::kCascade) return before.out.At(y, -1);
    Ring& ring = rings[index - 1];
    const int slot = y % kRingLines;
    if (ring.row[slot] != y) Add(index - 1, before.up ? (y + 1) / 2 : y);
    LIKENESS_CHECK(ring.row[slot] == y);
    return ring.lines + slot * ring.pitch - before.out.texel_bytes;
  }

  // Row `job` of a step's jobs. kUp: job j makes output rows 2 j - 1 and 2 j.
  void Add(size_t index, int job) {
    const Step& step = plan.steps_[index];
    LineJob line;
    line.step = &step;
    line.row = step.up ? 2 * job - 1 : job;
    const int above = job - 1;
    for (int r = 0; r < step.packed.in_rows; ++r) Input(index, above + r);  // all are made before any is named
    for (int r = 0; r < step.packed.in_rows; ++r) line.in[r] = Input(index, above + r);
    if (step.packed.colours) {
      line.bias[0] = step.biases + job * step.pixel_bias_pitch;
    } else {
      for (int r = 0; r < step.packed.out_rows; ++r) Output(index, line.row + r, r, line);
    }
    jobs->push_back(line);
  }

  void Output(size_t index, int y, int r, LineJob& line) {
    const Step& step = plan.steps_[index];
    const bool inside = y >= 0 && y < step.out_size;
    const int64_t texel = step.out.texel_bytes, first_texel = step.up ? -texel : 0;
    line.bias[r] = step.biases + (inside ? y * step.bias_pitch : 0) + (step.up ? 0 : plan.BiasTexel(step));
    if (!inside) {
      line.out[r] = trash + first_texel;
    } else if (step.mode != Mode::kCascade) {
      line.out[r] = step.out.At(y, 0) + first_texel;
    } else {
      Ring& ring = rings[index];
      ring.row[y % kRingLines] = y;
      line.out[r] = ring.lines + y % kRingLines * ring.pitch + first_texel;
    }
  }
};

int64_t Plan::BiasTexel(const Step& step) const { return static_cast<int64_t>(step.out_channels) * kernel_.bias_bytes; }

void Plan::MakeJobs() {
  const auto first = static_cast<size_t>(
      std::find_if(steps_.begin(), steps_.end(), [](const Step& s) { return s.mode == Mode::kCascade; }) -
      steps_.begin());
  for (size_t i = first; i < steps_.size(); ++i) {
    LIKENESS_CHECK(steps_[i].mode == Mode::kCascade);
    steps_[i].out.texel_bytes = static_cast<int64_t>(steps_[i].out_channels) * kernel_.element_bytes;
  }
  for (int t = 0; t < threads_ && !steps_.empty(); ++t) {
    Thread& thread = thread_[t];
    Generator generator{*this, first};
    generator.trash = view_bytes_ + kMargin;
    view_bytes_ += line_bytes_ + kMargin;
    thread.rows.resize(first + 1);
    for (size_t i = 0; i < first; ++i) {
      if (steps_[i].mode != Mode::kRows) continue;
      generator.jobs = &thread.rows[i];
      const auto [begin, end] = ShareOf(steps_[i].jobs, t);
      for (int job = begin; job < end; ++job) generator.Add(i, job);
    }
    generator.rings.resize(steps_.size());
    for (size_t i = first; i + 1 < steps_.size(); ++i) {
      const Step& step = steps_[i];
      Generator::Ring& ring = generator.rings[i];
      ring.pitch = RoundUp64((step.out_size + 2 + 2 * kRowSlack) * step.out.texel_bytes);
      ring.lines = view_bytes_ + step.out.texel_bytes;
      view_bytes_ += kRingLines * ring.pitch + RoundUp64(4 * kRowSlack * step.out.texel_bytes);
    }
    generator.jobs = &thread.rows[first];
    const auto [begin, end] = ShareOf(steps_.back().jobs, t);
    for (int job = begin; job < end; ++job) generator.Add(steps_.size() - 1, job);
  }
  constexpr int64_t kStagger = 4096 + 256;  // views that lie a power of two apart would meet in the caches
  view_bytes_ = RoundUp64(view_bytes_) + kStagger;
  std::byte* const memory = static_cast<std::byte*>(memory_.Allocate(kMostViews * view_bytes_));
  for (int v = 0; v < kMostViews; ++v) view_memory_[v] = memory + v * view_bytes_;
}

std::pair<int, int> Plan::ShareOf(int count, int thread) const {
  const auto cut = [&](int t) { return static_cast<int>(static_cast<int64_t>(count) * t / threads_); };
  return {cut(thread), cut(thread + 1)};
}

void Plan::Decode(const FrameRequest& request, Team& team) {
  request_ = request;
  std::copy_n(request.code, architecture_.latent, code_copy_);
  const bool deep = !steps_.empty();
  int count = 0;
  phases_[count++] = kFeatures;
  if (request.views > 0 && deep) phases_[count++] = kInner;
  if (request.vertices != nullptr) phases_[count++] = kMesh;
  if (request.views > 0 && !deep) phases_[count++] = kTexels;
  if (request.views > 0 && deep) {
    for (size_t i = 0; i < steps_.size() && steps_[i].mode != Mode::kCascade; ++i) {
      phases_[count++] = kSteps + static_cast<int>(i);
    }
    phases_[count++] = kCascadePhase;
  }
  team.Run(*this, count);
}

void Plan::Jacobian(const float* code, const int* vertices, int count, float* out, Team& team) {
  request_ = {};
  std::copy_n(code, architecture_.latent, code_copy_);
  jacobian_ = {vertices, count, out};
  phases_[0] = kFeatures;
  phases_[1] = kColumns;
  phases_[2] = kDerivatives;
  team.Run(*this, 3);
}

void Plan::Run(int phase, int thread) {
  switch (const int what = phases_[phase]) {
    case kFeatures:
      return RunFeatures(thread);
    case kInner:
      return RunInner(thread);
    case kMesh:
      return RunMesh(thread);
    case kTexels:
      return RunTexels(thread);
    case kCascadePhase:
      return RunLines(thread_[thread].rows.back(), thread);
    case kColumns:
      return RunColumns(thread);
    case kDerivatives:
      return RunJacobian(thread);
    default: {
      const Step& step = steps_[what - kSteps];
      if (step.mode == Mode::kBlock) return RunBlock(step, thread);
      return RunLines(thread_[thread].rows[what - kSteps], thread);
    }
  }
}

// The one place where what drives the network is put together.
void Plan::RunFeatures(int thread) {
  if (code_.weights != nullptr) {
    const auto [begin, end] = ShareOf(code_.blocks, thread);
    kernel_.dense({code_.weights, code_.bias, code_copy_, code_features_ + begin * kDenseBlock, 0, 0, code_.in, begin,
                   end, 1, code_.slope});
  } else if (thread == 0) {
    std::copy_n(code_copy_, features_, code_features_);
  }
  if (thread != 0) return;
  for (int v = 0; v < request_.views; ++v) {
    float* const features = ViewFloats(v, view_features_at_);
    const float* const view = request_.view[v];
    if (view_.weights != nullptr) {
      kernel_.dense({view_.weights, view_.bias, view, features, 0, 0, view_.in, 0, view_.blocks, 1, view_.slope});
    } else {
      std::copy_n(view, 3, features);
    }
    for (const Step& step : steps_) {
      if (step.add.weights == nullptr) continue;
      kernel_.dense({step.add.weights, step.add.bias, features, ViewFloats(v, step.view_add), 0, 0, step.add.in, 0,
                     step.add.blocks, 1, 1});
    }
    if (bilinear_) {
      float* factors = ViewFloats(v, factors_at_);
      for (int axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < architecture_.latent; ++i) *factors++ = view[axis] * code_copy_[i];
      }
    }
  }
}

void Plan::RunInner(int thread) {
  const auto [begin, end] = ShareOf(inner_map_.size * inner_map_.size, thread);
  const int channels = inner_map_.channels, blocks = channels / kDenseBlock;
  const bool joined = inner_view_.weights != nullptr;
  kernel_.dense({inner_.weights, inner_.bias, code_features_, inner_shared_ + begin * channels, 0, 0, inner_.in,
                 begin * blocks, end * blocks, 1, joined ? 1 : inner_.slope});
  for (int v = 0; v < request_.views; ++v) {
    float* values = ViewFloats(v, inner_values_at_);
    if (joined) {
      kernel_.dense({inner_view_.weights, inner_shared_, ViewFloats(v, view_features_at_), values + begin * channels, 0,
                     0, inner_view_.in, begin * blocks, end * blocks, 1, inner_.slope});
    } else {
      std::copy_n(inner_shared_ + begin * channels, (end - begin) * channels, values + begin * channels);
    }
    const float* const add = AddFor(0, v);
    for (int texel = begin; texel < end; ++texel) {
      float* const from = values + static_cast<ptrdiff_t>(texel) * channels;
      for (int c = 0; add != nullptr && c < channels; ++c) from[c] += add[c];
      kernel_.store(from, channels, steps_[0].packed.in_range,
                    view_memory_[v] + inner_map_.At(texel / inner_map_.size, texel % inner_map_.size));
      NoteRange(thread, 0, from, channels);
    }
  }
}

const float* Plan::AddFor(size_t layer, int view) const {
  if (layer >= steps_.size() || steps_[layer].view_add < 0) return nullptr;
  return ViewFloats(view, steps_[layer].view_add);
}

void Plan::RunMesh(int thread) {
  const int vertices = architecture_.vertex_count;
  const auto [begin, end] = ShareOf((vertices + kVerticesAtOnce - 1) / kVerticesAtOnce, thread);
  constexpr int kGroups = 16;  // whose values stay in the first-level cache
  float* const values = thread_[thread].values;
  std::byte* const out = reinterpret_cast<std::byte*>(request_.vertices);
  for (int group = begin; group < end; group += kGroups) {
    const int first = group * kMeshBlocks, last = std::min(group + kGroups, end) * kMeshBlocks;
    kernel_.dense({mesh_.weights, mesh_.bias, code_features_, values, 0, 0, mesh_.in, first, last, 1, 1});
    const int vertex = group * kVerticesAtOnce;
    const int stop = std::min(std::min(group + kGroups, end) * kVerticesAtOnce, vertices);
    for (int i = vertex; i < stop; ++i) {
      std::memcpy(out + i * request_.vertex_bytes, values + 3 * (i - vertex), 3 * sizeof(float));
    }
  }
}

void Plan::RunBlock(const Step& step, int thread) {
  const PackedConvolution& packed = step.packed;
  const size_t index = static_cast<size_t>(&step - steps_.data());
  const Map& in = index == 0 ? inner_map_ : steps_[index - 1].out;
  const int width = step.in_size + 1, half = packed.columns / 2;
  const auto [begin, end] = ShareOf(packed.columns / kColumnBlock, thread);
  float* const sums = thread_[thread].values;
  const int64_t bias_texel = BiasTexel(step);
  for (int block = begin; block < end; ++block) {
    const int column = block * kColumnBlock, r = column / half, x = column % half / step.out_channels;
    const int channel = column % step.out_channels;
    for (int v = 0; v < request_.views; ++v) {
      std::byte* const memory = view_memory_[v];
      BlockJob job{&packed, {}, column, kColumnBlock, width * width};
      for (int dy = 0; dy < 2; ++dy) job.in[dy] = memory + in.At(dy - 1, -1);
      kernel_.block(job, sums);
      const float* add = AddFor(index + 1, v);
      if (add != nullptr) add += channel;
      for (int m = 0; m < width; ++m) {
        const int y = 2 * m - 1 + r;
        if (y < 0 || y >= step.out_size) continue;
        for (int n = 0; n < width; ++n) {
          const int to = 2 * n - 1 + x;
          if (to < 0 || to >= step.out_size) continue;
          std::byte* const features = memory + step.out.At(y, to) + channel * kernel_.element_bytes;
          kernel_.finish(packed, sums + (m * width + n) * kColumnBlock,
                         step.biases + y * step.bias_pitch + (to + 1) * bias_texel + channel * kernel_.bias_bytes, add,
                         kColumnBlock, features);
          NoteRange(thread, index + 1, features, kColumnBlock);
        }
      }
    }
  }
}

void Plan::RunLines(const std::vector<LineJob>& jobs, int thread) {
  void* const scratch = thread_[thread].scratch;
  for (const LineJob& line : jobs) {
    const Step& step = *line.step;
    const size_t index = static_cast<size_t>(&step - steps_.data());
    for (int v = 0; v < request_.views; ++v) {
      std::byte* const memory = view_memory_[v];
      if (step.packed.colours) {
        PixelJob job{&step.packed, {}, line.bias[0], {}, step.up ? -1 : 0, step.out_size, request_.format};
        for (int r = 0; r < step.packed.in_rows; ++r) job.in[r] = memory + line.in[r];
        for (int r = 0; r < step.packed.out_rows; ++r) {
          const int y = line.row + r;
          if (y >= 0 && y < step.out_size) job.pixels[r] = request_.pixels[v] + y * request_.row_bytes[v];
        }
        kernel_.pixels(job, scratch);
        continue;
      }
      RowJob job{&step.packed, {}, {}, {line.bias[0], line.bias[1]}, AddFor(index + 1, v), step.out_channels};
      for (int r = 0; r < step.packed.in_rows; ++r) job.in[r] = memory + line.in[r];
      for (int r = 0; r < step.packed.out_rows; ++r) job.out[r] = memory + line.out[r];
      kernel_.rows(job, scratch);
      const auto texel = static_cast<size_t>(step.out.texel_bytes);
      for (int r = 0; r < step.packed.out_rows; ++r) {
        std::byte* const out = memory + line.out[r];
        if (step.up) {  // the first and the last texel of what was written are the margin, which stays zero
          std::memset(out, 0, texel);
          std::memset(out + (step.out_size + 1) * texel, 0, texel);
        }
        if (line.row + r >= 0 && line.row + r < step.out_size) {
          NoteRange(thread, index + 1, out + (step.up ? texel : 0), step.out_size * step.out_channels);
        }
      }
    }
  }
}

void Plan::RunTexels(int thread) {
  const int size = architecture_.texture_size, blocks = 3 * size / kDenseBlock;
  const auto [begin, end] = ShareOf(size, thread);
  float* const line = thread_[thread].values;
  float* const colours = line + 3 * size;
  for (int y = begin; y < end; ++y) {
    for (int v = 0; v < request_.views; ++v) {
      const float* const factors = bilinear_ ? ViewFloats(v, factors_at_) : code_features_;
      const int first = y * blocks;
      kernel_.dense({texels_.weights, texels_.bias, factors, line, 0, 0, texels_.in, first, first + blocks, 1, 1});
      for (int x = 0; x < size; ++x) {
        for (int c = 0; c < 3; ++c) colours[4 * x + c] = line[3 * x + c];
        colours[4 * x + 3] = 255;
      }
      kernel_.convert(colours, size, request_.format, request_.pixels[v] + y * request_.row_bytes[v]);
    }
  }
}

// d features / d code, a row for each value of the code.
void Plan::RunColumns(int thread) {
  const int latent = architecture_.latent;
  const auto [begin, end] = ShareOf(latent, thread);
  for (int l = begin; l < end; ++l) {
    float* const row = columns_ + static_cast<ptrdiff_t>(l) * features_;
    for (int f = 0; f < features_; ++f) {
      if (code_weight_.empty()) {
        row[f] = f == l ? 1.0f : 0.0f;
      } else {
        row[f] = code_weight_[static_cast<size_t>(f) * latent + l] * (code_features_[f] > 0 ? 1 : code_.slope);
      }
    }
  }
}

void Plan::RunJacobian(int thread) {
  const int latent = architecture_.latent;
  const bool all = jacobian_.vertices == nullptr;
  const int at_once = all ? kVerticesAtOnce : 1;
  const auto [begin, end] = ShareOf((jacobian_.count + at_once - 1) / at_once, thread);
  float* const values = thread_[thread].values;  // [latent][48]
  constexpr int kPitch = kMeshBlocks * kDenseBlock;
  for (int group = begin; group < end; ++group) {
    const int vertex = all ? group * at_once : jacobian_.vertices[group];
    const int first = 3 * vertex / kDenseBlock, last = (3 * (vertex + at_once) - 1) / kDenseBlock + 1;
    kernel_.dense({mesh_.weights, nullptr, columns_, values, features_, kPitch, mesh_.in, first, last, latent, 1});
    const int rows = 3 * std::min(at_once, jacobian_.count - group * at_once);
    float* to = jacobian_.out + static_cast<ptrdiff_t>(3) * group * at_once * latent;
    for (int row = 0; row < rows; ++row) {
      const float* from = values + 3 * vertex + row - first * kDenseBlock;
      for (int l = 0; l < latent; ++l, from += kPitch) *to++ = *from;
    }
  }
}

void Plan::MeasureRanges() {
  LIKENESS_CHECK(kernel_.full_precision);
  for (Thread& thread : thread_) thread.ranges.assign(steps_.size(), 0.0f);
}

std::vector<float> Plan::TakeRanges() {
  std::vector<float> largest(steps_.size(), 0.0f);
  for (Thread& thread : thread_) {
    for (size_t i = 0; i < largest.size(); ++i) largest[i] = std::max(largest[i], thread.ranges[i]);
    thread.ranges.clear();
  }
  return largest;
}

void Plan::NoteRange(int thread, size_t layer, const void* features, int count) {
  std::vector<float>& ranges = thread_[thread].ranges;
  if (ranges.empty()) return;
  const float* const values = static_cast<const float*>(features);
  float largest = ranges[layer];
  for (int i = 0; i < count; ++i) largest = std::max(largest, std::abs(values[i]));
  ranges[layer] = largest;
}

FrameCost Plan::Cost(int views, bool mesh) const {
  FrameCost cost;
  const auto add_dense = [&](const Dense& dense, int times) {
    const double weights = static_cast<double>(dense.blocks) * kDenseBlock * dense.in;
    cost.flops += 2 * weights * times;
    if (times > 0) cost.bytes += weights * kernel_.dense_bytes;
  };
  add_dense(code_, 1);
  add_dense(mesh_, mesh ? 1 : 0);
  add_dense(inner_, views > 0 ? 1 : 0);
  add_dense(inner_view_, views);
  add_dense(texels_, views);
  for (const Step& step : steps_) {
    if (views == 0) break;
    const PackedConvolution& p = step.packed;
    const double weights = static_cast<double>(p.in_rows) * p.depth * (p.colours ? (step.up ? 12 : 3) : p.columns);
    cost.flops += 2 * weights * step.in_size * step.in_size * views;
    cost.bytes += static_cast<double>(kernel_.weight_bytes(p));
    cost.bytes += p.colours ? static_cast<double>(step.pixel_bias_pitch) * step.jobs
                            : static_cast<double>(step.bias_pitch) * step.out_size;
    if (p.colours) cost.bytes += 4.0 * step.out_size * step.out_size * views;
  }
  return cost;
}

}  // namespace likeness
