// HDF5 (docs.hdfgroup.org): the data set `voxels`, indexed [z, y, x], so that x is fastest; of
// colours [z, y, x, 4]. A chunk is a layer of z, or rows of it, and a zlib stream that is made from
// runs and handed over as it is; empty chunks are not stored. Attributes say the place. HDF5 writes
// to the temporary file; what goes to a pipe is made in a file without a name first.

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "core/hdf5_library.h"
#include "voxelize/output/dense_rows.h"
#include "voxelize/output/grid_text.h"
#include "voxelize/output/run_deflate.h"
#include "voxelize/output/slab_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr std::size_t kHdf5ChunkBytes = std::size_t{1} << 24;  // of voxels, at most

class Hdf5Writer final : public SlabWriter {
 public:
  Hdf5Writer(const std::string& path, const VoxelGrid& grid, const VoxelWriterOptions& options,
             AtomicFile output)
      : SlabWriter(path, grid, Axis::kX), values_(options), output_(std::move(output)) {
    const std::size_t row = static_cast<std::size_t>(dims().x) * values_.bytes;
    const auto columns = static_cast<std::size_t>(dims().y);
    rows_ = static_cast<int>(std::clamp<std::size_t>(kHdf5ChunkBytes / row, 1, columns));
    pieces_ = static_cast<std::size_t>((dims().y + rows_ - 1) / rows_);
  }
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;
  ~Hdf5Writer() override {
    const Hdf5Session session;
    dataset_.close();
    file_.close();
    if (spool_ >= 0) ::close(spool_);
  }

  Result<void> begin(const VoxelWriterOptions& options);

 private:
  struct Chunk {
    Bytes bytes;
    bool empty = true;
  };

  [[nodiscard]] bool to_pipe() const { return output_.temporary_path() == output_.path(); }
  Result<std::string> place_to_write();
  [[nodiscard]] tl::unexpected<Error> failure(const Hdf5Session& session) const {
    return fail(ErrorCode::kOutput, "{}: {}", path(), session.reason());
  }
  bool write_attributes(const VoxelWriterOptions& options);
  bool write_numbers(const char* name, const double* numbers, std::vector<hsize_t> shape);
  bool write_text(const char* name, const std::string& text);
  void make_chunk(const VoxelIntervals& slab, int z, int row, Chunk& chunk) const;
  Result<void> copy_to_pipe(const Execution& execution);
  Result<void> add_slab(const VoxelIntervals& slab, const Execution& execution) override;
  Result<void> finish_output(const Execution& execution) override;

  DenseValues values_;
  AtomicFile output_;
  int spool_ = -1;  // descriptor of the file without a name
  Hdf5Handle file_, dataset_;
  int rows_ = 0;             // of a chunk
  std::size_t pieces_ = 0;   // chunks of a layer
  std::vector<Chunk> made_;  // kept, since fresh pages are dear
};

Result<std::string> Hdf5Writer::place_to_write() {
  if (!to_pipe()) return output_.temporary_path();
  std::error_code error;
  const std::string folder = std::filesystem::temp_directory_path(error).string();
  std::string name = (error ? "/tmp" : folder) + "/strata-XXXXXX";
  spool_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (spool_ < 0) {
    return fail(ErrorCode::kOutput, "{}: a temporary file {}: {}", path(), name,
                std::strerror(errno));
  }
  return name;
}

Result<void> Hdf5Writer::begin(const VoxelWriterOptions& options) {
  const Result<std::string> place = place_to_write();
  if (!place) return tl::unexpected(place.error());
  const Hdf5Session session;
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(*access, false, true);  // the file is ours alone
  const Hdf5Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_obj_track_times(*creation, false);
  file_ = Hdf5Handle(H5Fcreate(place->c_str(), H5F_ACC_TRUNC, *creation, *access), H5Fclose);
  if (to_pipe()) ::unlink(place->c_str());  // open, it needs no name
  if (!file_) return failure(session);

  const auto side = [&](int axis) { return static_cast<hsize_t>(dims()[axis]); };
  const int rank = values_.kind == DenseValues::Kind::kColours ? 4 : 3;
  const std::array<hsize_t, 4> shape{side(2), side(1), side(0), 4};
  const std::array<hsize_t, 4> chunk{1, static_cast<hsize_t>(rows_), side(0), 4};
  const Hdf5Handle space(H5Screate_simple(rank, shape.data(), nullptr), H5Sclose);
  const Hdf5Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(*properties, false);  // the same voxels give the same bytes
  if (H5Pset_chunk(*properties, rank, chunk.data()) < 0 || H5Pset_deflate(*properties, 1) < 0) {
    return failure(session);
  }
  const hid_t type = values_.is_float()            ? H5T_IEEE_F32LE
                     : values_.number_bits() == 8  ? H5T_STD_U8LE
                     : values_.number_bits() == 16 ? H5T_STD_U16LE
                                                   : H5T_STD_U32LE;
  dataset_ = Hdf5Handle(
      H5Dcreate2(*file_, "voxels", type, *space, H5P_DEFAULT, *properties, H5P_DEFAULT), H5Dclose);
  if (!dataset_ || !write_attributes(options)) return failure(session);
  return {};
}

bool Hdf5Writer::write_attributes(const VoxelWriterOptions& options) {
  const GridFrame& frame = options.frame;
  const VoxelGrid& g = grid();
  std::array<double, 9> direction{};
  for (int i = 0; i < 9; ++i) {
    direction[static_cast<std::size_t>(i)] = frame.direction[i % 3][i / 3] + 0.0;
  }
  const std::string_view unit = unit_name(frame.unit_metres);
  const glm::dvec3 size_um = g.voxel_size * (frame.unit_metres * 1e6);
  const std::array<double, 3> element_size{size_um.z, size_um.y, size_um.x};
  return write_text("axes", values_.kind == DenseValues::Kind::kColours ? "zyxc" : "zyx") &&
         write_numbers("origin", &g.origin.x, {3}) &&
         write_numbers("spacing", &g.voxel_size.x, {3}) &&
         write_numbers("direction", direction.data(), {3, 3}) &&
         (unit.empty() || write_text("unit", std::string(unit))) &&
         (frame.space.empty() || write_text("space", frame.space)) &&
         (options.name.empty() || write_text("name", options.name)) &&
         (frame.unit_metres == 0.0 || write_numbers("element_size_um", element_size.data(), {3}));
}

bool Hdf5Writer::write_numbers(const char* name, const double* numbers,
                               std::vector<hsize_t> shape) {
  const Hdf5Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr),
                         H5Sclose);
  const Hdf5Handle attribute(
      H5Acreate2(*dataset_, name, H5T_IEEE_F64LE, *space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute && H5Awrite(*attribute, H5T_NATIVE_DOUBLE, numbers) >= 0;
}

/// As h5py writes a str.
bool Hdf5Writer::write_text(const char* name, const std::string& text) {
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(*type, H5T_VARIABLE);
  H5Tset_cset(*type, H5T_CSET_UTF8);
  const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Hdf5Handle attribute(H5Acreate2(*dataset_, name, *type, *space, H5P_DEFAULT, H5P_DEFAULT),
                             H5Aclose);
  const char* letters = text.c_str();
  return attribute && H5Awrite(*attribute, *type, &letters) >= 0;
}

/// Chunks have all their rows, also those beyond the grid.
void Hdf5Writer::make_chunk(const VoxelIntervals& slab, int z, int row, Chunk& chunk) const {
  chunk.bytes.clear();
  chunk.empty = true;
  const int end = std::min(row + rows_, dims().y);
  RunDeflater deflater(values_.codes, values_.bytes);
  append_zlib_stream(deflater, chunk.bytes, [&](RunDeflater& to) {
    emit_rows(slab, values_, z, row, end, [&](std::uint32_t value, int length) {
      chunk.empty = chunk.empty && value == 0;
      to.run(value, static_cast<std::uint64_t>(length));
    });
    const auto beyond = static_cast<std::uint64_t>(row + rows_ - end);
    if (beyond != 0) to.run(0, beyond * static_cast<std::uint64_t>(dims().x));
  });
}

Result<void> Hdf5Writer::add_slab(const VoxelIntervals& slab, const Execution& execution) {
  const std::size_t count = static_cast<std::size_t>(slab.v_end() - slab.v_begin()) * pieces_;
  made_.resize(4 * static_cast<std::size_t>(execution.thread_count()));
  const auto place = [&](std::size_t index) {
    return std::pair(slab.v_begin() + static_cast<int>(index / pieces_),
                     static_cast<int>(index % pieces_) * rows_);
  };
  for (std::size_t first = 0; first < count; first += made_.size()) {
    const std::size_t batch = std::min(made_.size(), count - first);
    parallel_for(execution, batch, [&](std::size_t i, int) {
      const auto [z, row] = place(first + i);
      make_chunk(slab, z, row, made_[i]);
    });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
    const Hdf5Session session;
    for (std::size_t i = 0; i < batch; ++i) {
      if (made_[i].empty) continue;
      const auto [z, row] = place(first + i);
      const std::array<hsize_t, 4> offset{static_cast<hsize_t>(z), static_cast<hsize_t>(row), 0, 0};
      const Bytes& bytes = made_[i].bytes;
      if (H5Dwrite_chunk(*dataset_, H5P_DEFAULT, 0, offset.data(), bytes.size(), bytes.data()) <
          0) {
        return failure(session);
      }
    }
  }
  return {};
}

Result<void> Hdf5Writer::copy_to_pipe(const Execution& execution) {
  std::vector<char> buffer(std::size_t{1} << 20);
  for (off_t at = 0;;) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled");
    const ssize_t got = ::pread(spool_, buffer.data(), buffer.size(), at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      return fail(ErrorCode::kOutput, "{}: its temporary file: {}", path(), std::strerror(errno));
    }
    if (got == 0) return {};
    auto written = output_.write(buffer.data(), static_cast<std::size_t>(got));
    if (!written) return written;
    at += got;
  }
}

Result<void> Hdf5Writer::finish_output(const Execution& execution) {
  {
    const Hdf5Session session;
    if (!dataset_.close() || !file_.close()) return failure(session);
  }
  if (to_pipe()) {
    if (auto copied = copy_to_pipe(execution); !copied) return copied;
  }
  return output_.commit();
}

}  // namespace

VoxelWriterResult open_hdf5_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options) {
  Result<AtomicFile> output = AtomicFile::create(path);
  if (!output) return tl::unexpected(output.error());
  return begun(std::make_unique<Hdf5Writer>(path, grid, options, std::move(*output)), options);
}

}  // namespace strata
