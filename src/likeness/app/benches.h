// What `likeness bench NAME` measures, one file each. Like verbs.

#pragma once

namespace likeness {

int RunBenchSimulate(int argc, const char* const* argv);
int RunBenchUnwrap(int argc, const char* const* argv);

}  // namespace likeness
