#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/hdf5_library.h"
#include "voxelize/volume/read_context.h"

namespace strata {

/// The numbers of a data set in chunks. HDF5's library finds the chunks and converts the numbers.
/// They are unpacked here, because the library takes for granted that a chunk unpacks to the size
/// it should have, and reads beyond its end where a byte of the file is wrong. All calls are within
/// a session. (Internal.)
class Hdf5Chunks {
 public:
  /// @param dataset, memory_type  stay open; numbers of both types are 1 to 8 bytes long
  /// @return kInput naming the file, kLimit if a chunk is too large for the budget
  static Result<Hdf5Chunks> open(ReadContext& context, hid_t dataset, hid_t memory_type,
                                 const std::vector<hsize_t>& shape);

  /// Along each axis.
  [[nodiscard]] const std::vector<hsize_t>& sides() const { return sides_; }
  /// The box of `count` numbers from `begin` on, converted; the last axis is the fastest.
  /// @return kInput
  Result<void> read(const Hdf5Session& session, const std::vector<hsize_t>& begin,
                    const std::vector<hsize_t>& count, std::byte* to);

 private:
  struct Filter {
    H5Z_filter_t id;
    std::size_t element;  ///< bytes of a number, of a shuffle
  };
  Hdf5Chunks() = default;
  Result<void> set_filters(hid_t properties);
  Result<void> load(const Hdf5Session& session, const std::vector<hsize_t>& begin);
  Result<void> unpack(std::uint32_t left_out);
  [[nodiscard]] tl::unexpected<Error> damaged(std::string_view what) const;

  std::string path_;
  hid_t dataset_ = -1, memory_type_ = -1;
  Hdf5Handle file_type_;
  bool convert_ = false;  ///< the types differ
  std::size_t file_number_ = 1, number_ = 1;
  std::vector<hsize_t> shape_, sides_;
  bool edges_are_plain_ = false;  ///< chunks that reach beyond the shape pass no filter
  std::size_t bytes_ = 0;         ///< of a chunk in the file, unpacked
  std::vector<Filter> filters_;
  std::vector<std::byte> fill_;  ///< a number where there is no chunk
  std::vector<hsize_t> at_;      ///< of the chunk that is being read
  std::vector<std::byte> packed_, chunk_;
  /// Room for all chunks, where they have no filters: the index says how much is read into it.
  std::unique_ptr<std::byte[]> plain_;
};

}  // namespace strata
