#include <limits>

#include "fuzz.h"
#include "likeness/avatar/performance.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  CheckRoundTrip(
      bytes, [](std::string_view text) { return ParsePerformance(kPath, std::string(text)); },
      [](const Performance& performance) {
        performance.Check(kPath);
        const double end = performance.seconds.back();
        for (const double seconds : {-1.0, end / 2, end, std::numeric_limits<double>::max()}) {
          const PerformanceMoment moment = MomentAt(performance, seconds);
          LIKENESS_CHECK(moment.code.size() == static_cast<size_t>(performance.latent));
          LIKENESS_CHECK(RotationDefect(moment.world_from_head.rotation) < 1e-9);
        }
        return PerformanceBytes(performance);
      });
}

}  // namespace likeness
