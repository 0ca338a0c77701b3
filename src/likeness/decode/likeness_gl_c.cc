// The C interface to the decoder on a GPU: translates arguments.

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <string>

#include "likeness/decode/c_interface.h"
#include "likeness/decode/gl_decoder.h"

struct likeness_gl_decoder {
  std::unique_ptr<const likeness::GlFunctions> gl;
  std::unique_ptr<likeness::GlDecoder> decoder;
};

namespace {

using likeness::Error;
using likeness::Fail;
using likeness::Guarded;

likeness_gl_options WithDefaults(const likeness_gl_options& given) {
  // Of a caller older or newer than this library: what it does not know keeps its default.
  likeness_gl_options all;
  likeness_gl_default_options(&all);
  std::memcpy(&all, &given, std::min<size_t>(given.size, sizeof(all)));
  return all;
}

likeness::GlDecoderOptions OptionsFrom(const likeness_gl_options& all) {
  if (all.get_proc_address == nullptr) throw Error("the option get_proc_address is NULL; expected a function");
  if (all.format != LIKENESS_RGBA8 && all.format != LIKENESS_RGBA16F) throw Error("the textures' format is unknown");
  likeness::GlDecoderOptions options;
  options.format = all.format == LIKENESS_RGBA8 ? likeness::PixelFormat::kRgba8 : likeness::PixelFormat::kRgba16F;
  if (all.storage != nullptr) options.storage = all.storage;
  std::copy_n(all.gain, 3, options.display.gain.begin());
  std::copy_n(all.offset, 3, options.display.offset.begin());
  options.person = all.person;
  options.Check();
  return options;
}

template <typename MakeFile>
likeness_status Open(const likeness_gl_options* given, likeness_gl_decoder** decoder, const MakeFile& make_file) {
  if (given == nullptr || decoder == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "a null pointer was given");
  *decoder = nullptr;
  const likeness_gl_options all = WithDefaults(*given);
  likeness::GlDecoderOptions options;
  likeness_status status = Guarded(LIKENESS_INVALID_ARGUMENT, [&] { options = OptionsFrom(all); });
  if (status != LIKENESS_OK) return status;
  std::optional<likeness::DecoderNetwork> network;
  status = Guarded(LIKENESS_BAD_FILE,
                   [&] { network = likeness::NetworkFrom(make_file(), options.display, options.person); });
  if (status != LIKENESS_OK) return status;
  return Guarded(LIKENESS_OPENGL_ERROR, [&] {
    auto opened = std::make_unique<likeness_gl_decoder>();
    const auto loader = [&all](const char* name) { return all.get_proc_address(all.user, name); };
    opened->gl = std::make_unique<likeness::GlFunctions>(loader, 4, 3);
    opened->decoder = std::make_unique<likeness::GlDecoder>(*opened->gl, *network, options);
    *decoder = opened.release();
  });
}

}  // namespace

extern "C" {

void likeness_gl_default_options(likeness_gl_options* options) {
  if (options == nullptr) return;
  const likeness::GlDecoderOptions defaults;
  *options = {};
  options->size = sizeof(*options);
  options->format = LIKENESS_RGBA8;
  std::copy_n(defaults.display.gain.begin(), 3, options->gain);
  std::copy_n(defaults.display.offset.begin(), 3, options->offset);
}

likeness_status likeness_gl_open(const char* path, const likeness_gl_options* options, likeness_gl_decoder** decoder) {
  if (path == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "no path was given");
  return Open(options, decoder, [&] { return likeness::SafetensorsFile::Map(path); });
}

likeness_status likeness_gl_open_memory(const void* bytes, size_t byte_count, const likeness_gl_options* options,
                                        likeness_gl_decoder** decoder) {
  if (bytes == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "no bytes were given");
  return Open(options, decoder, [&] {
    return likeness::SafetensorsFile("avatar in memory", std::string_view(static_cast<const char*>(bytes), byte_count),
                                     nullptr);
  });
}

void likeness_gl_close(likeness_gl_decoder* decoder) { delete decoder; }

likeness_status likeness_gl_get_info(const likeness_gl_decoder* decoder, likeness_info* info) {
  if (decoder == nullptr || info == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "a null pointer was given");
  const likeness::GlDecoder& d = *decoder->decoder;
  likeness_info all = likeness::InfoOf(d, info->size);
  all.kernel = d.half() ? "gl half" : "gl float";
  all.kernel_psnr_db = d.accuracy() != nullptr ? d.accuracy()->psnr_db : 0;
  std::memcpy(info, &all, std::min<size_t>(info->size, sizeof(all)));
  return LIKENESS_OK;
}

likeness_status likeness_gl_get_outputs(const likeness_gl_decoder* decoder, likeness_gl_outputs* outputs) {
  if (decoder == nullptr || outputs == nullptr) return Fail(LIKENESS_INVALID_ARGUMENT, "a null pointer was given");
  const likeness::GlDecoder& d = *decoder->decoder;
  const likeness_gl_outputs all = {outputs->size, {d.texture(0), d.texture(1)}, d.vertices()};
  std::memcpy(outputs, &all, std::min<size_t>(outputs->size, sizeof(all)));
  return LIKENESS_OK;
}

likeness_status likeness_gl_decode(likeness_gl_decoder* decoder, const float* code, const float* views,
                                   int32_t view_count, int32_t mesh) {
  if (decoder == nullptr || code == nullptr || (views == nullptr && view_count != 0)) {
    return Fail(LIKENESS_INVALID_ARGUMENT, "a null pointer was given");
  }
  if (view_count < 0 || view_count > likeness::kMostViews) {
    return Fail(LIKENESS_INVALID_ARGUMENT, "expected 0 to 2 views");
  }
  return Guarded(LIKENESS_INVALID_ARGUMENT, [&] {
    std::array<float, 3> directions[likeness::kMostViews];
    for (int32_t v = 0; v < view_count; ++v) std::copy_n(views + 3 * v, 3, directions[v].begin());
    likeness::GlDecoder& d = *decoder->decoder;
    d.Decode({code, static_cast<size_t>(d.architecture().latent)}, {directions, static_cast<size_t>(view_count)},
             mesh != 0);
  });
}

}  // extern "C"
