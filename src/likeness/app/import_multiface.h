// likeness import multiface CHECKPOINT OUT

#pragma once

namespace likeness {

int RunImportMultiface(int argc, const char* const* argv);

}  // namespace likeness
