#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "strata/core/file_identity.h"
#include "strata/mesh/mesh_attributes.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// The mesh files Strata reads by itself.
enum class MeshFormat {
  kAuto,  ///< by the extension of the path
  kObj,   ///< Wavefront OBJ: v and f statements; all else is skipped
  kStl,   ///< STL, ascii or binary, distinguished by size; the size overrules a wrong count
  kPly,   ///< PLY 1.0, ascii or binary of either byte order: faces and triangle strips
  kOff,   ///< Object File Format, ascii, with the prefixes ST, C, N, 4 in any order
  k3mf,   ///< 3MF, all objects of the build; not from memory or standard input, nor written here
  kAmf,   ///< AMF, plain or zipped; likewise
  kGltf   ///< glTF 2.0, .gltf or .glb by content; not written
};

/// Who reads the file.
enum class MeshReader {
  kOwn,      ///< the readers of this folder
  kOpenMesh  ///< OpenMesh, for comparison; it rounds positions to float
};

/// How to read.
struct MeshReadOptions {
  MeshFormat format = MeshFormat::kAuto;  ///< of the file
  MeshReader reader = MeshReader::kOwn;   ///< the library that reads it
  /// A face that would be dropped and counted (vertex out of range, not finite, fewer than three
  /// vertices) is ErrorCode::kInput instead.
  bool strict = false;
  /// Text of OBJ and ascii STL is parsed in pieces of about this many bytes, on all threads. The
  /// mesh does not depend on it; tests make it small.
  std::size_t chunk_bytes = std::size_t{1} << 19;
  /// Parts, materials and colours are read too, into MeshFile::attributes.
  bool attributes = false;
  bool list_parts = false;  ///< parts are read, with or without the other attributes
  bool textures = true;     ///< with `attributes`: pictures are read; else materials have none
  /// Names of the parts to keep; empty: all. Parts of OBJ, STL, 3MF, AMF and glTF files have names.
  /// A name also keeps the parts whose names begin with it and "/": the groups of an OBJ object.
  std::vector<std::string> parts{};
  /// Files that a mesh names (materials, textures, buffers) must lie in this folder, links
  /// followed; empty: any folder.
  std::string root{};

  /// Whether a reader fills MeshAttributes::parts and part_ranges.
  [[nodiscard]] bool wants_parts() const { return attributes || list_parts || !parts.empty(); }
};

/// Statistics of the reader. Dropped faces are counted by cause, one cause per face, in the order
/// of the fields. diagnose() counts faces without area, duplicates and open edges.
struct MeshReadStats {
  std::string format;           ///< "obj", "stl ascii", "stl binary", "ply ascii", ...
  std::uint64_t bytes = 0;      ///< size of the file
  std::uint64_t vertices = 0;   ///< in the soup (STL: after welding)
  std::uint64_t faces = 0;      ///< face elements of the file, polygons counted once
  std::uint64_t triangles = 0;  ///< in the soup

  std::uint64_t too_few_vertices = 0;  ///< faces dropped: fewer than three vertices
  std::uint64_t out_of_range = 0;      ///< faces dropped: an index is not that of a vertex
  std::uint64_t non_finite = 0;        ///< faces dropped: a coordinate is NaN or infinite
  std::uint64_t degenerate = 0;        ///< triangles dropped: two corners are the same vertex
  std::uint64_t ignored = 0;           ///< elements that are not faces: lines, points, edges
  std::uint64_t non_planar =
      0;  ///< polygons that deviate from a plane by more than 1/1000 of their size
  std::vector<std::string> warnings;  ///< sentences with places, for the user
  std::vector<std::string> missing;   ///< sentences: files that it names and that are not there
  double unit_metres = 0.0;  ///< length of the file's unit in metres; 0: the file does not say
  bool y_up = false;         ///< the format says that y is up: glTF

  /// Faces of the file that are missing in the soup, wholly or in part, because of bad data.
  [[nodiscard]] std::uint64_t dropped_faces() const {
    return too_few_vertices + out_of_range + non_finite;
  }
};

/// A mesh and how its reading went.
struct MeshFile {
  TriangleSoup soup;                 ///< its triangles
  MeshReadStats stats;               ///< counts and warnings
  MeshAttributes attributes;         ///< as MeshReadOptions asks
  std::vector<FileIdentity> opened;  ///< other files that were read: materials, textures, buffers
};

}  // namespace strata
