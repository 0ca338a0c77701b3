// How a stored texture lies on the one that the capture gives: flipped, shifted, with red and blue exchanged.

#pragma once

#include <string>

#include "likeness/image/image.h"

namespace likeness {

enum class TextureFlip { kNone, kVertical, kHorizontal, kBoth };
std::string ToString(TextureFlip flip);  // "top to bottom", ...
ImageU8 Flipped(const ImageU8& image, TextureFlip flip);

struct TextureMatch {
  TextureFlip flip = TextureFlip::kNone;  // of the stored one
  bool swapped = false;                   // red and blue
  // Texels by which the stored one is displaced to the right and down, once it is flipped back.
  double right = 0, down = 0;
  double correlation = 0;  // of the luma's detail at its best; 1 for the same picture
  double correlation_as_stored = 0;
  int texels = 0;  // that both show
};

// RGB textures of the same size, 0 where a texel is not seen. Displacements of up to two texels are found.
TextureMatch MatchTextures(const ImageU8& stored, const ImageU8& made);

}  // namespace likeness
