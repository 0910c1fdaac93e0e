// Files that scanners and microscopes write too, as readers that know nothing of the writers see
// them.

#ifdef STRATA_HAVE_HDF5
#include <hdf5.h>
#endif

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <sstream>
#include <stdexcept>

#include "tests/voxelize/formats/voxel_readers.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

void demand(bool condition, const std::string& what) {
  if (!condition) throw std::runtime_error(what);
}

template <class T>
T value_at(const std::string& data, std::size_t at) {
  demand(at + sizeof(T) <= data.size(), "cut off");
  T value;
  std::memcpy(&value, data.data() + at, sizeof value);
  return value;
}

ReadVoxels of_values(glm::ivec3 dims, const std::string& data, int bits) {
  ReadVoxels voxels;
  voxels.dims = dims;
  voxels.id_bits = bits;
  const auto bytes = static_cast<std::size_t>(bits / 8);
  const std::size_t count = static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) *
                            static_cast<std::size_t>(dims.z);
  demand(data.size() == count * bytes, "number of bytes");
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t value = 0;
    std::memcpy(&value, data.data() + i * bytes, bytes);
    voxels.ids.push_back(value);
    voxels.solid.push_back(value != 0);
  }
  return voxels;
}

/// `name = value` or `name: value`, a line each.
std::map<std::string, std::string> fields_of(const std::string& head, const std::string& between) {
  std::map<std::string, std::string> fields;
  std::istringstream stream(head);
  for (std::string line; std::getline(stream, line);) {
    if (const std::size_t at = line.find(between); at != std::string::npos) {
      fields[line.substr(0, at)] = line.substr(at + between.size());
    }
  }
  return fields;
}

std::vector<double> numbers(std::string text) {
  for (char& letter : text) {
    if (letter == '(' || letter == ')' || letter == ',') letter = ' ';
  }
  std::istringstream stream(text);
  std::vector<double> all;
  for (double number = 0; stream >> number;) all.push_back(number);
  return all;
}

glm::dvec3 three(const std::vector<double>& list, std::size_t from = 0, std::size_t step = 1) {
  demand(list.size() > from + 2 * step, "three numbers");
  return {list[from], list[from + step], list[from + 2 * step]};
}

}  // namespace

ReadVoxels read_nii(const std::string& path) {
  std::string data = testkit::bytes_of(path);
  if (data.starts_with("\x1f\x8b")) {
    data = inflate_all(data, 31, value_at<std::uint32_t>(data, data.size() - 4));
  }
  demand(value_at<std::int32_t>(data, 0) == 348 && data.substr(344, 4) == std::string("n+1\0", 4),
         "NIfTI-1");
  demand(value_at<std::int16_t>(data, 40) == 3, "dimensions");
  const glm::ivec3 dims(value_at<std::int16_t>(data, 42), value_at<std::int16_t>(data, 44),
                        value_at<std::int16_t>(data, 46));
  const int type = value_at<std::int16_t>(data, 70), bits = value_at<std::int16_t>(data, 72);
  const std::map<int, int> known = {{2, 8}, {512, 16}, {8, 32}, {16, 32}, {2304, 32}};
  demand(known.contains(type) && known.at(type) == bits, "type");
  ReadVoxels voxels =
      of_values(dims, data.substr(static_cast<std::size_t>(value_at<float>(data, 108))), bits);
  voxels.floats = type == 16;
  glm::dvec3 size, centre;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t row = 280 + 16 * static_cast<std::size_t>(axis);
    size[axis] = value_at<float>(data, row + 4 * static_cast<std::size_t>(axis));
    centre[axis] = value_at<float>(data, row + 12);
    demand(value_at<float>(data, 80 + 4 * static_cast<std::size_t>(axis)) ==
               static_cast<float>(size[axis]),
           "pixdim");
  }
  voxels.voxel_size = size;
  voxels.origin = centre - 0.5 * size;
  return voxels;
}

ReadVoxels read_mha(const std::string& path) {
  const std::string data = testkit::bytes_of(path);
  const std::string last = "ElementDataFile = LOCAL\n";
  const std::size_t end = data.find(last);
  demand(data.starts_with("ObjectType = Image\n") && end != std::string::npos, "head");
  auto fields = fields_of(data.substr(0, end), " = ");
  const std::map<std::string, int> bits = {
      {"MET_UCHAR", 8}, {"MET_USHORT", 16}, {"MET_UINT", 32}, {"MET_FLOAT", 32}};
  const int channels = fields.contains("ElementNumberOfChannels") ? 4 : 1;
  const int number = bits.at(fields.at("ElementType"));
  const glm::ivec3 dims = three(numbers(fields.at("DimSize")));
  std::string voxel_data = data.substr(end + last.size());
  if (fields.at("CompressedData") == "True") {
    demand(std::stoull(fields.at("CompressedDataSize")) == voxel_data.size(), "packed size");
    voxel_data = inflate_all(voxel_data, 15,
                             static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) *
                                 static_cast<std::size_t>(dims.z * number / 8 * channels));
  }
  ReadVoxels voxels = of_values(dims, voxel_data, number * channels);
  voxels.floats = fields.at("ElementType") == "MET_FLOAT";
  demand(fields.at("TransformMatrix") == "1 0 0 0 1 0 0 0 1", "matrix");
  voxels.voxel_size = three(numbers(fields.at("ElementSpacing")));
  voxels.origin = three(numbers(fields.at("Offset"))) - 0.5 * *voxels.voxel_size;
  return voxels;
}

ReadVoxels read_raw(const std::string& path) {
  auto fields = fields_of(testkit::bytes_of(path + ".nhdr"), ": ");
  demand(fields.at("data file") == path.substr(path.rfind('/') + 1), "data file");
  demand(fields.at("encoding") == "raw", "encoding");
  const std::string type = fields.at("type");
  const bool colours = fields.at("dimension") == "4";
  const int bits = type == "float" ? 32 : std::stoi(type.substr(4));
  demand(bits == 8 || fields.at("endian") == "little", "endian");
  ReadVoxels voxels = of_values(three(numbers(fields.at("sizes")), colours ? 1 : 0),
                                testkit::bytes_of(path), bits * (colours ? 4 : 1));
  voxels.floats = type == "float";
  std::string steps = fields.at("space directions");
  if (colours) steps = steps.substr(5);
  voxels.voxel_size = three(numbers(steps), 0, 4);
  voxels.origin = three(numbers(fields.at("space origin"))) - 0.5 * *voxels.voxel_size;
  return voxels;
}

namespace {

/// A directory of a classic TIFF: tag -> numbers, or the bytes of a text.
struct TiffDirectory {
  std::map<int, std::vector<std::uint64_t>> numbers;
  std::string description;
  std::uint32_t next = 0;
};

TiffDirectory tiff_directory(const std::string& data, std::size_t at) {
  TiffDirectory result;
  const int entries = value_at<std::uint16_t>(data, at);
  int before = 0;
  for (int entry = 0; entry < entries; ++entry) {
    const std::size_t place = at + 2 + 12 * static_cast<std::size_t>(entry);
    const int tag = value_at<std::uint16_t>(data, place),
              type = value_at<std::uint16_t>(data, place + 2);
    demand(tag > before, "order of the tags");
    before = tag;
    const std::size_t count = value_at<std::uint32_t>(data, place + 4);
    const std::size_t size = type == 2 ? 1 : type == 3 ? 2 : type == 4 ? 4 : 8;
    const std::size_t from =
        size * count <= 4 ? place + 8 : value_at<std::uint32_t>(data, place + 8);
    if (type == 2) result.description = data.substr(from, count);
    for (std::size_t i = 0; i < count && type != 2; ++i) {
      std::uint64_t number = 0;
      demand(from + (i + 1) * size <= data.size(), "values of a tag");
      std::memcpy(&number, data.data() + from + i * size, size);
      result.numbers[tag].push_back(number);
    }
  }
  result.next = value_at<std::uint32_t>(data, at + 2 + 12 * static_cast<std::size_t>(entries));
  return result;
}

}  // namespace

ReadVoxels read_tif(const std::string& path) {
  const std::string data = testkit::bytes_of(path);
  demand(data.starts_with(std::string("II\x2a\0", 4)), "a little-endian TIFF");
  std::string values, description;
  glm::ivec3 dims(0);
  std::size_t bits = 0;
  bool floats = false, flags = true;
  for (std::size_t at = value_at<std::uint32_t>(data, 4); at != 0; ++dims.z) {
    TiffDirectory page = tiff_directory(data, at);
    if (dims.z == 0) description = page.description;
    dims.x = static_cast<int>(page.numbers.at(256).at(0));
    dims.y = static_cast<int>(page.numbers.at(257).at(0));
    bits = page.numbers.at(258).at(0) * page.numbers.at(277).at(0);
    floats = page.numbers.at(339).at(0) == 3;
    for (std::size_t strip = 0; strip < page.numbers.at(273).size(); ++strip) {
      const std::string bytes =
          data.substr(page.numbers.at(273)[strip], page.numbers.at(279).at(strip));
      const bool packed = page.numbers.at(259).at(0) == 8;
      values += packed ? inflate_all(bytes, 15,
                                     static_cast<std::size_t>(dims.x) *
                                         static_cast<std::size_t>(dims.y) * bits / 8)
                       : bytes;
    }
    at = page.next;
  }
  ReadVoxels voxels = of_values(dims, values, static_cast<int>(bits));
  voxels.floats = floats;
  for (const std::uint32_t value : voxels.ids) flags = flags && (value == 0 || value == 255);
  for (std::size_t i = 0; i < voxels.ids.size() && flags && bits == 8; ++i) {
    voxels.solid[i] = voxels.ids[i] == 255;
  }
  auto fields = fields_of(description, "=");
  voxels.origin = three(numbers(fields.at("strata_origin")));
  voxels.voxel_size = three(numbers(fields.at("strata_voxel_size")));
  demand(std::stoi(fields.at("slices")) == dims.z, "slices");
  return voxels;
}

ReadVoxels read_h5(const std::string& path) {
#ifdef STRATA_HAVE_HDF5
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  demand(file >= 0, "an HDF5 file");
  const hid_t set = H5Dopen2(file, "voxels", H5P_DEFAULT), space = H5Dget_space(set);
  const hid_t type = H5Dget_type(set);
  std::array<hsize_t, 4> shape{0, 0, 0, 1};
  const int rank = H5Sget_simple_extent_dims(space, shape.data(), nullptr);
  demand(rank == 3 || (rank == 4 && shape[3] == 4), "shape");
  const std::size_t bytes = H5Tget_size(type) * shape[3];
  std::string values(shape[0] * shape[1] * shape[2] * bytes, '?');
  demand(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0, "values");
  ReadVoxels voxels = of_values(
      {static_cast<int>(shape[2]), static_cast<int>(shape[1]), static_cast<int>(shape[0])}, values,
      8 * static_cast<int>(bytes));
  voxels.floats = H5Tget_class(type) == H5T_FLOAT;
  demand(voxels.floats || H5Tget_sign(type) == H5T_SGN_NONE, "unsigned numbers");
  const auto three_of = [&](const char* name) {
    const hid_t attribute = H5Aopen(set, name, H5P_DEFAULT);
    glm::dvec3 numbers(0.0);
    demand(H5Aread(attribute, H5T_NATIVE_DOUBLE, &numbers.x) >= 0, name);
    H5Aclose(attribute);
    return numbers;
  };
  voxels.origin = three_of("origin");
  voxels.voxel_size = three_of("spacing");
  H5Tclose(type), H5Sclose(space), H5Dclose(set), H5Fclose(file);
  return voxels;
#else
  throw std::runtime_error("no HDF5 for " + path);
#endif
}

}  // namespace strata::testing
