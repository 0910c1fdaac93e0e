#pragma once

#include <H5Epublic.h>
#include <H5Ipublic.h>
#include <H5public.h>

#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace strata {

/// HDF5's library while it lives: for one thread at a time, because the library may be built
/// without threads, and without its messages on stderr. (Internal.)
class Hdf5Session {
 public:
  Hdf5Session() : lock_(mutex()) {
    // At the end of a process 1.10 crashes over a file that could not be written to its end.
    static const bool kept = H5dont_atexit() >= 0;
    (void)kept;
    H5Eget_auto2(H5E_DEFAULT, &print_, &print_data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  Hdf5Session(const Hdf5Session&) = delete;
  Hdf5Session& operator=(const Hdf5Session&) = delete;
  ~Hdf5Session() { H5Eset_auto2(H5E_DEFAULT, print_, print_data_); }

  /// What the library says of the call that failed last.
  [[nodiscard]] std::string reason() const {
    std::string text;
    H5Ewalk2(
        H5E_DEFAULT, H5E_WALK_UPWARD,
        [](unsigned, const H5E_error2_t* error, void* to) -> herr_t {
          if (error->desc != nullptr) *static_cast<std::string*>(to) = error->desc;
          return 1;  // the innermost says most
        },
        &text);
    // Of a failed write the system's own words, not the numbers around them.
    constexpr std::string_view kSystem = "error message = '";
    if (const std::size_t at = text.find(kSystem); at != std::string::npos) {
      const std::size_t from = at + kSystem.size();
      text = text.substr(0, text.find(':') + 2) + text.substr(from, text.find('\'', from) - from);
    }
    return "HDF5: " + (text.empty() ? std::string("unknown error") : text.substr(0, 200));
  }

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  std::lock_guard<std::mutex> lock_;
  H5E_auto2_t print_ = nullptr;
  void* print_data_ = nullptr;
};

/// An identifier of the library, which is closed within a session. Move-only.
class Hdf5Handle {
 public:
  Hdf5Handle() = default;
  Hdf5Handle(hid_t id, herr_t (*closer)(hid_t)) : id_(id), close_(closer) {}
  Hdf5Handle(Hdf5Handle&& other) noexcept
      : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Hdf5Handle() { (void)close(); }

  [[nodiscard]] hid_t operator*() const { return id_; }
  [[nodiscard]] explicit operator bool() const { return id_ >= 0; }
  /// @return false if the library could not complete it
  bool close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

}  // namespace strata
