#include "likeness/image/draw.h"

#include <stb/stb_easy_font.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {
namespace {

void Blend(uint8_t* pixel, Colour colour, float opacity) {
  for (int c = 0; c < 3; ++c) {
    pixel[c] = static_cast<uint8_t>(std::lround(
        static_cast<float>(pixel[c]) + opacity * (static_cast<float>(colour[c]) - static_cast<float>(pixel[c]))));
  }
}

// The font indexes its table by character code without a look.
std::string Printable(std::string_view words) {
  std::string printable;
  for (const char c : words) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xc0) == 0x80) continue;  // later bytes of one UTF-8 character
    printable += (byte >= 32 && byte < 127) || c == '\n' ? c : '?';
  }
  return printable;
}

}  // namespace

void DrawLine(ImageU8* picture, Point from, Point to, Colour colour, float width, float opacity) {
  LIKENESS_CHECK(picture->channels() == 3);
  const float dx = to.x - from.x, dy = to.y - from.y, length_squared = dx * dx + dy * dy;
  if (!std::isfinite(length_squared)) return;
  const float reach = width / 2 + 0.5f;
  const auto first = [&](float a, float b) {
    return static_cast<int>(std::max(0.0f, std::floor(std::min(a, b) - reach)));
  };
  const auto last = [&](float a, float b, int size) {
    return static_cast<int>(std::min(size - 1.0f, std::ceil(std::max(a, b) + reach)));
  };
  for (int y = first(from.y, to.y); y <= last(from.y, to.y, picture->height()); ++y) {
    for (int x = first(from.x, to.x); x <= last(from.x, to.x, picture->width()); ++x) {
      const float px = x + 0.5f - from.x, py = y + 0.5f - from.y;
      const float along = length_squared > 0 ? std::clamp((px * dx + py * dy) / length_squared, 0.0f, 1.0f) : 0;
      const float distance = std::hypot(px - along * dx, py - along * dy);
      const float covered = std::clamp(reach - distance, 0.0f, std::min(1.0f, width));
      if (covered > 0) Blend(picture->at(x, y), colour, covered * opacity);
    }
  }
}

void FillRectangle(ImageU8* picture, int x, int y, int width, int height, Colour colour) {
  LIKENESS_CHECK(picture->channels() == 3);
  for (int py = std::max(0, y); py < std::min(picture->height(), y + height); ++py) {
    for (int px = std::max(0, x); px < std::min(picture->width(), x + width); ++px) {
      std::copy(colour.begin(), colour.end(), picture->at(px, py));
    }
  }
}

void DrawRectangle(ImageU8* picture, int x, int y, int width, int height, Colour colour) {
  FillRectangle(picture, x, y, width, 1, colour);
  FillRectangle(picture, x, y + height - 1, width, 1, colour);
  FillRectangle(picture, x, y, 1, height, colour);
  FillRectangle(picture, x + width - 1, y, 1, height, colour);
}

void Blit(ImageU8* picture, const ImageU8& source, int x, int y) {
  LIKENESS_CHECK(picture->channels() == 3 && (source.empty() || source.channels() == 3 || source.channels() == 1));
  const int grey = source.channels() == 1 ? 0 : 1;
  for (int sy = std::max(0, -y); sy < std::min(source.height(), picture->height() - y); ++sy) {
    for (int sx = std::max(0, -x); sx < std::min(source.width(), picture->width() - x); ++sx) {
      for (int c = 0; c < 3; ++c) picture->at(x + sx, y + sy)[c] = source.at(sx, sy)[c * grey];
    }
  }
}

void DrawWords(ImageU8* picture, int x, int y, std::string_view words, Colour colour, int scale) {
  struct FontVertex {
    float x, y, z;
    unsigned char colour[4];
  };
  std::string text = Printable(words);
  std::vector<FontVertex> vertices(text.size() * 100 + 4);  // no character has more than 25 quads
  const int quads = stb_easy_font_print(0, 0, text.data(), nullptr, vertices.data(),
                                        static_cast<int>(vertices.size() * sizeof(FontVertex)));
  for (int i = 0; i < quads; ++i) {
    const FontVertex& low = vertices[4 * i];
    const FontVertex& high = vertices[4 * i + 2];
    const auto at = [&](float value) { return static_cast<int>(std::lround(value * static_cast<float>(scale))); };
    FillRectangle(picture, x + at(low.x), y + at(low.y), at(high.x) - at(low.x), at(high.y) - at(low.y), colour);
  }
}

int WordsWidth(std::string_view words, int scale) {
  std::string text = Printable(words);
  return stb_easy_font_width(text.data()) * scale;
}

int WordsHeight(std::string_view words, int scale) {
  std::string text = Printable(words);
  return stb_easy_font_height(text.data()) * scale;
}

std::string ShortenWords(std::string_view words, int width, int scale) {
  if (WordsWidth(words, scale) <= width) return std::string(words);
  std::string cut(words);
  while (!cut.empty() && WordsWidth(cut + "..", scale) > width) cut.pop_back();
  return cut + "..";
}

}  // namespace likeness
