#include "strata/gl/buffer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cassert>
#include <cstring>

#include "gl/faults.h"
#include "strata/gl/context.h"

namespace strata::gl {

Result<Buffer> Buffer::allocate(std::uint64_t bytes) {
  Buffer buffer;
  glCreateBuffers(1, &buffer.id_);
  // A buffer of no bytes cannot be bound.
  glNamedBufferStorage(buffer.id_, static_cast<GLsizeiptr>(std::max<std::uint64_t>(bytes, 4)),
                       nullptr, GL_DYNAMIC_STORAGE_BIT);
  // An error of an earlier call comes to light here too; it is not lost.
  if (auto checked = check_errors("allocation"); !checked) {
    return fail(checked.error().code, "OpenGL: cannot make a buffer of {} bytes: {}", bytes,
                checked.error().message);
  }
  buffer.bytes_ = bytes;
  return buffer;
}

Result<void> Buffer::reserve(std::uint64_t bytes) {
  if (id_ != 0 && bytes_ >= bytes) return {};
  reset();
  auto larger = allocate(bytes);
  if (!larger) return tl::unexpected(larger.error());
  *this = std::move(*larger);
  return {};
}

void Buffer::reset() noexcept {
  if (id_ != 0) glDeleteBuffers(1, &id_);
  id_ = 0;
  bytes_ = 0;
}

void Buffer::upload_bytes(const void* data, std::size_t bytes, std::uint64_t offset) {
  assert(offset + bytes <= bytes_);
  if (bytes == 0) return;
  glNamedBufferSubData(id_, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes), data);
}

void Buffer::download_bytes(void* data, std::size_t bytes, std::uint64_t offset) const {
  assert(offset + bytes <= bytes_);
  if (bytes == 0) return;
  if (loses_context_at_download()) {
    std::memset(data, 0xa5, bytes);
    return;
  }
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  glGetNamedBufferSubData(id_, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes), data);
}

void Buffer::clear(std::uint32_t value) { clear(value, 0, bytes_ / 4 * 4); }

void Buffer::clear(std::uint32_t value, std::uint64_t offset, std::uint64_t bytes) {
  assert(offset + bytes <= bytes_ && offset % 4 == 0 && bytes % 4 == 0);
  if (bytes == 0) return;
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  glClearNamedBufferSubData(id_, GL_R32UI, static_cast<GLintptr>(offset),
                            static_cast<GLsizeiptr>(bytes), GL_RED_INTEGER, GL_UNSIGNED_INT,
                            &value);
}

void Buffer::bind(unsigned index) const { glBindBufferBase(GL_SHADER_STORAGE_BUFFER, index, id_); }

void Buffer::bind(unsigned index, std::uint64_t offset, std::uint64_t bytes) const {
  assert(offset % 256 == 0 && bytes > 0 && offset + bytes <= bytes_);
  glBindBufferRange(GL_SHADER_STORAGE_BUFFER, index, id_, static_cast<GLintptr>(offset),
                    static_cast<GLsizeiptr>(bytes));
}

void Buffer::bind_uniform(unsigned index) const { glBindBufferBase(GL_UNIFORM_BUFFER, index, id_); }

void storage_barrier() { glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_UNIFORM_BARRIER_BIT); }

void finish() { glFinish(); }

}  // namespace strata::gl
