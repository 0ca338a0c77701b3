// LibTorch's headers, compiled once for the whole folder: each costs ten seconds and more in every file otherwise.

#pragma once

#include <torch/csrc/autograd/custom_function.h>
#include <torch/types.h>
