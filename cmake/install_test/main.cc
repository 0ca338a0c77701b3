// Opens the capture that is named on the command line and prints how many cameras and frames it has.

#include <cstdio>

#include "likeness/base/error.h"
#include "likeness/capture/capture.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    const auto capture = likeness::OpenCapture(argv[1]);
    std::printf("%zu cameras, %zu frames\n", capture->cameras().size(), capture->frames().size());
    return 0;
  } catch (const likeness::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
