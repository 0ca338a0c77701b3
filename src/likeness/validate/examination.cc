#include "likeness/validate/examination.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/image/foreground.h"
#include "likeness/image/image_io.h"
#include "likeness/image/resize.h"

namespace likeness {

namespace fs = std::filesystem;

std::string SomeOf(const std::vector<std::string>& names) {
  constexpr size_t kShown = 4;
  if (names.size() <= kShown + 1) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + kShown, ", "), names.size() - kShown);
}

Examination::Examination(const fs::path& root_path, const ValidateOptions& given)
    : root(root_path), layout(root_path), options(given) {
  std::error_code ignored;
  if (!fs::is_directory(root, ignored)) throw FileError(root, "no such folder");
  report.root = root.string();
  try {
    capture = OpenCapture(root, options.capture);
    report.layout = capture->layout_name();
  } catch (const Error& error) {
    refusal = error.what();
  }
  if (capture != nullptr) {
    multiface = capture->layout_name() == "Multiface";
  } else {
    multiface = Exists(layout.Calibration()) || Exists(layout.FrameList()) || Exists(root / "tracked_mesh");
    if (!multiface) throw Error("{}", refusal);
    report.layout = "Multiface";
  }
}

Finding& Examination::Found(const char* code, Severity severity, const std::string& where, std::string what,
                            std::string advice) {
  Finding finding;
  finding.code = code;
  finding.severity = severity;
  finding.where = where;
  finding.what = std::move(what);
  finding.advice = std::move(advice);
  report.findings.push_back(std::move(finding));
  return report.findings.back();
}

std::string Examination::Relative(const fs::path& path) const {
  const fs::path relative = path.lexically_relative(root);
  return relative.empty() || *relative.begin() == ".." ? path.string() : relative.string();
}

Vertices Examination::ReadVertices(const FrameId& id) const {
  if (!multiface) return capture->ReadTracked(id).vertices_in_head;
  const auto values = ReadFloats(layout.MeshBinary(id), 3 * static_cast<size_t>(topology.vertex_count));
  return Eigen::Map<const Vertices>(values.data(), topology.vertex_count, 3);
}

Camera Examination::SmallCamera(const Camera& camera) const {
  const int longer = std::max(camera.width, camera.height);
  if (longer <= kViewSide) return camera;
  const auto side = [&](int full) { return std::max(8, static_cast<int>(int64_t{full} * kViewSide / longer)); };
  return camera.Resized(side(camera.width), side(camera.height));
}

View Examination::ReadView(const FrameId& id, const Camera& camera) const {
  View view;
  if (camera.width < 8 || camera.height < 8) return view;
  const Camera small = SmallCamera(camera);
  ImageU8 image, mask;
  try {
    if (multiface) {
      if (!Exists(layout.Image(id, camera.name))) return view;
      image = ReadImage(layout.Image(id, camera.name), 3);
    } else {
      if (!capture->HasCameraImage(id, camera)) return view;
      image = capture->ReadCameraImage(id, camera);
    }
    if (image.width() != camera.width || image.height() != camera.height) return view;
  } catch (const Error&) {
    return view;  // the check of files tells
  }
  try {
    if (multiface) {
      if (Exists(layout.HeadMask(id, camera.name))) mask = ReadImage(layout.HeadMask(id, camera.name), 1);
    } else {
      mask = capture->ReadHeadMask(id, camera).value_or(ImageU8());
    }
  } catch (const Error&) {
    mask = ImageU8();
  }
  view.colour = ResizeArea(image, small.width, small.height);
  const std::optional<ImageU8> from_image = FindForeground(view.colour);
  if (!mask.empty() && (mask.width() != camera.width || mask.height() != camera.height)) mask = ImageU8();
  if (!mask.empty()) {
    mask = ResizeArea(mask, small.width, small.height);
    // A mask is believed when it lies on what stands out from the background, as far as that can be told.
    const bool believed = !from_image || Overlap(mask, *from_image).both > 0.8 * Overlap(mask, mask).a;
    const double share = Overlap(mask, mask).a / (static_cast<double>(small.width) * small.height);
    if (believed && share > 0.005 && share < 0.97) view.foreground = mask;
    for (uint8_t& value : view.foreground.values()) value = value >= 128 ? 255 : 0;
  }
  if (view.foreground.empty() && from_image) view.foreground = *from_image;
  view.contrast = LocalContrast(view.colour, view.foreground, std::max(2, kViewSide / 24));
  return view;
}

std::vector<int> Examination::SampledFrames() const {
  std::vector<int> sampled;
  for (size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].sampled()) sampled.push_back(static_cast<int>(i));
  }
  return sampled;
}

Placement Examination::Place(const ExaminedFrame& frame, size_t camera) const {
  return {SmallCamera(cameras[camera]), frame.world_from_head, mesh_from_file};
}

}  // namespace likeness
