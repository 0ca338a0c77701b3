// make_random_avatar FILE: a small avatar of random weights, for tests of installed programs.

#include <cstdio>

#include "likeness/decode/random_avatar.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  likeness::Architecture a;
  a.texture_size = 64;
  a.vertex_count = 30;
  a.latent = 8;
  likeness::SaveAvatar(argv[1], likeness::RandomAvatar(a, 1));
  return 0;
}
