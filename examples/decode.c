/* Decodes an avatar's mean face from the front with the installed library, and writes its texture as a PPM picture.
 *
 *   cc decode.c $(pkg-config --cflags --libs likeness) -o decode
 *   ./decode avatar.safetensors texture.ppm */

#include <likeness.h>
#include <stdio.h>
#include <stdlib.h>

static int Failed(const char* what) {
  fprintf(stderr, "%s: %s\n", what, likeness_last_error());
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: decode AVATAR TEXTURE.ppm\n");
    return 2;
  }
  likeness_decoder* decoder = NULL;
  if (likeness_open(argv[1], NULL, &decoder) != LIKENESS_OK) return Failed("cannot open the avatar");
  likeness_info info = {0};
  info.size = sizeof(info);
  likeness_get_info(decoder, &info);

  const size_t texels = (size_t)info.texture_size * (size_t)info.texture_size;
  unsigned char* const pixels = malloc(texels * 4);
  float* const vertices = malloc((size_t)info.vertex_count * 3 * sizeof(float));
  if (pixels == NULL || vertices == NULL) return 1;
  const likeness_view view = {{0, 0, 1}, pixels, (int64_t)info.texture_size * 4};
  const likeness_mesh mesh = {vertices, 3 * sizeof(float)};
  if (likeness_decode(decoder, info.mean_code, &view, 1, &mesh, LIKENESS_RGBA8) != LIKENESS_OK) {
    return Failed("cannot decode");
  }

  FILE* const file = fopen(argv[2], "wb");
  if (file == NULL) {
    perror(argv[2]);
    return 1;
  }
  fprintf(file, "P6\n%d %d\n255\n", info.texture_size, info.texture_size);
  for (size_t i = 0; i < texels; ++i) fwrite(pixels + 4 * i, 1, 3, file);
  if (fclose(file) != 0) {
    perror(argv[2]);
    return 1;
  }
  printf("kernel %s; first vertex %.2f %.2f %.2f mm\n", info.kernel, vertices[0], vertices[1], vertices[2]);
  free(vertices);
  free(pixels);
  likeness_close(decoder);
  return 0;
}
