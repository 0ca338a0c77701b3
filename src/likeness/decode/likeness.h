/* The Likeness run-time decoder for C: opens an avatar file, and decodes textures and mesh for a code and one or two
 * views. Nothing here throws, prints, or ends the program.
 *
 *   likeness_decoder* decoder = NULL;
 *   if (likeness_open("avatar.safetensors", NULL, &decoder) != LIKENESS_OK) puts(likeness_last_error());
 *   ...
 *   likeness_decode(decoder, code, &view, 1, &mesh, LIKENESS_RGBA8);
 *   likeness_close(decoder);
 *
 * A decoder is used by one thread at a time; several decoders live side by side. Link with -llikeness, or ask
 * pkg-config for `likeness`. docs/run-time-library.md tells more. */

#ifndef LIKENESS_H_
#define LIKENESS_H_

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LIKENESS_API __attribute__((visibility("default")))

/* Grows with each change that existing programs cannot live with; likeness_api_version() is the library's. Structures
 * begin with their own size, which the caller sets, so that they can grow without one. */
#define LIKENESS_API_VERSION 1
LIKENESS_API uint32_t likeness_api_version(void);

typedef enum likeness_status {
  LIKENESS_OK = 0,
  LIKENESS_INVALID_ARGUMENT = 1, /* a null pointer, a size that does not fit, a value that is not finite */
  LIKENESS_BAD_FILE = 2,         /* absent, damaged, no avatar, or one that this version does not know */
  LIKENESS_OUT_OF_MEMORY = 3,
  LIKENESS_INTERNAL_ERROR = 4, /* a mistake of ours: please report it */
  LIKENESS_OPENGL_ERROR = 5    /* no context, one older than 4.3, or too little memory of the GPU's */
} likeness_status;

/* What went wrong in this thread's last call that failed; "" when none has. Valid until the next call that fails. */
LIKENESS_API const char* likeness_last_error(void);

typedef struct likeness_decoder likeness_decoder;

/* Calls body(context, i) for every i from 0 to count - 1 on any threads, and returns when all are done. */
typedef void (*likeness_parallel)(void* pool, int32_t count, void (*body)(void* context, int index), void* context);

typedef struct likeness_options {
  uint32_t size;      /* sizeof(likeness_options) */
  int32_t threads;    /* 0: as many as there are cores, up to 8 */
  const char* kernel; /* NULL or "auto": the fastest accurate one; see docs/run-time-library.md */
  int32_t pin;        /* not 0: own threads each stay on one core */
  float spin_ms;      /* own threads wait so long for the next frame before they sleep */
  float gain[3];      /* shown colour = gain x colour + offset, colours from 0 to 255 */
  float offset[3];
  likeness_parallel parallel; /* NULL: own threads */
  void* pool;                 /* handed to `parallel` */
  int32_t person;             /* whose face, of an avatar of several people: from 0, in the file's order */
} likeness_options;

/* Sets the defaults: 2 threads, "auto", pinned, 2 ms, colours as they are. */
LIKENESS_API void likeness_default_options(likeness_options* options);

/* Opens an avatar, from a file or from memory, which is not needed afterwards. `options` may be NULL. */
LIKENESS_API likeness_status likeness_open(const char* path, const likeness_options* options,
                                           likeness_decoder** decoder);
LIKENESS_API likeness_status likeness_open_memory(const void* bytes, size_t byte_count, const likeness_options* options,
                                                  likeness_decoder** decoder);
LIKENESS_API void likeness_close(likeness_decoder* decoder); /* NULL is allowed */

typedef struct likeness_info {
  uint32_t size;        /* sizeof(likeness_info) */
  int32_t texture_size; /* texels a side */
  int32_t vertex_count; /* of the mesh */
  int32_t latent;       /* values in a code */
  int32_t triangle_count;
  int32_t uv_count;
  const float* mean_code;      /* [latent], a face at rest; pointers are valid until the decoder is closed */
  const int32_t* triangles;    /* [triangle_count, 3] vertex indices, counter-clockwise from outside */
  const int32_t* triangle_uvs; /* [triangle_count, 3] indices into uvs: a vertex on a seam has several */
  const float* uvs;            /* [uv_count, 2]; v = 1 is the first row of a texture */
  const char* kernel;          /* the one in use */
  double kernel_psnr_db;       /* of its textures against float32; 0 where that was not measured */
} likeness_info;
LIKENESS_API likeness_status likeness_get_info(const likeness_decoder* decoder, likeness_info* info);

typedef enum likeness_format {
  LIKENESS_RGBA8 = 0,  /* bytes, as in training, opacity 255 */
  LIKENESS_RGBA16F = 1 /* half-precision floats, the same divided by 255, opacity 1 */
} likeness_format;

typedef struct likeness_view {
  float direction[3]; /* unit vector from the head's centre to the viewer, head space */
  void* pixels;       /* texture_size rows of as many texels */
  int64_t row_bytes;  /* from a row to the next */
} likeness_view;

typedef struct likeness_mesh {
  float* vertices;      /* x y z, millimetres, head space */
  int64_t vertex_bytes; /* from a vertex to the next: 12 where they are packed */
} likeness_mesh;

/* Decodes 0 to 2 views, and the mesh where `mesh` is not NULL. Makes no allocation and takes no lock; see
 * docs/run-time-library.md for what it asks of the system. */
LIKENESS_API likeness_status likeness_decode(likeness_decoder* decoder, const float* code, const likeness_view* views,
                                             int32_t view_count, const likeness_mesh* mesh, likeness_format format);

/* Derivatives of vertices by the code: `jacobian` [3 count, latent], x y z after x y z, millimetres a unit of the code.
 * `vertices` lists `count` of them; NULL means all, and then count must be vertex_count. */
LIKENESS_API likeness_status likeness_mesh_jacobian(likeness_decoder* decoder, const float* code,
                                                    const int32_t* vertices, int32_t count, float* jacobian);

/* The decoder on a GPU, by OpenGL 4.3: textures and vertices stay in OpenGL's textures and a buffer, for the caller to
 * draw. The caller's context is current in each of these calls, and is the same in all of one decoder. */
typedef struct likeness_gl_decoder likeness_gl_decoder;

typedef struct likeness_gl_options {
  uint32_t size; /* sizeof(likeness_gl_options) */
  /* The address of one of OpenGL's functions, "glGetString", as windows' libraries and EGL give it; not NULL. */
  void* (*get_proc_address)(void* user, const char* name);
  void* user;             /* handed to it */
  likeness_format format; /* of the textures */
  const char* storage;    /* of weights and features: NULL or "auto": half where accurate enough; "half", "float" */
  float gain[3];          /* as in likeness_options */
  float offset[3];
  int32_t person;
} likeness_gl_options;

/* Sets the defaults: RGBA8, "auto", colours as they are, the first person; get_proc_address is NULL. */
LIKENESS_API void likeness_gl_default_options(likeness_gl_options* options);

LIKENESS_API likeness_status likeness_gl_open(const char* path, const likeness_gl_options* options,
                                              likeness_gl_decoder** decoder);
LIKENESS_API likeness_status likeness_gl_open_memory(const void* bytes, size_t byte_count,
                                                     const likeness_gl_options* options, likeness_gl_decoder** decoder);
LIKENESS_API void likeness_gl_close(likeness_gl_decoder* decoder); /* NULL is allowed */

/* `kernel` is "gl half" or "gl float". */
LIKENESS_API likeness_status likeness_gl_get_info(const likeness_gl_decoder* decoder, likeness_info* info);

typedef struct likeness_gl_outputs {
  uint32_t size;       /* sizeof(likeness_gl_outputs) */
  uint32_t texture[2]; /* of each view: GL_TEXTURE_2D, GL_RGBA8 or GL_RGBA16F, t = 0 is v = 1; with room for mipmaps */
  uint32_t vertices;   /* a buffer: x y z as packed floats, millimetres, head space */
} likeness_gl_outputs;
/* They stay the same until the decoder is closed, and belong to it. */
LIKENESS_API likeness_status likeness_gl_get_outputs(const likeness_gl_decoder* decoder, likeness_gl_outputs* outputs);

/* Hands a frame to the GPU and returns; what is drawn next sees it, without a wait or a barrier of the caller's.
 *   views  [view_count, 3] unit vectors, 0 to 2 of them
 *   mesh   not 0: the vertices too
 * docs/run-time-library.md says which of the context's state changes. */
LIKENESS_API likeness_status likeness_gl_decode(likeness_gl_decoder* decoder, const float* code, const float* views,
                                                int32_t view_count, int32_t mesh);

#ifdef __cplusplus
}
#endif

#endif /* LIKENESS_H_ */
