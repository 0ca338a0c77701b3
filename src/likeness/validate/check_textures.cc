// Stored textures against new ones, unwrapped with what the earlier checks corrected; stored statistics against both.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/image/resize.h"
#include "likeness/texture/texture_set.h"
#include "likeness/texture/texture_sums.h"
#include "likeness/texture/unwrap.h"
#include "likeness/validate/checks.h"
#include "likeness/validate/texture_match.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr size_t kFrames = 2, kCameras = 4;
constexpr double kShift = 0.25;  // of a texel, the least that is told

ImageU8 ReadFullImage(const Examination& e, const FrameId& id, const Camera& camera) {
  return e.multiface ? ReadImage(e.layout.Image(id, camera.name)) : e.capture->ReadCameraImage(id, camera);
}

class TextureCheck {
 public:
  TextureCheck(Examination* e, int size) : e_(*e), size_(size), texels_(MapTexels(e->topology, size)) {}

  void Run() {
    std::vector<int> frames = e_.SampledFrames();
    size_t done = 0;
    for (const int f : frames) {
      if (done == kFrames) break;
      if (CheckFrame(e_.frames[static_cast<size_t>(f)])) ++done;
    }
    Tell();
    if (averages_ > 0) TellAverage();
  }

 private:
  struct Seen {
    std::string file;
    TextureMatch match;
    ImageU8 stored, made;
  };

  bool CheckFrame(const ExaminedFrame& frame) {
    std::vector<size_t> cameras;
    for (size_t c = 0; c < e_.cameras.size(); ++c) {
      if (!frame.views[c].empty() && Exists(e_.layout.Texture(frame.id, e_.cameras[c].name, size_)))
        cameras.push_back(c);
    }
    const fs::path average = e_.layout.AverageTexture(frame.id, size_);
    if (cameras.empty() && !Exists(average)) return false;
    if (cameras.empty()) {
      for (size_t c = 0; c < e_.cameras.size(); ++c) {
        if (!frame.views[c].empty()) cameras.push_back(c);
      }
    }
    UnwrapOptions options;
    options.size = size_;
    const Vertices vertices = frame.vertices * e_.mesh_from_file.cast<float>().transpose();
    const FrameUnwrapper unwrapper(e_.topology, texels_, vertices, options);
    TextureSums sums(size_);
    for (size_t i = 0; i < std::min(kCameras, cameras.size()); ++i) {
      const size_t c = cameras[cameras.size() <= kCameras ? i : i * (cameras.size() - 1) / (kCameras - 1)];
      const UnwrappedView made =
          unwrapper.Unwrap(e_.cameras[c], frame.world_from_head, ReadFullImage(e_, frame.id, e_.cameras[c]), nullptr);
      sums.Add(made);
      const fs::path path = e_.layout.Texture(frame.id, e_.cameras[c].name, size_);
      if (Exists(path)) Compare(path, made.texture, &views_);
    }
    if (Exists(average)) {
      Compare(average, sums.Average(), &averages_list_);
      ++averages_;
    }
    return true;
  }

  void Compare(const fs::path& path, const ImageU8& made, std::vector<Seen>* list) {
    try {
      const ImageU8 stored = ReadImage(path);
      if (stored.width() != size_ || stored.height() != size_) {
        e_.Found("texture-size", Severity::kMustFix, e_.Relative(path),
                 "the texture has another size than its folder says",
                 fmt::format("unwrap again: likeness unwrap {} --size {} --redo", e_.root.string(), size_))
            .evidence = fmt::format("{} x {}", stored.width(), stored.height());
        return;
      }
      list->push_back({e_.Relative(path), MatchTextures(stored, made), stored, made});
    } catch (const Error& error) {
      e_.Found("texture-unreadable", Severity::kMustFix, e_.Relative(path), error.what(),
               fmt::format("unwrap again: likeness unwrap {} --size {} --redo", e_.root.string(), size_));
    }
  }

  std::string Redo() const {
    return fmt::format("unwrap again: likeness unwrap {} --size {} --redo", e_.root.string(), size_);
  }

  void Add(const char* code, Severity severity, const Seen& seen, const std::string& what, const std::string& evidence,
           double confidence) {
    Finding& finding = e_.Found(code, severity, seen.file, what, Redo());
    finding.evidence = evidence;
    finding.confidence = confidence;
    e_.textures_fit = false;
    finding.draw = [stored = seen.stored, made = seen.made] {
      return SideBySide({{FitInto(stored, 512, 512), "stored"}, {FitInto(made, 512, 512), "unwrapped now"}});
    };
  }

  static double Median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  }

  void Tell() {
    std::erase_if(views_, [](const Seen& seen) { return seen.match.texels < 400; });
    if (views_.empty()) return;
    const auto share = [&](const auto& is) {
      return static_cast<double>(std::count_if(views_.begin(), views_.end(), is)) / static_cast<double>(views_.size());
    };
    for (const TextureFlip flip : {TextureFlip::kVertical, TextureFlip::kHorizontal, TextureFlip::kBoth}) {
      const auto is = [&](const Seen& seen) { return seen.match.flip == flip && seen.match.correlation > 0.4; };
      if (share(is) < 0.5) continue;
      const Seen& seen = *std::find_if(views_.begin(), views_.end(), is);
      Add("texture-flipped", Severity::kMustFix, seen, fmt::format("textures are flipped {}", ToString(flip)),
          fmt::format(
              "correlation with what the cameras show {:.2f} as stored, {:.2f} flipped back, in {:.0f}% of {} textures",
              seen.match.correlation_as_stored, seen.match.correlation, 100 * share(is), views_.size()),
          0.5 + 0.5 * share(is));
      views_flipped_ = true;
    }
    if (const double swapped = share([](const Seen& seen) { return seen.match.swapped; }); swapped > 0.5) {
      Add("texture-colours-swapped", Severity::kMustFix, views_.front(), "red and blue are exchanged (BGR) in textures",
          fmt::format("in {:.0f}% of {} textures", 100 * swapped, views_.size()), swapped);
    }
    std::vector<double> right, down, correlation;
    for (const Seen& seen : views_) {
      correlation.push_back(seen.match.correlation);
      if (seen.match.correlation < 0.4) continue;
      right.push_back(seen.match.right), down.push_back(seen.match.down);
    }
    if (Median(correlation) < 0.4) {
      Add("texture-mismatch", Severity::kMustFix, views_.front(),
          "textures do not show what the cameras show: they were made from other images, meshes or calibration",
          fmt::format("median correlation {:.2f} over {} textures", Median(correlation), views_.size()), 0.85);
      return;
    }
    const double x = Median(right), y = Median(down);
    if (std::max(std::abs(x), std::abs(y)) < kShift) return;
    const bool half = std::abs(std::abs(x) - 0.5) < 0.2 || std::abs(std::abs(y) - 0.5) < 0.2;
    Add("texture-shifted", Severity::kMustFix, views_.front(),
        half ? "textures are shifted by half a texel: their maker took texel corners for centres"
             : "textures are shifted",
        fmt::format("{:.2f} texels to the right, {:.2f} down, median of {} textures", x, y, right.size()), 0.9);
  }

  void TellAverage() {
    for (const Seen& seen : averages_list_) {
      if (seen.match.texels < 400) continue;
      if (seen.match.flip != TextureFlip::kNone && seen.match.correlation > 0.4) {
        if (!views_flipped_) {
          Add("average-flipped", Severity::kMustFix, seen,
              fmt::format("average textures are flipped {}", ToString(seen.match.flip)),
              fmt::format("correlation {:.2f} as stored, {:.2f} flipped back", seen.match.correlation_as_stored,
                          seen.match.correlation),
              0.9);
        }
        return;
      }
      if (seen.match.correlation < 0.3) {
        Add("average-mismatch", Severity::kMustFix, seen, "the average texture does not show what the cameras show",
            fmt::format("correlation {:.2f}", seen.match.correlation), 0.8);
        return;
      }
    }
  }

  Examination& e_;
  const int size_;
  const TexelMap texels_;
  std::vector<Seen> views_, averages_list_;
  int averages_ = 0;
  bool views_flipped_ = false;
};

// One number in a file, or none with a finding.
std::optional<double> ReadNumber(Examination* e, const fs::path& path) {
  try {
    const std::string text = ReadFile(path, 1 << 12);
    TextLines lines(path, text);
    if (lines.Next()) {
      const double value = lines.Numbers(1)[0];
      if (value > 0) return value;
    }
    throw FileError(path, "expected one positive number");
  } catch (const Error& error) {
    e->Found("statistics-unreadable", Severity::kMustFix, e->Relative(path), error.what(),
             "make the statistics anew: likeness unwrap");
    return std::nullopt;
  }
}

// Statistics are of training segments and cameras alone: the others show what these may never have.
bool IsTrainingSegment(const Examination& e, const std::string& segment) {
  return !e.capture || !e.capture->split().IsHeldOutSegment(segment);
}
bool IsTrainingCamera(const Examination& e, const std::string& camera) {
  if (!e.capture) return true;
  const std::vector<std::string>& training = e.capture->split().training_cameras;
  return std::find(training.begin(), training.end(), camera) != training.end();
}

// A stored variance against one that was measured; standard deviations are told apart from it.
void CompareVariance(Examination* e, const fs::path& path, double measured, const char* of) {
  const std::optional<double> stored = ReadNumber(e, path);
  if (!stored || !(measured > 0)) return;
  const double ratio = std::log(*stored / measured), as_deviation = std::log(*stored / std::sqrt(measured));
  if (std::abs(ratio) < std::log(4.0)) return;
  const std::string evidence =
      fmt::format("the file says {:.4g}, the variance measured is about {:.4g}", *stored, measured);
  if (std::abs(as_deviation) < std::log(1.6)) {
    Finding& finding = e->Found("variance-is-deviation", Severity::kMustFix, e->Relative(path),
                                fmt::format("the variance of {} is a standard deviation", of), "write its square");
    finding.evidence = evidence;
    finding.confidence = 0.9;
  } else if (std::abs(ratio) > std::log(8.0)) {
    Finding& finding = e->Found("statistics-mismatch", Severity::kWarning, e->Relative(path),
                                fmt::format("the variance of {} is not that of this capture", of),
                                "make the statistics anew: likeness unwrap");
    finding.evidence = evidence;
    finding.confidence = 0.7;
  }
}

void CheckTextureStatistics(Examination* e, const CaptureLayout& where, int size) {
  if (!Exists(where.TextureMean())) return;
  ImageU8 mean;
  try {
    mean = ReadImage(where.TextureMean());
  } catch (const Error& error) {
    e->Found("statistics-unreadable", Severity::kMustFix, e->Relative(where.TextureMean()), error.what(),
             "make the statistics anew: likeness unwrap");
    return;
  }
  if (mean.width() != mean.height()) {
    e->Found("statistics-mismatch", Severity::kWarning, e->Relative(where.TextureMean()),
             "the mean texture is not square", "make the statistics anew: likeness unwrap");
    return;
  }
  if (mean.width() != size) return;  // of another size of textures
  double squares = 0, count = 0;
  TextureSums sums(size);
  for (const int f : e->SampledFrames()) {
    const ExaminedFrame& frame = e->frames[static_cast<size_t>(f)];
    if (sums.views() >= 12) break;
    if (!IsTrainingSegment(*e, frame.id.segment)) continue;
    for (size_t c = 0; c < e->cameras.size() && sums.views() < 12; c += std::max<size_t>(1, e->cameras.size() / 4)) {
      const fs::path path = e->layout.Texture(frame.id, e->cameras[c].name, size);
      if (!IsTrainingCamera(*e, e->cameras[c].name) || !Exists(path)) continue;
      try {
        UnwrappedView view = {ReadImage(path), ImageU8(size, size, 1)};
        if (!view.texture.SameShape(mean)) continue;
        for (size_t i = 0; i < view.mask.values().size(); ++i) {
          const uint8_t* t = &view.texture.values()[3 * i];
          if ((t[0] | t[1] | t[2]) == 0) continue;
          view.mask.values()[i] = 255;
          for (size_t k = 0; k < 3; ++k) {
            const double difference = double{1} * t[k] - mean.values()[3 * i + k];
            squares += difference * difference, count += 1;
          }
        }
        sums.Add(view);
      } catch (const Error&) {
        continue;  // the check of textures tells
      }
    }
  }
  if (count == 0) return;
  const TextureMatch match = MatchTextures(mean, sums.Average());
  if (match.texels > 400 && match.flip != TextureFlip::kNone && match.correlation > 0.4) {
    Finding& finding =
        e->Found("mean-flipped", Severity::kMustFix, e->Relative(where.TextureMean()),
                 fmt::format("the mean texture is flipped {} against the textures", ToString(match.flip)),
                 "flip it back, or make the statistics anew: likeness unwrap");
    finding.evidence = fmt::format("correlation {:.2f} as stored, {:.2f} flipped back", match.correlation_as_stored,
                                   match.correlation);
    finding.confidence = 0.95;
    finding.draw = [mean, average = sums.Average()] {
      return SideBySide(
          {{FitInto(mean, 512, 512), "tex_mean.png"}, {FitInto(average, 512, 512), "mean of some textures"}});
    };
    return;
  }
  CompareVariance(e, where.TextureVariance(), squares / count, "textures");
}

void CheckVertexStatistics(Examination* e, const CaptureLayout& where) {
  if (!Exists(where.VertexMean())) return;
  std::vector<float> mean;
  try {
    mean = ReadFloats(where.VertexMean(), 3 * static_cast<size_t>(e->topology.vertex_count));
  } catch (const Error& error) {
    e->Found("statistics-unreadable", Severity::kMustFix, e->Relative(where.VertexMean()), error.what(),
             "make the statistics anew: likeness unwrap");
    return;
  }
  const Vertices mean_vertices = Eigen::Map<const Vertices>(mean.data(), e->topology.vertex_count, 3);
  double squares = 0, count = 0;
  for (const int f : e->SampledFrames()) {
    if (!IsTrainingSegment(*e, e->frames[static_cast<size_t>(f)].id.segment)) continue;
    const Vertices difference = e->frames[static_cast<size_t>(f)].vertices - mean_vertices;
    squares += difference.cast<double>().squaredNorm();
    count += static_cast<double>(difference.size());
  }
  if (count == 0) return;
  const Vertices& first = e->frames[static_cast<size_t>(e->SampledFrames().front())].vertices;
  const double size = (first.colwise().maxCoeff() - first.colwise().minCoeff()).norm();
  if (std::sqrt(squares / count) > 0.08 * size) {
    Finding& finding =
        e->Found("statistics-mismatch", Severity::kWarning, e->Relative(where.VertexMean()),
                 "the mean mesh is not that of this capture", "make the statistics anew: likeness unwrap");
    finding.evidence = fmt::format("it is {:.3g} away from the meshes on average, which measure {:.3g}",
                                   std::sqrt(squares / count), size);
    finding.confidence = 0.9;
    return;
  }
  CompareVariance(e, where.VertexVariance(), squares / count, "vertices");
}

}  // namespace

void CheckTextures(Examination* e) {
  if (!e->placed) return;
  for (const int size : TextureSizes(e->root)) {
    if (size >= 16 && size <= 4096) TextureCheck(e, size).Run();
  }
}

void CheckStatistics(Examination* e) {
  if (e->SampledFrames().empty() || !e->textures_fit) return;
  CheckVertexStatistics(e, e->layout);
  // The root's are those of one of the sizes, which may have its own as well.
  for (const int size : TextureSizes(e->root)) {
    const CaptureLayout own(e->layout.TextureFolder(size));
    CheckTextureStatistics(e, e->layout, size);
    CheckTextureStatistics(e, own, size);
    CheckVertexStatistics(e, own);
  }
}

}  // namespace likeness
