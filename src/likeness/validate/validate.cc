#include "likeness/validate/validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "likeness/base/error.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/validate/checks.h"
#include "likeness/validate/overlay.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

// The loader's refusal, where no check found its cause.
void TellRefusal(Examination* e) {
  if (e->refusal.empty() || e->report.MustFix()) return;
  e->Found("capture-refused", Severity::kMustFix, e->root.string(), e->refusal, "correct what the message names");
}

// Some frames and cameras with the mesh over them, whether or not something is wrong.
void DrawOverview(const Examination& e, const fs::path& path) {
  constexpr size_t kFrames = 3, kCameras = 6;
  const std::vector<int> frames = e.SampledFrames();
  std::vector<ImageU8> rows;
  for (size_t i = 0; i < std::min(kFrames, frames.size()); ++i) {
    const size_t k = frames.size() <= kFrames ? i : i * (frames.size() - 1) / (kFrames - 1);
    const ExaminedFrame& frame = e.frames[static_cast<size_t>(frames[k])];
    std::vector<Panel> panels;
    for (size_t c = 0; c < e.cameras.size() && panels.size() < kCameras;
         c += std::max<size_t>(1, e.cameras.size() / kCameras)) {
      if (frame.views[c].empty()) continue;
      panels.push_back({DrawMeshOver(frame.views[c], e.Place(frame, c), frame.vertices, e.topology, {90, 225, 230}),
                        fmt::format("{} {} {}", e.cameras[c].name, frame.id.segment, frame.id.frame)});
    }
    if (!panels.empty()) rows.push_back(SideBySide(panels));
  }
  if (!rows.empty()) WritePng(path, Stacked(rows));
}

void DrawFindings(Examination* e) {
  std::map<std::string, int> count;
  for (Finding& finding : e->report.findings) {
    if (!finding.draw) continue;
    const int number = ++count[finding.code];
    if (number > 8) continue;
    const fs::path path =
        e->options.overlay / (number == 1 ? finding.code + ".png" : fmt::format("{}-{}.png", finding.code, number));
    WritePng(path, finding.draw());
    finding.picture = path.string();
  }
  DrawOverview(*e, e->options.overlay / "overview.png");
}

}  // namespace

ValidationReport ValidateCapture(const fs::path& root, const ValidateOptions& options) {
  Examination e(root, options);
  for (const NamedCheck& check : kChecks) check.run(&e);
  TellRefusal(&e);
  e.report.cameras = static_cast<int>(e.cameras.size());
  e.report.frames = static_cast<int>(e.frames.size());
  if (!options.overlay.empty()) DrawFindings(&e);
  // What could be drawn was: the pictures need the examination, which ends here.
  for (Finding& finding : e.report.findings) finding.draw = nullptr;
  std::stable_sort(e.report.findings.begin(), e.report.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.severity < b.severity; });
  return std::move(e.report);
}

}  // namespace likeness
