#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "strata/core/result.h"

namespace strata::gl {

/// A buffer of the current context, for shaders (SSBO, UBO). Move-only. Its functions and its
/// destructor need the context that it was made in.
class Buffer {
 public:
  Buffer() = default;
  ~Buffer() { reset(); }
  /// Leaves `other` empty.
  Buffer(Buffer&& other) noexcept
      : id_(std::exchange(other.id_, 0)), bytes_(std::exchange(other.bytes_, 0)) {}
  /// Deletes the buffer held before; leaves `other` empty.
  Buffer& operator=(Buffer&& other) noexcept {
    if (this != &other) {
      reset();
      id_ = std::exchange(other.id_, 0);
      bytes_ = std::exchange(other.bytes_, 0);
    }
    return *this;
  }

  /// `bytes` of undefined content (at least 1 is held). @return kLimit without the memory; else
  /// errors of earlier calls that check_errors() reports, such as the loss of the context.
  [[nodiscard]] static Result<Buffer> allocate(std::uint64_t bytes);
  /// A copy of `data`.
  template <class T>
  [[nodiscard]] static Result<Buffer> of(std::span<const T> data) {
    auto buffer = allocate(data.size_bytes());
    if (buffer) buffer->upload(data);
    return buffer;
  }

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }  ///< size, as it was asked for
  /// The name that OpenGL gave it; 0 if there is none.
  [[nodiscard]] unsigned id() const { return id_; }
  /// True if there is a buffer.
  [[nodiscard]] explicit operator bool() const { return id_ != 0; }

  /// Makes room for `bytes` if there is less; the content is lost then. The old buffer goes first.
  [[nodiscard]] Result<void> reserve(std::uint64_t bytes);

  /// Makes room for `data` and copies it. @return as reserve()
  template <class T>
  [[nodiscard]] Result<void> assign(std::span<const T> data) {
    if (auto room = reserve(data.size_bytes()); !room) return room;
    upload(data);
    return {};
  }
  /// Copies `data` to byte `offset`. @pre it fits
  template <class T>
  void upload(std::span<const T> data, std::uint64_t offset = 0) {
    static_assert(std::is_trivially_copyable_v<T>);
    upload_bytes(data.data(), data.size_bytes(), offset);
  }
  /// Fills `data` from byte `offset`; waits for what was asked of the GPU before, and makes what
  /// shaders wrote visible first. After the loss of the context the data are undefined: call
  /// check_errors() before using them. @pre it fits
  template <class T>
  void download(std::span<T> data, std::uint64_t offset = 0) const {
    static_assert(std::is_trivially_copyable_v<T>);
    download_bytes(data.data(), data.size_bytes(), offset);
  }
  /// A copy of the content, as download().
  template <class T>
  [[nodiscard]] std::vector<T> download_all() const {
    std::vector<T> data(bytes_ / sizeof(T));
    download(std::span<T>(data));
    return data;
  }
  /// Sets every whole 32-bit word to `value`.
  void clear(std::uint32_t value = 0);
  /// The same for `bytes` from byte `offset`, both multiples of 4.
  void clear(std::uint32_t value, std::uint64_t offset, std::uint64_t bytes);

  /// Binds the buffer as shader storage, `layout(std430, binding = index) buffer`.
  void bind(unsigned index) const;
  /// A part of it; `offset` must be a multiple of 256.
  void bind(unsigned index, std::uint64_t offset, std::uint64_t bytes) const;
  /// Binds the buffer as `layout(std140, binding = index) uniform`.
  void bind_uniform(unsigned index) const;

 private:
  void reset() noexcept;
  void upload_bytes(const void* data, std::size_t bytes, std::uint64_t offset);
  void download_bytes(void* data, std::size_t bytes, std::uint64_t offset) const;

  unsigned id_ = 0;
  std::uint64_t bytes_ = 0;
};

/// Makes what shaders wrote to buffers visible to the shaders that follow.
void storage_barrier();
/// Waits until the GPU has done all its work. For time measurements.
void finish();

}  // namespace strata::gl
