// What `likeness bench NAME` measures, one file each. Like verbs.

#pragma once

namespace likeness {

int RunBenchUnwrap(int argc, const char* const* argv);

}  // namespace likeness
