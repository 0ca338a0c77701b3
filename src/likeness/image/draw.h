// Lines, boxes, pictures and words on an RGB picture. Whatever falls outside is cut off.
// Coordinates are pixels from the top left corner; the first pixel's centre is at (0.5, 0.5).

#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "likeness/image/image.h"

namespace likeness {

using Colour = std::array<uint8_t, 3>;  // RGB

struct Point {
  float x = 0;
  float y = 0;
};

// An anti-aliased line, `width` pixels thick; `opacity` 0 ... 1.
void DrawLine(ImageU8* picture, Point from, Point to, Colour colour, float width = 1, float opacity = 1);

void FillRectangle(ImageU8* picture, int x, int y, int width, int height, Colour colour);
// The outline, one pixel wide, just inside the rectangle.
void DrawRectangle(ImageU8* picture, int x, int y, int width, int height, Colour colour);

// Copies an RGB or grey picture with its top left corner to (x, y).
void Blit(ImageU8* picture, const ImageU8& source, int x, int y);

// Words in a small bitmap font, top left corner at (x, y), every dot of it `scale` pixels wide. Printable ASCII and
// line feeds; anything else appears as '?'.
void DrawWords(ImageU8* picture, int x, int y, std::string_view words, Colour colour, int scale = 1);
int WordsWidth(std::string_view words, int scale = 1);
int WordsHeight(std::string_view words, int scale = 1);

// The longest beginning of `words` that fits, with ".." when something is cut off.
std::string ShortenWords(std::string_view words, int width, int scale = 1);

}  // namespace likeness
