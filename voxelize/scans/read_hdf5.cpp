// HDF5: the data set `voxels`, or else the first one of numbers with three axes, indexed [z, y, x].
// Further axes before or after these may have one index. HDF5's library reads the file by its name,
// a few layers at a time. What would open other files is refused: links are not followed, nor
// external and virtual data sets read.

#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/hdf5_library.h"
#include "voxelize/scans/hdf5_chunks.h"
#include "voxelize/scans/scan_readers.h"

namespace strata {
namespace {

constexpr int kHdf5MostAxes = 8;
constexpr std::uint64_t kHdf5BufferBytes = std::uint64_t{1} << 26;  // of layers, unless one is more

/// A data set that is an array of voxels.
struct Hdf5Array {
  Hdf5Handle dataset, memory_type;
  std::vector<hsize_t> shape;
  std::size_t first = 0;  ///< of the axes z, y, x
  bool colours = false;   ///< another axis follows: red, green, blue, alpha
  NumberType type = NumberType::kU8;
  std::optional<Hdf5Chunks> chunks;  ///< none: the voxels are stored in one piece
};

/// The type of numbers in memory. @return false if they are not
bool set_hdf5_type(hid_t type, Hdf5Array& array) {
  const std::size_t size = H5Tget_size(type);
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_ENUM && size == 1) {  // a bool of h5py
    array.type = NumberType::kBool;
    array.memory_type = Hdf5Handle(H5Tcopy(type), H5Tclose);
    return static_cast<bool>(array.memory_type);
  }
  const auto set = [&](NumberType number, hid_t native) {
    array.type = number;
    array.memory_type = Hdf5Handle(H5Tcopy(native), H5Tclose);
    return static_cast<bool>(array.memory_type);
  };
  if (kind == H5T_FLOAT && size <= 8) {
    return size <= 4 ? set(NumberType::kF32, H5T_NATIVE_FLOAT)
                     : set(NumberType::kF64, H5T_NATIVE_DOUBLE);
  }
  if (kind != H5T_INTEGER || size > 8 || size == 0) return false;
  if (H5Tget_sign(type) == H5T_SGN_NONE) {
    return size == 1   ? set(NumberType::kU8, H5T_NATIVE_UINT8)
           : size == 2 ? set(NumberType::kU16, H5T_NATIVE_UINT16)
           : size <= 4 ? set(NumberType::kU32, H5T_NATIVE_UINT32)
                       : set(NumberType::kU64, H5T_NATIVE_UINT64);
  }
  return size == 1   ? set(NumberType::kI8, H5T_NATIVE_INT8)
         : size == 2 ? set(NumberType::kI16, H5T_NATIVE_INT16)
         : size <= 4 ? set(NumberType::kI32, H5T_NATIVE_INT32)
                     : set(NumberType::kI64, H5T_NATIVE_INT64);
}

std::optional<Hdf5Array> hdf5_array_at(hid_t file, const char* name) {
  Hdf5Array array;
  array.dataset = Hdf5Handle(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  if (!array.dataset) return std::nullopt;
  const Hdf5Handle type(H5Dget_type(*array.dataset), H5Tclose);
  const Hdf5Handle space(H5Dget_space(*array.dataset), H5Sclose);
  if (!type || !space || H5Sget_simple_extent_type(*space) != H5S_SIMPLE) return std::nullopt;
  const int rank = H5Sget_simple_extent_ndims(*space);
  if (rank < 3 || rank > kHdf5MostAxes || !set_hdf5_type(*type, array)) return std::nullopt;
  array.shape.resize(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(*space, array.shape.data(), nullptr);
  array.colours = rank > 3 && array.shape.back() == 4 && array.type == NumberType::kU8;
  std::size_t end = array.shape.size() - (array.colours ? 1 : 0);
  while (end - array.first > 3 && array.shape[array.first] == 1) ++array.first;
  while (end - array.first > 3 && array.shape[end - 1] == 1) --end;  // a channel
  if (end - array.first != 3) return std::nullopt;
  return array;
}

struct Hdf5File {
  Hdf5Handle file;
  Hdf5Array array;
  ~Hdf5File() {
    const Hdf5Session session;
    array.chunks.reset();
    array.dataset.close();
    array.memory_type.close();
    file.close();
  }
};

/// Refuses what would read other files, and voxels that are not where their number says; finds the
/// chunks.
Result<void> check_hdf5_storage(ReadContext& context, Hdf5Array& array) {
  const Hdf5Handle properties(H5Dget_create_plist(*array.dataset), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(*properties);
  if (layout == H5D_VIRTUAL || H5Pget_external_count(*properties) > 0) {
    return fail(ErrorCode::kInput, "{}: its voxels are in other files, which are not read",
                context.path);
  }
  if (layout == H5D_CHUNKED) {
    auto chunks = Hdf5Chunks::open(context, *array.dataset, *array.memory_type, array.shape);
    if (!chunks) return tl::unexpected(chunks.error());
    array.chunks.emplace(*std::move(chunks));
    return {};
  }
  const Hdf5Handle type(H5Dget_type(*array.dataset), H5Tclose);
  double bytes = static_cast<double>(H5Tget_size(*type));
  for (const hsize_t side : array.shape) bytes *= static_cast<double>(side);
  const hsize_t held = H5Dget_storage_size(*array.dataset);  // 0: all have the fill value
  if (held != 0 && static_cast<double>(held) != bytes) {
    return fail(ErrorCode::kInput, "{}: its voxels must have {} bytes, got {}", context.path, bytes,
                held);
  }
  return {};
}

/// Opens the file and finds the array.
Result<void> open_hdf5(ReadContext& context, Hdf5File& opened) {
  const Hdf5Session session;
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(*access, false, true);  // only reads, also where nothing may be locked
  opened.file = Hdf5Handle(H5Fopen(context.path.c_str(), H5F_ACC_RDONLY, *access), H5Fclose);
  if (!opened.file) {
    return fail(ErrorCode::kInput, "{}: not an HDF5 file that can be read: {}", context.path,
                session.reason());
  }
  std::optional<Hdf5Array> array;
  if (H5Lexists(*opened.file, "voxels", H5P_DEFAULT) > 0) {
    H5L_info_t link{};
    if (H5Lget_info(*opened.file, "voxels", &link, H5P_DEFAULT) >= 0 &&
        link.type == H5L_TYPE_HARD) {
      array = hdf5_array_at(*opened.file, "voxels");
    }
  }
  if (!array) {
    const auto visit = [](hid_t root, const char* name, const auto* info, void* to) -> herr_t {
      if (info->type != H5O_TYPE_DATASET) return 0;
      auto& found = *static_cast<std::optional<Hdf5Array>*>(to);
      found = hdf5_array_at(root, name);
      return found ? 1 : 0;
    };
    const herr_t visited =
        H5Ovisit2(*opened.file, H5_INDEX_NAME, H5_ITER_INC, visit, &array, H5O_INFO_BASIC);
    if (visited < 0) return fail(ErrorCode::kInput, "{}: {}", context.path, session.reason());
  }
  if (!array) {
    return fail(ErrorCode::kInput, "{}: no data set of numbers with three axes", context.path);
  }
  opened.array = std::move(*array);
  return check_hdf5_storage(context, opened.array);
}

/// `count` numbers of an attribute; nothing if it is not that.
std::optional<std::vector<double>> hdf5_numbers(const Hdf5Array& array, const char* name,
                                                std::size_t count) {
  if (H5Aexists(*array.dataset, name) <= 0) return std::nullopt;
  const Hdf5Handle attribute(H5Aopen(*array.dataset, name, H5P_DEFAULT), H5Aclose);
  const Hdf5Handle space(H5Aget_space(*attribute), H5Sclose);
  const Hdf5Handle type(H5Aget_type(*attribute), H5Tclose);
  const H5T_class_t kind = H5Tget_class(*type);
  if ((kind != H5T_FLOAT && kind != H5T_INTEGER) || H5Tget_size(*type) > 8 ||
      H5Sget_simple_extent_npoints(*space) != static_cast<hssize_t>(count)) {
    return std::nullopt;
  }
  std::vector<double> numbers(count);
  if (H5Aread(*attribute, H5T_NATIVE_DOUBLE, numbers.data()) < 0) return std::nullopt;
  return numbers;
}

/// A text of an attribute, of fixed or any length; else empty.
std::string hdf5_text(const Hdf5Array& array, const char* name) {
  constexpr std::size_t kLongest = 256;
  if (H5Aexists(*array.dataset, name) <= 0) return {};
  const Hdf5Handle attribute(H5Aopen(*array.dataset, name, H5P_DEFAULT), H5Aclose);
  const Hdf5Handle space(H5Aget_space(*attribute), H5Sclose);
  const Hdf5Handle type(H5Aget_type(*attribute), H5Tclose);
  if (H5Tget_class(*type) != H5T_STRING || H5Sget_simple_extent_npoints(*space) != 1) return {};
  if (H5Tis_variable_str(*type) <= 0) {
    const std::size_t size = H5Tget_size(*type);
    if (size > kLongest) return {};
    std::string text(size, '\0');
    if (H5Aread(*attribute, *type, text.data()) < 0) return {};
    return text.substr(0, text.find('\0'));
  }
  char* letters = nullptr;
  if (H5Aread(*attribute, *type, &letters) < 0 || letters == nullptr) return {};
  std::string text(letters, strnlen(letters, kLongest));
  H5free_memory(letters);
  return text;
}

struct Hdf5Place {
  GridAxes axes;
  bool placed = false;
  double unit_metres = 0.0;
  std::string space;
};

/// By our attributes, or by `element_size_um`, which is z, y, x, of others.
Hdf5Place hdf5_place(const Hdf5Array& array) {
  const Hdf5Session session;
  Hdf5Place place;
  place.axes.corner = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    place.axes.sizes[axis] = static_cast<double>(array.shape[array.first + 2 - axis]);
  }
  const auto origin = hdf5_numbers(array, "origin", 3), spacing = hdf5_numbers(array, "spacing", 3);
  if (origin && spacing) {
    GridFrame frame;
    if (const auto rows = hdf5_numbers(array, "direction", 9)) {
      for (int i = 0; i < 9; ++i) {
        frame.direction[i % 3][i / 3] = (*rows)[static_cast<std::size_t>(i)];
      }
    }
    place.axes.place = frame.world({(*origin)[0], (*origin)[1], (*origin)[2]});
    place.axes.steps = frame.steps({(*spacing)[0], (*spacing)[1], (*spacing)[2]});
    place.placed = true;
    place.unit_metres = unit_named(hdf5_text(array, "unit"));
    place.space = hdf5_text(array, "space");
  } else if (const auto size = hdf5_numbers(array, "element_size_um", 3)) {
    for (int axis = 0; axis < 3; ++axis) {
      place.axes.steps[axis][axis] = (*size)[static_cast<std::size_t>(2 - axis)];
    }
    place.placed = true;
    place.unit_metres = 1e-6;
  }
  return place;
}

/// The numbers, some layers at a time.
class Hdf5Layers {
 public:
  Hdf5Layers(ReadContext& context, Hdf5Array& array) : context_(context), array_(array) {
    number_ = array.colours ? 4 : bytes_of(array.type);
    layer_ = array.shape[array.first + 1] * array.shape[array.first + 2] * number_;
    layers_ = array.shape[array.first];
  }

  /// Memory for a few layers: those of a chunk, if it is not too much.
  Result<void> begin() {
    const hsize_t deep =
        array_.chunks ? std::clamp<hsize_t>(array_.chunks->sides()[array_.first], 1, layers_) : 1;
    deep_ = std::clamp<hsize_t>(kHdf5BufferBytes / layer_, 1, deep);
    if (!context_.budget.take(deep_ * layer_)) return context_.too_large("a layer");
    buffer_.resize(deep_ * layer_);
    return {};
  }

  Result<void> read(std::byte* to, std::size_t count) {
    while (count > 0) {
      if (at_ == there_) {
        if (auto filled = read_more(); !filled) return filled;
      }
      const std::size_t piece = std::min(count, there_ - at_);
      std::copy_n(buffer_.data() + at_, piece, to);
      at_ += piece, to += piece, count -= piece;
    }
    return {};
  }

 private:
  Result<void> read_more() {
    const hsize_t deep = std::min(deep_, layers_ - std::min(next_, layers_));
    if (deep == 0) return fail(ErrorCode::kInput, "{}: its voxels end too early", context_.path);
    std::vector<hsize_t> offset(array_.shape.size(), 0), count = array_.shape;
    offset[array_.first] = next_;
    count[array_.first] = deep;
    const Hdf5Session session;
    if (array_.chunks) {
      if (auto read = array_.chunks->read(session, offset, count, buffer_.data()); !read)
        return read;
      next_ += deep;
      at_ = 0;
      there_ = deep * layer_;
      return {};
    }
    const Hdf5Handle file_space(H5Dget_space(*array_.dataset), H5Sclose);
    const Hdf5Handle memory_space(
        H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose);
    if (H5Sselect_hyperslab(*file_space, H5S_SELECT_SET, offset.data(), nullptr, count.data(),
                            nullptr) < 0 ||
        H5Dread(*array_.dataset, *array_.memory_type, *memory_space, *file_space, H5P_DEFAULT,
                buffer_.data()) < 0) {
      return fail(ErrorCode::kInput, "{}: layers from {} on: {}", context_.path, next_,
                  session.reason());
    }
    next_ += deep;
    at_ = 0;
    there_ = deep * layer_;
    return {};
  }

  ReadContext& context_;
  Hdf5Array& array_;
  std::size_t number_ = 1, layer_ = 1;  // bytes
  hsize_t layers_ = 0, deep_ = 1, next_ = 0;
  std::vector<std::byte> buffer_;
  std::size_t at_ = 0, there_ = 0;
};

}  // namespace

Result<VoxelVolume> read_hdf5_voxels(ReadContext& context) {
  Hdf5File file;
  if (auto opened = open_hdf5(context, file); !opened) return tl::unexpected(opened.error());
  const Hdf5Place place = hdf5_place(file.array);
  auto placed = placed_layout(context, place.axes);
  if (!placed) return tl::unexpected(placed.error());
  placed->layout.type = file.array.colours ? NumberType::kU32 : file.array.type;
  context.colours = file.array.colours;
  Hdf5Layers layers(context, file.array);
  if (auto begun = layers.begin(); !begun) return tl::unexpected(begun.error());
  return read_placed(context, *placed,
                     {{}, [&](std::byte* to, std::size_t bytes) { return layers.read(to, bytes); }},
                     place.placed);
}

Result<VoxelFileGrid> hdf5_grid(ReadContext& context) {
  Hdf5File file;
  if (auto opened = open_hdf5(context, file); !opened) return tl::unexpected(opened.error());
  const Hdf5Place place = hdf5_place(file.array);
  if (!place.placed) {
    return fail(ErrorCode::kInput, "{}: it does not say where its voxels lie", context.path);
  }
  auto grid = grid_of_axes(context.path, place.axes);
  if (!grid) return grid;
  grid->frame.unit_metres = place.unit_metres;
  grid->frame.space = place.space;
  return grid;
}

}  // namespace strata
