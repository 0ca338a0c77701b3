#include "likeness/train/loss_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace likeness {
namespace {

constexpr double kWidth = 760, kHeight = 320;
constexpr double kLeft = 64, kRight = 120, kTop = 14, kBottom = 40;
constexpr size_t kPoints = 240;

struct Axes {
  double x_low, x_high;  // iterations
  double y_low, y_high;  // log10 of the loss

  double X(double iteration) const {
    return kLeft + (iteration - x_low) / (x_high - x_low) * (kWidth - kLeft - kRight);
  }
  double Y(double value) const {
    return kTop + (y_high - std::log10(value)) / (y_high - y_low) * (kHeight - kTop - kBottom);
  }
};

// 1, 2 or 5 times a power of ten, so that about five steps fill the range.
double RoundStep(double range) {
  const double raw = range / 5, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

std::string Grid(const Axes& axes) {
  std::string svg;
  const bool few_decades = axes.y_high - axes.y_low < 2.5;
  for (int decade = static_cast<int>(std::floor(axes.y_low)); decade <= std::ceil(axes.y_high); ++decade) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10, decade), at = std::log10(value);
      if (at < axes.y_low - 1e-9 || at > axes.y_high + 1e-9 || (factor != 1 && !few_decades)) continue;
      const double y = axes.Y(value);
      svg += fmt::format("<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>", kLeft,
                         kWidth - kRight, y, y);
      svg += fmt::format("<text class=\"tick\" x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:g}</text>", kLeft - 8, y + 4,
                         value);
    }
  }
  const double step = RoundStep(axes.x_high - axes.x_low);
  for (double x = std::ceil(axes.x_low / step) * step; x <= axes.x_high; x += step) {
    svg += fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:g}</text>", axes.X(x),
                       kHeight - kBottom + 18, x);
  }
  svg += fmt::format("<text class=\"tick\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">iterations</text>",
                     (kLeft + kWidth - kRight) / 2, kHeight - 4);
  return svg;
}

}  // namespace

std::vector<double> Thinned(const std::vector<double>& values, size_t most) {
  if (values.size() <= most) return values;
  std::vector<double> thinned;
  for (size_t i = 0; i < most; ++i) {
    const size_t begin = i * values.size() / most, end = (i + 1) * values.size() / most;
    double sum = 0;
    for (size_t k = begin; k < end; ++k) sum += values[k];
    thinned.push_back(sum / static_cast<double>(end - begin));
  }
  return thinned;
}

std::string LossChart(const LossLog& log) {
  if (log.iteration.size() < 2) return "";
  struct Line {
    const char* label;
    std::vector<double> values;
    double label_y = 0;
  };
  std::vector<Line> lines = {{"total", Thinned(log.loss, kPoints)},
                             {"texture", Thinned(log.texture, kPoints)},
                             {"geometry", Thinned(log.geometry, kPoints)},
                             {"KL", Thinned(log.kl, kPoints)},
                             {"image", Thinned(log.image, kPoints)}};
  const std::vector<double> iterations = Thinned(log.iteration, kPoints);
  double low = std::numeric_limits<double>::max(), high = 0;
  for (const Line& line : lines) {
    for (const double value : line.values) {
      if (value <= 0) continue;  // a logarithmic scale has no place for it
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  if (high <= 0 || iterations.back() <= iterations.front()) return "";
  // Half a decade at least, and a little air.
  double y_low = std::log10(low) - 0.05, y_high = std::log10(high) + 0.05;
  if (y_high - y_low < 0.5) y_low -= 0.25, y_high += 0.25;
  const Axes axes = {iterations.front(), iterations.back(), y_low, y_high};

  std::string svg = fmt::format(
      "<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Training loss over iterations\">", kWidth,
      kHeight);
  svg += Grid(axes);
  for (size_t i = 0; i < lines.size(); ++i) {
    std::string path;
    for (size_t k = 0; k < iterations.size(); ++k) {
      if (lines[i].values[k] <= 0) continue;
      path +=
          fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", axes.X(iterations[k]), axes.Y(lines[i].values[k]));
      lines[i].label_y = axes.Y(lines[i].values[k]);
    }
    if (!path.empty()) svg += fmt::format("<path class=\"line-{}\" d=\"{}\"/>", i, path);
  }
  // Labels at the ends of the lines, moved down where they would touch.
  std::vector<size_t> order;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].label_y > 0) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return lines[a].label_y < lines[b].label_y; });
  double free_y = 0;
  for (const size_t i : order) {
    const double y = std::max(lines[i].label_y, free_y);
    free_y = y + 16;
    svg += fmt::format("<text class=\"label line-{}\" x=\"{}\" y=\"{:.1f}\">{} {:.3g}</text>", i, kWidth - kRight + 8,
                       y + 4, lines[i].label, lines[i].values.back());
  }
  return svg + "</svg>";
}

}  // namespace likeness
