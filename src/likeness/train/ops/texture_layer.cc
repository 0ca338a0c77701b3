#include "likeness/train/ops/texture_layer.h"

#include <algorithm>
#include <cstdlib>
#include <memory>

namespace likeness {

namespace {

// Rows of small texels that a thread takes at a time, all samples one after the other: the rows of the bias and its
// gradient then stay in the second cache, and few rows at the seams are read twice.
constexpr int kRowsAtOnce = 8;

int RoundUp(int value, int multiple) { return (value + multiple - 1) / multiple * multiple; }

RowValues Offset(RowValues values, int64_t elements) {
  return {static_cast<const char*>(values.data) + elements * (values.bf16 ? 2 : 4), values.bf16};
}

void* Offset(void* data, bool bf16, int64_t elements) { return static_cast<char*>(data) + elements * (bf16 ? 2 : 4); }

// Buffers of one thread, aligned for vectors and zeroed.
class Buffer {
 public:
  explicit Buffer(int64_t bytes)
      : data_(static_cast<char*>(std::aligned_alloc(64, static_cast<size_t>(bytes + 127) / 64 * 64))) {
    std::fill_n(data_.get(), (bytes + 127) / 64 * 64, 0);
  }
  char* get() const { return data_.get(); }
  float* floats() const { return reinterpret_cast<float*>(data_.get()); }

 private:
  struct Free {
    void operator()(char* data) const { std::free(data); }
  };
  std::unique_ptr<char, Free> data_;
};

// The last few rows of one image, with a texel of zeros at either end. Row r stays until row r + kRows is loaded.
class RowRing {
 public:
  static constexpr int kRows = 4;

  RowRing(const RowKernels& kernels, int width, int channels)
      : kernels_(kernels),
        width_(width),
        channels_(channels),
        padded_(RoundUp(channels, kernels.channel_multiple)),
        row_bytes_(static_cast<int64_t>(RoundUp((width + 2 + 2 * kernels.count_slack + 2) * padded_, 64)) *
                   kernels.element_bytes),
        // A window may reach beyond the last row's end.
        zeros_(row_bytes_),
        rows_(kRows * row_bytes_) {}

  int padded() const { return padded_; }

  // What Load did last; rows outside of the image are zeros.
  const void* Row(int row, int height) const {
    return row < 0 || row >= height ? zeros_.get() : rows_.get() + (row & (kRows - 1)) * row_bytes_;
  }
  // The same without the padding in front.
  const void* Texels(int row, int height) const {
    return static_cast<const char*>(Row(row, height)) + padded_ * kernels_.element_bytes;
  }

  // image  [height, width, channels]
  void Load(RowValues image, int row, int height) {
    if (row < 0 || row >= height) return;
    kernels_.load(Offset(image, At(row)), width_, channels_, padded_, Target(row));
  }
  //   bias_gradient  null where another thread adds this row's; untied: [height, width, channels], else [channels]
  void LoadGradient(RowValues dy, RowValues y, float slope, int row, int height, float* bias_gradient) {
    if (row < 0 || row >= height) return;
    kernels_.load_gradient(Offset(dy, At(row)), Offset(y, At(row)), slope, width_, channels_, padded_, Target(row),
                           bias_gradient);
  }
  int64_t At(int row) const { return static_cast<int64_t>(row) * width_ * channels_; }

 private:
  void* Target(int row) {
    return rows_.get() + (row & (kRows - 1)) * row_bytes_ + static_cast<int64_t>(padded_) * kernels_.element_bytes;
  }

  const RowKernels& kernels_;
  const int width_, channels_, padded_;
  const int64_t row_bytes_;
  const Buffer zeros_;
  const Buffer rows_;
};

// The weights of the two products, and the way back of the gradient's sums.
struct Products {
  explicit Products(const TextureLayer& layer)
      : layer_(layer),
        padded_large(RoundUp(layer.large, layer.kernels.channel_multiple)),
        down_depth(4 * padded_large),
        down_width(layer.small),
        up_depth(2 * layer.small),
        up_width(RoundUp(4 * layer.large, layer.kernels.width_multiple)) {}

  // Calls visit(index in [small, large, 4, 4], s, l, ky, kx).
  template <typename Visit>
  void ForWeights(const Visit& visit) const {
    int64_t i = 0;
    for (int s = 0; s < layer_.small; ++s) {
      for (int l = 0; l < layer_.large; ++l) {
        for (int ky = 0; ky < 4; ++ky) {
          for (int kx = 0; kx < 4; ++kx) visit(i++, s, l, ky, kx);
        }
      }
    }
  }
  int64_t DownIndex(int s, int l, int ky, int kx) const {
    return static_cast<int64_t>(ky * down_depth + kx * padded_large + l) * down_width + s;
  }
  int64_t SumIndex(int s, int l, int ky, int kx) const {
    if (!layer_.kernels.columns_first) return DownIndex(s, l, ky, kx);
    return static_cast<int64_t>(ky * down_width + s) * down_depth + kx * padded_large + l;
  }
  int64_t UpIndex(int s, int l, int ky, int kx) const {
    const int dy = ky < 2 ? 1 : 0, dx = kx < 2 ? 1 : 0, r = ky - 2 + 2 * dy, c = kx - 2 + 2 * dx;
    return static_cast<int64_t>(dy * up_depth + dx * layer_.small + s) * up_width + (r * 2 + c) * layer_.large + l;
  }

  Buffer PackDown(const float* weight) const {
    std::vector<float> plain(static_cast<size_t>(4) * down_depth * down_width);
    ForWeights([&](int64_t i, int s, int l, int ky, int kx) { plain[DownIndex(s, l, ky, kx)] = weight[i]; });
    return Packed(plain, 4, down_depth, down_width);
  }
  Buffer PackUp(const float* weight) const {
    std::vector<float> plain(static_cast<size_t>(2) * up_depth * up_width);
    ForWeights([&](int64_t i, int s, int l, int ky, int kx) { plain[UpIndex(s, l, ky, kx)] = weight[i]; });
    return Packed(plain, 2, up_depth, up_width);
  }

  const TextureLayer& layer_;
  const int padded_large, down_depth, down_width, up_depth, up_width;

 private:
  Buffer Packed(const std::vector<float>& plain, int rows, int depth, int width) const {
    Buffer packed(static_cast<int64_t>(plain.size()) * layer_.kernels.element_bytes);
    layer_.kernels.pack_weights(plain.data(), rows, depth, width, packed.get());
    return packed;
  }
};

// Results of one row before they are stored.
Buffer Results(const RowKernels& kernels, int count, int width) {
  return Buffer(static_cast<int64_t>(count + kernels.count_slack) * width * 4);
}

// Block row `row` of the product Up: large rows 2 row + 1 + r, r = 0 and 1, [2 width + 2, large] each, the first and
// the last texel outside of the image. out has room for one vector more.
void MultiplyUp(const TextureLayer& layer, const Products& products, const RowRing& small, int row, const void* packed,
                float* results, float* const out[2]) {
  const void* const rows[2] = {small.Row(row, layer.height), small.Row(row + 1, layer.height)};
  layer.kernels.multiply(rows, 2, products.up_depth, layer.small, packed, products.up_width, layer.width + 1, results);
  layer.kernels.split(results, products.up_width, 2 * layer.large, layer.width + 1, out[0], out[1]);
}

void MultiplyDown(const TextureLayer& layer, const Products& products, const RowRing& large, int row,
                  const void* packed, float* results) {
  const int height = 2 * layer.height;
  const void* const rows[4] = {large.Row(2 * row - 1, height), large.Row(2 * row, height),
                               large.Row(2 * row + 1, height), large.Row(2 * row + 2, height)};
  layer.kernels.multiply(rows, 4, products.down_depth, 2 * large.padded(), packed, products.down_width, layer.width,
                         results);
}

// Adds one row's part of the weights' gradient.
void CorrelateRow(const TextureLayer& layer, const Products& products, const RowRing& large, const RowRing& small,
                  int row, float* sums, void* scratch) {
  const int height = 2 * layer.height;
  const void* const rows[4] = {large.Row(2 * row - 1, height), large.Row(2 * row, height),
                               large.Row(2 * row + 1, height), large.Row(2 * row + 2, height)};
  layer.kernels.correlate(rows, 4, products.down_depth, 2 * large.padded(), small.Texels(row, layer.height),
                          products.down_width, layer.width, sums, scratch);
}

// Calls body(begin, end, thread) for ranges of a layer's small rows, on all threads: the same ranges every time.
template <typename Body>
void ForRows(int rows, const Body& body) {
  at::parallel_for(0, rows, 1, [&](int64_t begin, int64_t end) {
    body(static_cast<int>(begin), static_cast<int>(end), at::get_thread_num());
  });
}

// The threads' parts of a gradient, added up in their order.
class Partials {
 public:
  Partials(int parts, int64_t count) : count_(count), sums_(parts) {
    for (auto& sum : sums_) sum = std::make_unique<Buffer>(count * 4);
  }
  float* of(int thread) { return sums_[thread]->floats(); }
  float Total(int64_t i) const {
    float total = 0;
    for (const auto& sum : sums_) total += sum->floats()[i];
    return total;
  }
  int64_t count() const { return count_; }

 private:
  int64_t count_;
  std::vector<std::unique_ptr<Buffer>> sums_;
};

// Where the bias's gradient goes while rows are loaded. An untied one has its rows to itself; of a tied one each thread
// keeps a row of sums, texel by texel, that Finish adds up.
class BiasGradient {
 public:
  BiasGradient(float* to, bool untied, int width, int channels)
      : to_(to),
        untied_(untied),
        width_(width),
        channels_(channels),
        rows_(at::get_num_threads(), untied ? 0 : Count()) {}

  // Null for rows outside of [first, last): they are another chunk's.
  float* Row(int row, int first, int last, int sample, int thread) {
    if (row < first || row >= last) return nullptr;
    if (!untied_) return rows_.of(thread);
    float* const at = to_ + row * Count();
    if (sample == 0) std::fill_n(at, Count(), 0.0f);
    return at;
  }
  void Finish() {
    if (untied_) return;
    for (int c = 0; c < channels_; ++c) {
      to_[c] = 0;
      for (int x = 0; x < width_; ++x) to_[c] += rows_.Total(int64_t{1} * x * channels_ + c);
    }
  }

 private:
  int64_t Count() const { return int64_t{1} * width_ * channels_; }

  float* const to_;
  const bool untied_;
  const int width_, channels_;
  Partials rows_;
};

void UnpackWeightGradient(const Products& products, const Partials& sums, float* to) {
  products.ForWeights(
      [&](int64_t i, int s, int l, int ky, int kx) { to[i] = sums.Total(products.SumIndex(s, l, ky, kx)); });
}

}  // namespace

void TextureLayer::Down(RowValues x, const float* weight, const float* bias, bool untied, float slope, void* y,
                        bool bf16) const {
  const Products products(*this);
  const Buffer packed = products.PackDown(weight);
  const int64_t large_image = int64_t{4} * height * width * large, small_row = int64_t{1} * width * small;
  ForRows(height, [&](int begin, int end, int) {
    RowRing rows(kernels, 2 * width, large);
    const Buffer results = Results(kernels, width, products.down_width);
    for (int first = begin; first < end; first += kRowsAtOnce) {
      for (int n = 0; n < samples; ++n) {
        const RowValues image = Offset(x, n * large_image);
        for (int row = 2 * first - 1; row < 2 * first + 1; ++row) rows.Load(image, row, 2 * height);
        for (int row = first; row < std::min(end, first + kRowsAtOnce); ++row) {
          rows.Load(image, 2 * row + 1, 2 * height);
          rows.Load(image, 2 * row + 2, 2 * height);
          MultiplyDown(*this, products, rows, row, packed.get(), results.floats());
          kernels.store(results.floats(), untied ? bias + row * small_row : bias,
                        untied ? static_cast<int>(small_row) : small, slope, static_cast<int>(small_row),
                        Offset(y, bf16, (int64_t{1} * n * height + row) * small_row), bf16);
        }
      }
    }
  });
}

void TextureLayer::Up(RowValues x, const float* weight, const float* bias, bool untied, float slope, void* y,
                      bool bf16) const {
  const Products products(*this);
  const Buffer packed = products.PackUp(weight);
  const int64_t small_image = int64_t{1} * height * width * small, large_row = int64_t{2} * width * large;
  ForRows(height, [&](int begin, int end, int) {
    RowRing rows(kernels, width, small);
    const Buffer results = Results(kernels, width + 1, products.up_width);
    const Buffer above(4 * (large_row + 4 * large + 64)), below(4 * (large_row + 4 * large + 64));
    float* const out[2] = {above.floats(), below.floats()};
    for (int first = begin; first < end; first += kRowsAtOnce) {
      const int last = std::min(end, first + kRowsAtOnce);
      for (int n = 0; n < samples; ++n) {
        const RowValues image = Offset(x, n * small_image);
        rows.Load(image, first, height);
        // Block row -1 holds the image's first row; the last one's second row is outside.
        for (int row = first == 0 ? -1 : first; row < last; ++row) {
          if (row >= 0) rows.Load(image, row + 1, height);
          MultiplyUp(*this, products, rows, row, packed.get(), results.floats(), out);
          for (int r = 0; r < 2; ++r) {
            const int to = 2 * row + 1 + r;
            if (to < 0 || to >= 2 * height) continue;
            kernels.store(out[r] + large, untied ? bias + to * large_row : bias,
                          untied ? static_cast<int>(large_row) : large, slope, static_cast<int>(large_row),
                          Offset(y, bf16, (int64_t{2} * n * height + to) * large_row), bf16);
          }
        }
      }
    }
  });
}

void TextureLayer::DownBackward(RowValues x, RowValues y, RowValues dy, const float* weight, bool untied, float slope,
                                const Gradients& to) const {
  const Products products(*this);
  const Buffer packed = products.PackUp(weight);
  const int64_t large_row = int64_t{2} * width * large, large_image = 2 * height * large_row;
  const int64_t small_image = int64_t{1} * height * width * small;
  Partials sums(at::get_num_threads(), int64_t{4} * products.down_depth * products.down_width);
  BiasGradient bias(to.bias, untied, width, small);
  ForRows(height, [&](int begin, int end, int thread) {
    RowRing large_rows(kernels, 2 * width, large), small_rows(kernels, width, small);
    const Buffer results = Results(kernels, width + 1, products.up_width);
    const Buffer above(4 * (large_row + 4 * large + 64)), below(4 * (large_row + 4 * large + 64));
    float* const out[2] = {above.floats(), below.floats()};
    const Buffer scratch(kernels.scratch_bytes(products.down_depth, products.down_width, width));
    for (int first = begin; first < end; first += kRowsAtOnce) {
      const int last = std::min(end, first + kRowsAtOnce);
      for (int n = 0; n < samples; ++n) {
        const RowValues image = Offset(x, n * large_image), value = Offset(y, n * small_image),
                        gradient = Offset(dy, n * small_image);
        const auto load_small = [&](int row) {
          small_rows.LoadGradient(gradient, value, slope, row, height, bias.Row(row, first, last, n, thread));
        };
        load_small(first);
        for (int row = 2 * first - 1; row < 2 * first + 1; ++row) large_rows.Load(image, row, 2 * height);
        for (int row = first == 0 ? -1 : first; row < last; ++row) {
          if (row >= 0) {
            load_small(row + 1);
            for (int r = 1; r <= 2; ++r) large_rows.Load(image, 2 * row + r, 2 * height);
            CorrelateRow(*this, products, large_rows, small_rows, row, sums.of(thread), scratch.get());
          }
          if (to.x == nullptr) continue;
          MultiplyUp(*this, products, small_rows, row, packed.get(), results.floats(), out);
          for (int r = 0; r < 2; ++r) {
            const int at = 2 * row + 1 + r;
            if (at < 0 || at >= 2 * height) continue;
            kernels.copy(out[r] + large, static_cast<int>(large_row),
                         Offset(to.x, to.x_bf16, n * large_image + at * large_row), to.x_bf16);
          }
        }
      }
    }
  });
  UnpackWeightGradient(products, sums, to.weight);
  bias.Finish();
}

void TextureLayer::UpBackward(RowValues x, RowValues y, RowValues dy, const float* weight, bool untied, float slope,
                              const Gradients& to) const {
  const Products products(*this);
  const Buffer packed = products.PackDown(weight);
  const int64_t large_image = int64_t{4} * height * width * large;
  const int64_t small_row = int64_t{1} * width * small, small_image = height * small_row;
  Partials sums(at::get_num_threads(), int64_t{4} * products.down_depth * products.down_width);
  BiasGradient bias(to.bias, untied, 2 * width, large);
  ForRows(height, [&](int begin, int end, int thread) {
    RowRing large_rows(kernels, 2 * width, large), small_rows(kernels, width, small);
    const Buffer results = Results(kernels, width, products.down_width);
    const Buffer scratch(kernels.scratch_bytes(products.down_depth, products.down_width, width));
    for (int first = begin; first < end; first += kRowsAtOnce) {
      const int last = std::min(end, first + kRowsAtOnce);
      for (int n = 0; n < samples; ++n) {
        const RowValues image = Offset(x, n * small_image), value = Offset(y, n * large_image),
                        gradient = Offset(dy, n * large_image);
        const auto load_large = [&](int row) {
          large_rows.LoadGradient(gradient, value, slope, row, 2 * height,
                                  bias.Row(row, 2 * first, 2 * last, n, thread));
        };
        load_large(2 * first - 1);
        load_large(2 * first);
        for (int row = first; row < last; ++row) {
          load_large(2 * row + 1);
          load_large(2 * row + 2);
          small_rows.Load(image, row, height);
          CorrelateRow(*this, products, large_rows, small_rows, row, sums.of(thread), scratch.get());
          if (to.x == nullptr) continue;
          MultiplyDown(*this, products, large_rows, row, packed.get(), results.floats());
          kernels.copy(results.floats(), static_cast<int>(small_row),
                       Offset(to.x, to.x_bf16, n * small_image + row * small_row), to.x_bf16);
        }
      }
    }
  });
  UnpackWeightGradient(products, sums, to.weight);
  bias.Finish();
}

}  // namespace likeness
