// The C interface to the decoder on the processor: translates arguments.

#include <algorithm>
#include <cstring>

#include "likeness/base/error.h"
#include "likeness/decode/c_interface.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/likeness.h"

struct likeness_decoder {
  std::unique_ptr<likeness::Decoder> decoder;
};

namespace {

using likeness::Decoder;
using likeness::Error;
using likeness::Fail;
using likeness::Guarded;

likeness::DecoderOptions OptionsFrom(const likeness_options* given) {
  likeness::DecoderOptions options;
  if (given == nullptr) return options;
  // Of a caller older or newer than this library: what it does not know keeps its default.
  likeness_options all;
  likeness_default_options(&all);
  std::memcpy(&all, given, std::min<size_t>(given->size, sizeof(all)));
  if (all.kernel != nullptr) options.kernel = all.kernel;
  options.threads = all.threads;
  options.pin = all.pin != 0;
  options.spin_ms = all.spin_ms;
  std::copy_n(all.gain, 3, options.display.gain.begin());
  std::copy_n(all.offset, 3, options.display.offset.begin());
  options.parallel = all.parallel;
  options.pool = all.pool;
  options.person = all.person;
  return options;
}

template <typename MakeFile>
likeness_status Open(const likeness_options* given, likeness_decoder** decoder, const MakeFile& make_file) {
  if (decoder == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "no place for the decoder was given");
  *decoder = nullptr;
  likeness::DecoderOptions options;
  const likeness_status status = Guarded(LIKENESS_INVALID_ARGUMENT, [&] {
    options = OptionsFrom(given);
    options.Check();
  });
  if (status != LIKENESS_OK) return status;
  return Guarded(LIKENESS_BAD_FILE, [&] {
    auto opened = std::make_unique<Decoder>(make_file(), options);
    *decoder = new likeness_decoder{std::move(opened)};
  });
}

}  // namespace

extern "C" {

uint32_t likeness_api_version(void) { return LIKENESS_API_VERSION; }

const char* likeness_last_error(void) { return likeness::LastError(); }

void likeness_default_options(likeness_options* options) {
  if (options == nullptr) return;
  const likeness::DecoderOptions defaults;
  *options = {};
  options->size = sizeof(*options);
  options->threads = defaults.threads;
  options->pin = defaults.pin ? 1 : 0;
  options->spin_ms = static_cast<float>(defaults.spin_ms);
  std::copy_n(defaults.display.gain.begin(), 3, options->gain);
  std::copy_n(defaults.display.offset.begin(), 3, options->offset);
}

likeness_status likeness_open(const char* path, const likeness_options* options, likeness_decoder** decoder) {
  if (path == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "no path was given");
  return Open(options, decoder, [&] { return likeness::SafetensorsFile::Map(path); });
}

likeness_status likeness_open_memory(const void* bytes, size_t byte_count, const likeness_options* options,
                                     likeness_decoder** decoder) {
  if (bytes == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "no bytes were given");
  return Open(options, decoder, [&] {
    return likeness::SafetensorsFile("avatar in memory", std::string_view(static_cast<const char*>(bytes), byte_count),
                                     nullptr);
  });
}

void likeness_close(likeness_decoder* decoder) { delete decoder; }

likeness_status likeness_get_info(const likeness_decoder* decoder, likeness_info* info) {
  if (decoder == nullptr || info == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "a null pointer was given");
  const Decoder& d = *decoder->decoder;
  likeness_info all = likeness::InfoOf(d, info->size);
  all.kernel = d.kernel().c_str();
  all.kernel_psnr_db = d.accuracy() != nullptr ? d.accuracy()->psnr_db : 0;
  std::memcpy(info, &all, std::min<size_t>(info->size, sizeof(all)));
  return LIKENESS_OK;
}

likeness_status likeness_decode(likeness_decoder* decoder, const float* code, const likeness_view* views,
                                int32_t view_count, const likeness_mesh* mesh, likeness_format format) {
  if (decoder == nullptr || code == nullptr || (views == nullptr && view_count != 0)) {
    return Fail(LIKENESS_INVALID_ARGUMENT, "a null pointer was given");
  }
  if (view_count < 0 || view_count > likeness::kMostViews) {
    return Fail(LIKENESS_INVALID_ARGUMENT, "expected 0 to 2 views");
  }
  if (format != LIKENESS_RGBA8 && format != LIKENESS_RGBA16F) {
    return Fail(LIKENESS_INVALID_ARGUMENT, "the texture's format is unknown");
  }
  return Guarded(LIKENESS_INVALID_ARGUMENT, [&] {
    Decoder::View all[likeness::kMostViews];
    for (int32_t v = 0; v < view_count; ++v) {
      std::copy_n(views[v].direction, 3, all[v].direction);
      all[v].pixels = views[v].pixels;
      all[v].row_bytes = views[v].row_bytes;
    }
    Decoder::Mesh where;
    if (mesh != nullptr) where = {mesh->vertices, mesh->vertex_bytes};
    Decoder& d = *decoder->decoder;
    d.Decode({code, static_cast<size_t>(d.architecture().latent)}, {all, static_cast<size_t>(view_count)}, where,
             format == LIKENESS_RGBA8 ? likeness::PixelFormat::kRgba8 : likeness::PixelFormat::kRgba16F);
  });
}

likeness_status likeness_mesh_jacobian(likeness_decoder* decoder, const float* code, const int32_t* vertices,
                                       int32_t count, float* jacobian) {
  if (decoder == nullptr || code == nullptr || jacobian == nullptr) {
    return Fail(LIKENESS_INVALID_ARGUMENT, "a null pointer was given");
  }
  return Guarded(LIKENESS_INVALID_ARGUMENT, [&] {
    Decoder& d = *decoder->decoder;
    const int32_t all = d.architecture().vertex_count;
    if (count < 1 || (vertices == nullptr && count != all)) {
      throw Error("{} vertices are listed; expected one or more, or all {}", count, all);
    }
    const auto latent = static_cast<size_t>(d.architecture().latent);
    const std::span<const int> listed(vertices, vertices == nullptr ? 0 : static_cast<size_t>(count));
    d.Jacobian({code, latent}, listed, {jacobian, 3 * latent * static_cast<size_t>(count)});
  });
}

}  // extern "C"
