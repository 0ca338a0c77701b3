#include "likeness/validate/finding.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace likeness {

std::string ToString(Severity severity) {
  switch (severity) {
    case Severity::kMustFix:
      return "must fix";
    case Severity::kWarning:
      return "warning";
    case Severity::kNote:
      return "note";
  }
  return "";
}

bool ValidationReport::MustFix() const {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& finding) { return finding.severity == Severity::kMustFix; });
}

const Finding* ValidationReport::Find(const std::string& code) const {
  const auto found =
      std::find_if(findings.begin(), findings.end(), [&](const Finding& finding) { return finding.code == code; });
  return found == findings.end() ? nullptr : &*found;
}

std::string ToText(const ValidationReport& report) {
  std::string text = fmt::format("{}: {}, {} cameras, {} frames; {} images looked at\n", report.root,
                                 report.layout.empty() ? "no known layout" : report.layout + " layout", report.cameras,
                                 report.frames, report.views);
  if (report.overlap > 0) {
    text += fmt::format("the mesh and the images' foreground overlap by {:.0f}%", 100 * report.overlap);
    if (report.agreement != 0)
      text += fmt::format("; cameras agree on the surface's detail to {:.2f}", report.agreement);
    text += "\n";
  }
  for (const Finding& finding : report.findings) {
    text += fmt::format("\n{}: {} [{}]\n  {}\n", ToString(finding.severity), finding.where, finding.code, finding.what);
    if (!finding.evidence.empty()) {
      text += fmt::format("  evidence  {} (confidence {:.0f}%)\n", finding.evidence, 100 * finding.confidence);
    }
    if (!finding.advice.empty()) text += fmt::format("  to do     {}\n", finding.advice);
    if (!finding.picture.empty()) text += fmt::format("  picture   {}\n", finding.picture);
  }
  if (report.findings.empty()) text += "\nnothing is wrong with what was looked at\n";
  return text;
}

std::string ToJson(const ValidationReport& report) {
  nlohmann::ordered_json json = {{"root", report.root},           {"layout", report.layout},
                                 {"cameras", report.cameras},     {"frames", report.frames},
                                 {"views", report.views},         {"overlap", report.overlap},
                                 {"agreement", report.agreement}, {"must_fix", report.MustFix()}};
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& finding : report.findings) {
    nlohmann::ordered_json entry = {{"code", finding.code},         {"severity", ToString(finding.severity)},
                                    {"where", finding.where},       {"what", finding.what},
                                    {"evidence", finding.evidence}, {"confidence", finding.confidence},
                                    {"advice", finding.advice}};
    if (!finding.picture.empty()) entry["picture"] = finding.picture;
    json["findings"].push_back(std::move(entry));
  }
  return json.dump(2);
}

}  // namespace likeness
