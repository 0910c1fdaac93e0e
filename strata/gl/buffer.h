#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "strata/core/result.h"

namespace strata::gl {

/// A buffer of the current context, for shaders (SSBO, UBO). Move-only. Calls
/// need the context that it was made in; so does its end.
class Buffer {
 public:
  Buffer() = default;
  ~Buffer() { reset(); }
  Buffer(Buffer&& other) noexcept
      : id_(std::exchange(other.id_, 0)), bytes_(std::exchange(other.bytes_, 0)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    if (this != &other) {
      reset();
      id_ = std::exchange(other.id_, 0);
      bytes_ = std::exchange(other.bytes_, 0);
    }
    return *this;
  }

  /// `bytes` of undefined content (at least 1 is held). ErrorCode::kLimit without the memory; what
  /// check_errors() says of earlier calls, the context's loss among them.
  [[nodiscard]] static Result<Buffer> allocate(std::uint64_t bytes);
  /// A copy of `data`.
  template <class T>
  [[nodiscard]] static Result<Buffer> of(std::span<const T> data) {
    auto buffer = allocate(data.size_bytes());
    if (buffer) buffer->upload(data);
    return buffer;
  }

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] unsigned id() const { return id_; }
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
  /// shaders wrote visible first. Rubbish comes where the context was lost: ask check_errors()
  /// before it is used. @pre it fits
  template <class T>
  void download(std::span<T> data, std::uint64_t offset = 0) const {
    static_assert(std::is_trivially_copyable_v<T>);
    download_bytes(data.data(), data.size_bytes(), offset);
  }
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

/// What shaders wrote to buffers is seen by the shaders that follow.
void storage_barrier();
/// Waits until all that was asked of the GPU is done. For clocks.
void finish();

}  // namespace strata::gl
