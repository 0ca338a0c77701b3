// What the files of the C interface share: no exception leaves them, and what went wrong is kept as text.

#pragma once

#include <exception>
#include <new>

#include "likeness/base/error.h"
#include "likeness/decode/likeness.h"

namespace likeness {

const char* LastError();

// Keeps the text for this thread's LastError; returns `status`.
likeness_status Fail(likeness_status status, const char* text);

// Runs `call`; an Error becomes `of_error`.
template <typename Call>
likeness_status Guarded(likeness_status of_error, const Call& call) {
  try {
    call();
    return LIKENESS_OK;
  } catch (const Error& error) {
    return Fail(of_error, error.what());
  } catch (const std::bad_alloc&) {
    return Fail(LIKENESS_OUT_OF_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return Fail(LIKENESS_INTERNAL_ERROR, error.what());
  } catch (...) {
    return Fail(LIKENESS_INTERNAL_ERROR, "an unknown exception");
  }
}

// Of a Decoder or a GlDecoder, but for the kernel; points into it. `size` is the caller's.
template <typename AnyDecoder>
likeness_info InfoOf(const AnyDecoder& decoder, uint32_t size) {
  likeness_info info = {};
  info.size = size;
  info.texture_size = decoder.architecture().texture_size;
  info.vertex_count = decoder.architecture().vertex_count;
  info.latent = decoder.architecture().latent;
  info.triangle_count = static_cast<int32_t>(decoder.triangles().size() / 3);
  info.uv_count = static_cast<int32_t>(decoder.uvs().size() / 2);
  info.mean_code = decoder.mean_code().data();
  info.triangles = decoder.triangles().data();
  info.triangle_uvs = decoder.triangle_uvs().data();
  info.uvs = decoder.uvs().data();
  return info;
}

}  // namespace likeness
