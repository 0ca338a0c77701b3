// Files that a model names beside itself.

#pragma once

#include <functional>
#include <string>

namespace likeness {

// Gives the content of a file by a path relative to the model's folder, which it does not leave. May throw Error.
using ReadBeside = std::function<std::string(const std::string& relative_path)>;

}  // namespace likeness
