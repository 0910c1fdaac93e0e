#include "tests/voxelize/formats/voxel_readers.h"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

// The text is a view, since this is asked for every voxel.
void require(bool condition, std::string_view what) {
  if (!condition) throw std::runtime_error(std::string(what));
}

std::size_t volume(glm::ivec3 dims) {
  return static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) *
         static_cast<std::size_t>(dims.z);
}

ReadVoxels of_size(glm::ivec3 dims) {
  ReadVoxels voxels;
  voxels.dims = dims;
  voxels.solid.resize(volume(dims));
  voxels.ids.resize(volume(dims));
  return voxels;
}

std::string match(const std::string& text, const std::string& pattern) {
  std::smatch found;
  require(std::regex_search(text, found, std::regex(pattern)), "no match for " + pattern);
  return found[1];
}

template <class Vector>
Vector vector_of(std::string text) {
  for (char& letter : text) {
    if (letter == ',') letter = ' ';
  }
  std::istringstream stream(text);
  Vector value;
  stream >> value.x >> value.y >> value.z;
  require(static_cast<bool>(stream), "no three numbers: " + text);
  return value;
}

/// The sizes along x, y, z; of colours a 4 stands before or after them.
glm::ivec3 sizes_of(std::string text, bool colours, bool colours_first = true) {
  if (!colours) return vector_of<glm::ivec3>(text);
  for (char& letter : text) {
    if (letter == ',') letter = ' ';
  }
  std::istringstream stream(text);
  std::vector<int> sizes;
  for (int size = 0; stream >> size;) sizes.push_back(size);
  require(sizes.size() == 4 && sizes[colours_first ? 0 : 3] == 4, "sizes of colours: " + text);
  const std::size_t x = colours_first ? 1 : 0;
  return {sizes[x], sizes[x + 1], sizes[x + 2]};
}

template <class T>
T number_at(const std::string& data, std::size_t position) {
  require(position + sizeof(T) <= data.size(), "truncated");
  T value;
  std::memcpy(&value, data.data() + position, sizeof value);
  return value;
}

// Little-endian values of voxels.id_bits.
void take_value(ReadVoxels& voxels, const std::string& data, std::size_t from, std::size_t to) {
  const auto bytes = static_cast<std::size_t>(voxels.id_bits / 8);
  std::uint32_t value = 0;
  std::memcpy(&value, data.data() + from * bytes, bytes);
  voxels.ids[to] = value;
  voxels.solid[to] = static_cast<std::uint8_t>(bytes == 1 ? value : value != 0);
}

void take_dense(ReadVoxels& voxels, const std::string& data) {
  require(data.size() == voxels.solid.size() * static_cast<std::size_t>(voxels.id_bits / 8),
          "wrong number of voxels");
  for (std::size_t i = 0; i < voxels.solid.size(); ++i) take_value(voxels, data, i, i);
}

}  // namespace

std::string inflate_all(const std::string& data, int window_bits, std::size_t expected) {
  z_stream stream{};
  require(inflateInit2(&stream, window_bits) == Z_OK, "inflateInit2");
  std::string out(expected + 1, '\0');  // one more, to see a longer one
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
  stream.avail_in = static_cast<uInt>(data.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int status = inflate(&stream, Z_FINISH);
  const std::string message = stream.msg != nullptr ? stream.msg : "";
  const std::size_t size = stream.total_out;
  const bool all_read = stream.avail_in == 0;
  inflateEnd(&stream);
  require(status == Z_STREAM_END, "inflate: " + std::to_string(status) + " " + message);
  require(all_read, "bytes after the end of the stream");
  out.resize(size);
  return out;
}

namespace {

ReadVoxels parse_npy(const std::string& data) {
  require(data.starts_with(std::string("\x93NUMPY\x01\x00", 8)), "magic");
  const auto length = number_at<std::uint16_t>(data, 8);
  require((10 + length) % 64 == 0, "alignment");
  const std::string header = data.substr(10, length);
  require(header.ends_with('\n'), "end of header");
  const std::string type = match(header, "'descr': '([^']*)'");
  require(type == "|b1" || type == "|u1" || type == "<u2" || type == "<u4" || type == "<f4",
          "type");
  require(match(header, "'fortran_order': (\\w+)") == "True", "order");
  const std::string shape = match(header, "'shape': \\(([^)]*)\\)");
  const bool colours = shape.starts_with("4, ") && std::count(shape.begin(), shape.end(), ',') == 3;
  auto voxels = of_size(sizes_of(shape, colours));
  voxels.id_bits = 8 * (type[2] - '0') * (colours ? 4 : 1);
  voxels.floats = type == "<f4";
  if (type == "|b1") voxels.id_bits = 8;
  take_dense(voxels, data.substr(10 + std::size_t{length}));
  return voxels;
}

/// The entries of a ZIP by its directory, as Python's zipfile reads it. The local heads have to say
/// the same, or that what they lack follows the data.
std::map<std::string, std::string> read_zip(const std::string& data) {
  const std::size_t end = data.rfind(std::string("PK\x05\x06", 4));
  require(end != std::string::npos && end + 22 == data.size(), "end of the directory");
  const auto size = number_at<std::uint32_t>(data, end + 12);
  std::uint64_t at = number_at<std::uint32_t>(data, end + 16);
  if (at == 0xffffffff) {
    require(data.substr(end - 20, 4) == std::string("PK\x06\x07", 4), "locator");
    const auto record = number_at<std::uint64_t>(data, end - 12);
    require(data.substr(record, 4) == std::string("PK\x06\x06", 4), "64-bit end");
    at = number_at<std::uint64_t>(data, record + 48);
    require(at + size == record, "size of the directory");
  } else {
    require(at + size == end, "size of the directory");
  }
  std::map<std::string, std::string> entries;
  for (int count = number_at<std::uint16_t>(data, end + 10); count > 0; --count) {
    require(data.substr(at, 4) == std::string("PK\x01\x02", 4), "directory");
    const auto flags = number_at<std::uint16_t>(data, at + 8);
    const auto method = number_at<std::uint16_t>(data, at + 10);
    const auto crc = number_at<std::uint32_t>(data, at + 16);
    std::uint64_t packed = number_at<std::uint32_t>(data, at + 20);
    std::uint64_t bytes = number_at<std::uint32_t>(data, at + 24);
    const std::size_t name = number_at<std::uint16_t>(data, at + 28);
    const std::size_t extra = number_at<std::uint16_t>(data, at + 30);
    const std::size_t head = number_at<std::uint32_t>(data, at + 42);
    if (bytes == 0xffffffff) {
      require(extra == 20 && number_at<std::uint16_t>(data, at + 46 + name) == 1, "64-bit sizes");
      bytes = number_at<std::uint64_t>(data, at + 50 + name);
      packed = number_at<std::uint64_t>(data, at + 58 + name);
    }
    require(data.substr(head, 4) == std::string("PK\x03\x04", 4), "local head");
    require(data.substr(head + 30, name) == data.substr(at + 46, name), "local name");
    require((flags & 8) != 0 || data.substr(head + 14, 12) == data.substr(at + 16, 12), "sizes");
    const std::size_t begin = head + 30 + name + number_at<std::uint16_t>(data, head + 28);
    std::string content = data.substr(begin, packed);
    if (method != 0) content = inflate_all(content, -15, bytes);
    require(content.size() == bytes, "size of an entry");
    require(
        crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(bytes)) == crc,
        "checksum of an entry");
    if ((flags & 8) != 0)
      require(number_at<std::uint32_t>(data, begin + packed + 4) == crc, "after");
    require(entries.emplace(data.substr(at + 46, name), content).second, "name given twice");
    at += 46 + name + extra;
  }
  return entries;
}

glm::dvec3 three_doubles(const std::string& npy) {
  const std::size_t length = number_at<std::uint16_t>(npy, 8);
  require(
      match(npy, "'descr': '([^']*)'") == "<f8" && match(npy, "'shape': (\\([^)]*\\))") == "(3,)",
      "three doubles");
  require(npy.size() == 10 + length + 24, "size");
  return {number_at<double>(npy, 10 + length), number_at<double>(npy, 18 + length),
          number_at<double>(npy, 26 + length)};
}

}  // namespace

ReadVoxels read_npy(const std::string& path) { return parse_npy(testkit::bytes_of(path)); }

ReadVoxels read_npz(const std::string& path) {
  const auto arrays = read_zip(testkit::bytes_of(path));
  require(arrays.size() == 3, "three arrays");
  auto voxels = parse_npy(arrays.at("voxels.npy"));
  voxels.origin = three_doubles(arrays.at("origin.npy"));
  voxels.voxel_size = three_doubles(arrays.at("spacing.npy"));
  return voxels;
}

ReadVoxels read_nrrd(const std::string& path) {
  const std::string data = testkit::bytes_of(path);
  require(data.starts_with("NRRD0004\n"), "magic");
  const std::size_t end = data.find("\n\n");
  require(end != std::string::npos, "end of header");
  const std::string header = data.substr(0, end + 1);
  const std::string type = match(header, "\ntype: (.*)\n");
  require(type == "uint8" || match(header, "\nendian: (.*)\n") == "little", "endian");
  require(match(header, "\nencoding: (.*)\n") == "gzip", "encoding");
  const bool colours = match(header, "\ndimension: (.*)\n") == "4";
  auto voxels = of_size(sizes_of(match(header, "\nsizes: (.*)\n"), colours));
  require(match(header, "\nkinds: (.*)\n") ==
              (colours ? "RGBA-color domain domain domain" : "domain domain domain"),
          "kinds");
  std::smatch axes;
  require(std::regex_search(
              header, axes,
              std::regex("space directions: (?:none )?\\(([^,]*),0,0\\) \\(0,([^,]*),0\\) "
                         "\\(0,0,([^)]*)\\)\n")),
          "space directions");
  voxels.voxel_size = glm::dvec3(std::stod(axes[1]), std::stod(axes[2]), std::stod(axes[3]));
  voxels.origin =
      vector_of<glm::dvec3>(match(header, "space origin: \\((.*)\\)")) - 0.5 * *voxels.voxel_size;
  voxels.floats = type == "float";
  voxels.id_bits = (voxels.floats ? 32 : std::stoi(match(type, "uint(.*)"))) * (colours ? 4 : 1);
  const std::size_t bytes = voxels.solid.size() * static_cast<std::size_t>(voxels.id_bits / 8);
  take_dense(voxels, inflate_all(data.substr(end + 2), 31, bytes));
  return voxels;
}

ReadVoxels read_vti(const std::string& path) {
  const std::string data = testkit::bytes_of(path);
  const std::string marker = "<AppendedData encoding=\"raw\">\n_";
  const std::size_t begin = data.find(marker);
  require(begin != std::string::npos, "appended data");
  const std::string header = data.substr(0, begin);
  require(match(header, "header_type=\"(\\w+)\"") == "UInt64", "header type");
  const std::string type = match(header, "DataArray type=\"(\\w+)\"");
  std::istringstream extent(match(header, "WholeExtent=\"([^\"]*)\""));
  glm::ivec3 low, high;
  extent >> low.x >> high.x >> low.y >> high.y >> low.z >> high.z;
  require(extent && low == glm::ivec3(0), "extent");
  auto voxels = of_size(high);
  voxels.floats = type == "Float32";
  voxels.id_bits = std::stoi(match(type, "(?:UInt|Float)(.*)"));
  if (header.find("NumberOfComponents=\"4\"") != std::string::npos) voxels.id_bits *= 4;
  voxels.origin = vector_of<glm::dvec3>(match(header, "Origin=\"([^\"]*)\""));
  voxels.voxel_size = vector_of<glm::dvec3>(match(header, "Spacing=\"([^\"]*)\""));

  std::size_t at = begin + marker.size();
  const auto next = [&] {
    const auto value = number_at<std::uint64_t>(data, at);
    at += sizeof value;
    return static_cast<std::size_t>(value);
  };
  std::string dense;
  if (header.find("compressor=\"vtkZLibDataCompressor\"") != std::string::npos) {
    const std::size_t blocks = next(), block = next(), last = next();
    std::vector<std::size_t> sizes(blocks);
    for (std::size_t& size : sizes) size = next();
    for (std::size_t i = 0; i < blocks; ++i) {
      const std::size_t expected = i + 1 == blocks && last != 0 ? last : block;
      const std::string piece = inflate_all(data.substr(at, sizes[i]), 15, expected);
      require(piece.size() == expected, "size of a block");
      dense += piece;
      at += sizes[i];
    }
  } else {
    const std::size_t bytes = next();
    dense = data.substr(at, bytes);
    at += bytes;
  }
  require(data.substr(at) == "\n  </AppendedData>\n</VTKFile>\n", "end of the file");
  take_dense(voxels, dense);
  return voxels;
}

ReadVoxels read_binvox(const std::string& path, glm::ivec3 dims) {
  const std::string data = testkit::bytes_of(path);
  const std::size_t end = data.find("\ndata\n");
  require(data.starts_with("#binvox 1\n") && end != std::string::npos, "header");
  const std::string header = data.substr(0, end + 1);
  const auto sizes = vector_of<glm::ivec3>(match(header, "\ndim (.*)\n"));  // depth height width
  require(sizes == glm::ivec3(std::max({dims.x, dims.y, dims.z})), "a cube around the grid");
  auto voxels = of_size(dims);
  voxels.origin = vector_of<glm::dvec3>(match(header, "\ntranslate (.*)\n"));
  voxels.voxel_size = glm::dvec3(std::stod(match(header, "\nscale (.*)\n")) /
                                 std::max({sizes.x, sizes.y, sizes.z}));
  // As read_binvox.cc has it: index = x * width * height + z * width + y.
  std::size_t index = 0;
  const auto width = static_cast<std::size_t>(sizes.z), height = static_cast<std::size_t>(sizes.y);
  for (std::size_t at = end + 6; at < data.size(); at += 2) {
    const auto value = number_at<std::uint8_t>(data, at);
    const auto count = number_at<std::uint8_t>(data, at + 1);
    require(value <= 1 && count > 0, "run");
    for (int i = 0; i < count; ++i, ++index) {
      const glm::ivec3 voxel(index / (width * height), index % width, index / width % height);
      if (voxel.x < dims.x && voxel.y < dims.y && voxel.z < dims.z) {
        voxels.solid[voxels.index(voxel.x, voxel.y, voxel.z)] = value;
      } else {
        require(value == 0, "voxel outside of the grid");
      }
    }
  }
  require(index == volume(sizes), "number of voxels");
  return voxels;
}

namespace {

/// What the chunks of a .vox file say.
struct VoxScene {
  struct Model {
    glm::ivec3 size{0};
    std::string voxels;
  };
  std::vector<Model> models;
  std::map<int, std::vector<int>> children;  // nTRN and nGRP
  std::map<int, glm::ivec3> translations;    // nTRN
  std::map<int, int> shapes;                 // nSHP: model

  void place(int node, glm::ivec3 at, ReadVoxels& voxels) const {
    if (const auto found = translations.find(node); found != translations.end()) {
      at += found->second;
    }
    if (const auto found = children.find(node); found != children.end()) {
      for (const int child : found->second) place(child, at, voxels);
    }
    if (const auto found = shapes.find(node); found != shapes.end()) {
      const Model& model = models.at(static_cast<std::size_t>(found->second));
      const glm::ivec3 corner = at - model.size / 2;  // the editor cuts off what lies beyond
      for (int axis = 0; axis < 3; ++axis) {
        require(corner[axis] >= -1000 && corner[axis] + model.size[axis] <= 1000, "editor's range");
      }
      put(model, corner + voxels.dims / 2, voxels);
    }
  }
  static void put(const Model& model, glm::ivec3 corner, ReadVoxels& voxels) {
    for (std::size_t i = 0; i < model.voxels.size(); i += 4) {
      glm::ivec3 at(0);
      for (int axis = 0; axis < 3; ++axis) {
        const int local =
            static_cast<unsigned char>(model.voxels[i + static_cast<std::size_t>(axis)]);
        require(local < model.size[axis], "voxel outside of its model");
        at[axis] = corner[axis] + local;
        require(at[axis] >= 0 && at[axis] < voxels.dims[axis], "voxel outside of the grid");
      }
      require(model.voxels[i + 3] != 0, "colour 0 is empty");
      std::uint8_t& voxel = voxels.solid[voxels.index(at.x, at.y, at.z)];
      require(voxel == 0, "voxel given twice");
      voxel = 1;
      voxels.ids[voxels.index(at.x, at.y, at.z)] = static_cast<unsigned char>(model.voxels[i + 3]);
    }
  }
};

/// Reads the content of a chunk.
struct VoxContent {
  const std::string& data;
  std::size_t at = 0;

  int number() {
    at += 4;
    return number_at<std::int32_t>(data, at - 4);
  }
  std::string text() {
    const auto length = static_cast<std::size_t>(number());
    at += length;
    require(at <= data.size(), "truncated text");
    return data.substr(at - length, length);
  }
  std::map<std::string, std::string> dictionary() {
    std::map<std::string, std::string> result;
    for (int pairs = number(); pairs > 0; --pairs) {
      const std::string key = text();
      result[key] = text();
    }
    return result;
  }
};

void read_vox_chunk(const std::string& id, const std::string& content, VoxScene& scene) {
  VoxContent reader{content};
  if (id == "SIZE") {
    glm::ivec3 size;
    size.x = reader.number();
    size.y = reader.number();
    size.z = reader.number();
    require(size.x <= 256 && size.y <= 256 && size.z <= 256, "size of a model");
    scene.models.push_back({size, ""});
  } else if (id == "XYZI") {
    const auto count = static_cast<std::size_t>(reader.number());
    require(content.size() == 4 + 4 * count, "size of XYZI");
    scene.models.back().voxels = content.substr(4);
  } else if (id == "nTRN") {
    const int node = reader.number();
    reader.dictionary();
    scene.children[node] = {reader.number()};
    require(reader.number() == -1, "reserved");
    reader.number();  // layer
    require(reader.number() == 1, "frames");
    const auto frame = reader.dictionary();
    if (frame.contains("_t")) scene.translations[node] = vector_of<glm::ivec3>(frame.at("_t"));
  } else if (id == "nGRP") {
    const int node = reader.number();
    reader.dictionary();
    for (int count = reader.number(); count > 0; --count) {
      scene.children[node].push_back(reader.number());
    }
  } else if (id == "nSHP") {
    const int node = reader.number();
    reader.dictionary();
    require(reader.number() == 1, "models of a shape");
    scene.shapes[node] = reader.number();
    reader.dictionary();
  } else {
    require(false, "chunk " + id);
  }
}

}  // namespace

ReadVoxels read_vox(const std::string& path, glm::ivec3 dims) {
  const std::string data = testkit::bytes_of(path);
  require(data.starts_with("VOX "), "magic");
  require(number_at<std::int32_t>(data, 4) == 150, "version");
  require(data.substr(8, 4) == "MAIN" && number_at<std::int32_t>(data, 12) == 0, "MAIN");
  require(20 + static_cast<std::size_t>(number_at<std::int32_t>(data, 16)) == data.size(),
          "size of the children");
  VoxScene scene;
  for (std::size_t at = 20; at < data.size();) {
    const auto bytes = static_cast<std::size_t>(number_at<std::int32_t>(data, at + 4));
    require(number_at<std::int32_t>(data, at + 8) == 0, "children of a chunk");
    read_vox_chunk(data.substr(at, 4), data.substr(at + 12, bytes), scene);
    at += 12 + bytes;
    require(at <= data.size(), "truncated chunk");
  }
  auto voxels = of_size(dims);
  require(!scene.models.empty(), "no model");
  if (scene.children.empty()) {
    require(scene.models.size() == 1 && scene.models[0].size == dims, "a single model is the grid");
    VoxScene::put(scene.models[0], glm::ivec3(0), voxels);
  } else {
    scene.place(0, glm::ivec3(0), voxels);
  }
  return voxels;
}

namespace {

// The values of an unfiltered picture of grey of 8 or 16 bits, or RGBA, by hand: libpng may
// convert.
void take_values(const std::string& file, int k, ReadVoxels& voxels) {
  voxels.id_bits = file[24];
  const bool colours = file[25] == 6;
  require(voxels.id_bits == 8 || (voxels.id_bits == 16 && !colours), "bits of a channel");
  if (colours) voxels.id_bits = 32;
  const std::size_t data = file.find("IDAT");
  const auto byte = [&](std::size_t at) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(file[at]));
  };
  const std::size_t length =
      byte(data - 4) << 24 | byte(data - 3) << 16 | byte(data - 2) << 8 | byte(data - 1);
  const auto bytes = static_cast<std::size_t>(voxels.id_bits / 8);
  const std::size_t row = static_cast<std::size_t>(voxels.dims.x) * bytes + 1;
  const std::string rows =
      inflate_all(file.substr(data + 4, length), 15, row * static_cast<std::size_t>(voxels.dims.y));
  for (int j = 0; j < voxels.dims.y; ++j) {
    std::size_t at = static_cast<std::size_t>(voxels.dims.y - 1 - j) * row;
    require(rows[at++] == 0, "filter");
    for (int i = 0; i < voxels.dims.x; ++i) {
      std::uint32_t value = 0;
      for (std::size_t b = 0; b < bytes; ++b, ++at) {
        const std::uint32_t one = static_cast<unsigned char>(rows[at]);
        value = colours ? value | one << 8 * b : value << 8 | one;
      }
      voxels.ids[voxels.index(i, j, k)] = value;
      voxels.solid[voxels.index(i, j, k)] = value != 0;
    }
  }
}

}  // namespace

ReadVoxels read_png_folder(const std::string& path) {
  const std::string json = testkit::bytes_of(path + "/slices.json");
  auto voxels = of_size(vector_of<glm::ivec3>(match(json, "\"dims\": \\[([^\\]]*)\\]")));
  voxels.origin = vector_of<glm::dvec3>(match(json, "\"origin\": \\[([^\\]]*)\\]"));
  voxels.voxel_size = vector_of<glm::dvec3>(match(json, "\"voxel_size\": \\[([^\\]]*)\\]"));
  require(match(json, "\"row_axis\": \"(.)\"") == "y" &&
              match(json, "\"row_order\": \"(\\w+)\"") == "descending",
          "rows");
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    files += entry.path().extension() == ".png" ? 1 : 0;
  }
  require(files == voxels.dims.z, "number of slices");
  for (int k = 0; k < voxels.dims.z; ++k) {
    std::array<char, 32> name;
    std::snprintf(name.data(), name.size(), "/slice_%05d.png", k);
    const std::string file = testkit::bytes_of(path + name.data());
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    require(png_image_begin_read_from_memory(&image, file.data(), file.size()) != 0, image.message);
    require(static_cast<int>(image.width) == voxels.dims.x &&
                static_cast<int>(image.height) == voxels.dims.y,
            "size of a slice");
    image.format = PNG_FORMAT_GRAY;
    std::vector<png_byte> pixels(PNG_IMAGE_SIZE(image));
    require(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr) != 0, image.message);
    require(image.warning_or_error == 0, image.message);
    require(file[25] == 0 || file[25] == 6, "grey or RGBA");
    if (file[24] != 1) {
      take_values(file, k, voxels);
      continue;
    }
    for (int j = 0; j < voxels.dims.y; ++j) {
      const auto row = static_cast<std::size_t>(voxels.dims.y - 1 - j);  // from the greatest y down
      for (int i = 0; i < voxels.dims.x; ++i) {
        const png_byte grey = pixels[row * image.width + static_cast<std::size_t>(i)];
        require(grey == 0 || grey == 255, "grey value");
        voxels.solid[voxels.index(i, j, k)] = grey == 255 ? 1 : 0;
      }
    }
  }
  return voxels;
}

ReadVoxels read_zarr(const std::string& path) {
  const std::string array = testkit::bytes_of(path + "/.zarray");
  const std::string attributes = testkit::bytes_of(path + "/.zattrs");
  const std::string type = match(array, "\"dtype\": \"([^\"]*)\"");
  require(type == "|u1" || type == "<u2" || type == "<u4" || type == "<f4", "type");
  require(match(array, "\"order\": \"(.)\"") == "C", "order");
  require(match(array, "\"id\": \"(\\w+)\"") == "zlib", "compressor");
  require(match(array, "\"zarr_format\": (\\d)") == "2", "version");
  const std::string shape = match(array, "\"shape\": \\[([^\\]]*)\\]");
  const bool colours = std::count(shape.begin(), shape.end(), ',') == 3;
  auto voxels = of_size(sizes_of(shape, colours, false));
  voxels.id_bits = 8 * (type[2] - '0') * (colours ? 4 : 1);
  voxels.floats = type == "<f4";
  const std::size_t value_bytes = static_cast<std::size_t>(voxels.id_bits / 8);
  const glm::ivec3 chunks = sizes_of(match(array, "\"chunks\": \\[([^\\]]*)\\]"), colours, false);
  voxels.origin = vector_of<glm::dvec3>(match(attributes, "\"origin\": \\[([^\\]]*)\\]"));
  voxels.voxel_size = vector_of<glm::dvec3>(match(attributes, "\"voxel_size\": \\[([^\\]]*)\\]"));
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    std::string name = entry.path().filename().string();
    if (name.starts_with('.')) continue;
    require(!colours || name.ends_with(".0"), "name of a chunk of colours");
    std::replace(name.begin(), name.end(), '.', ' ');
    const glm::ivec3 corner = vector_of<glm::ivec3>(name) * chunks;
    const std::size_t bytes = volume(chunks) * value_bytes;
    const std::string chunk = inflate_all(testkit::bytes_of(entry.path()), 15, bytes);
    require(chunk.size() == bytes, "size of a chunk");
    require(chunk.find_first_not_of('\0') != std::string::npos, "an empty chunk was written");
    std::size_t at = 0;
    for (int i = 0; i < chunks.x; ++i) {
      for (int j = 0; j < chunks.y; ++j) {
        for (int k = 0; k < chunks.z; ++k, ++at) {
          const glm::ivec3 index = corner + glm::ivec3(i, j, k);
          const bool inside =
              index.x < voxels.dims.x && index.y < voxels.dims.y && index.z < voxels.dims.z;
          if (inside) {
            take_value(voxels, chunk, at, voxels.index(index.x, index.y, index.z));
          } else {
            for (std::size_t b = 0; b < value_bytes; ++b) {
              require(chunk[at * value_bytes + b] == 0, "voxel outside of the grid");
            }
          }
        }
      }
    }
  }
  return voxels;
}

}  // namespace strata::testing
