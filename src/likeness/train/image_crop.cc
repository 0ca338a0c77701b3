#include "likeness/train/image_crop.h"

#include <algorithm>
#include <optional>
#include <span>

#include "likeness/base/random.h"
#include "likeness/image/foreground.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

ImageU8 Coverage(const Capture& capture, const Camera& camera, const TrackedFrame& tracked) {
  const FragmentImage fragments =
      Rasterize(tracked.vertices_in_head, capture.topology().triangles, camera, tracked.world_from_head);
  ImageU8 coverage(camera.width, camera.height, 1);
  for (size_t i = 0; i < fragments.fragments.size(); ++i) {
    coverage.values()[i] = fragments.fragments[i].triangle >= 0 ? 255 : 0;
  }
  return coverage;
}

// Where a crop of `length` begins that has `middle` in its middle if the image allows it.
int Begin(int middle, int length, int image_length) {
  if (length >= image_length) return (image_length - length) / 2;
  return std::clamp(middle - length / 2, 0, image_length - length);
}

}  // namespace

HeadImage ReadHeadImage(const Capture& capture, const FrameId& frame, const Camera& camera,
                        const TrackedFrame& tracked) {
  HeadImage image;
  image.colour = capture.ReadCameraImage(frame, camera);
  if (std::optional<ImageU8> mask = capture.ReadHeadMask(frame, camera)) {
    image.head = std::move(*mask);
    for (uint8_t& value : image.head.values()) value = value >= 128 ? 255 : 0;
  } else {
    image.head = Coverage(capture, camera, tracked);
    if (const std::optional<ImageU8> foreground = FindForeground(image.colour)) {
      for (size_t i = 0; i < image.head.values().size(); ++i) image.head.values()[i] &= foreground->values()[i];
    }
  }
  if (const std::optional<ImageU8> valid = capture.ReadValidMask(camera)) {
    for (size_t i = 0; i < image.head.values().size(); ++i) image.head.values()[i] &= valid->values()[i];
  }
  return image;
}

ImageCrop CropAtRandom(const HeadImage& image, int width, int height, uint64_t seed) {
  const int image_width = image.head.width(), image_height = image.head.height();
  const std::span<const uint8_t> head = image.head.values();
  int x = image_width / 2, y = image_height / 2;
  if (const auto count = std::count_if(head.begin(), head.end(), [](uint8_t value) { return value != 0; }); count > 0) {
    int64_t left = Random(seed).Below(count);
    size_t i = 0;
    while (head[i] == 0 || left-- > 0) ++i;
    x = static_cast<int>(i % static_cast<size_t>(image_width));
    y = static_cast<int>(i / static_cast<size_t>(image_width));
  }
  ImageCrop crop;
  crop.x0 = Begin(x, width, image_width);
  crop.y0 = Begin(y, height, image_height);
  crop.pixels = {ImageU8(width, height, 3), ImageU8(width, height, 1)};
  const int first = std::max(0, -crop.x0), last = std::min(width, image_width - crop.x0);
  for (int row = std::max(0, -crop.y0); row < std::min(height, image_height - crop.y0); ++row) {
    std::copy_n(image.colour.at(crop.x0 + first, crop.y0 + row), 3 * (last - first), crop.pixels.colour.at(first, row));
    std::copy_n(image.head.at(crop.x0 + first, crop.y0 + row), last - first, crop.pixels.head.at(first, row));
  }
  return crop;
}

}  // namespace likeness
