#pragma once

#include <cstdint>
#include <vector>

#include "strata/voxelize/output/voxel_output.h"
#include "voxelize/output/block_output.h"
#include "voxelize/output/dense_values.h"

namespace strata {

/// The layers of a voxel set as PNG pictures (PNG, second edition, ISO/IEC 15948:2004): bits, ids,
/// greys or colours. Made from the runs: libpng, whose deflate looks at every byte, takes 0.4 ms a
/// layer of 1024 x 1024 at its fastest setting, this a tenth of it and less. (Internal to
/// voxelize/.)
class LayerPictures {
 public:
  LayerPictures(const VoxelGrid& grid, const VoxelWriterOptions& options);

  /// Axis of the intervals that make() takes.
  [[nodiscard]] Axis runs() const { return columns_ == 1 ? Axis::kY : Axis::kX; }
  /// Whether make() needs the whole set; else the slab with the layer will do.
  [[nodiscard]] bool needs_all() const { return layer_ != 2; }
  [[nodiscard]] int count() const { return dims_[layer_]; }
  [[nodiscard]] glm::ivec2 size() const { return size_; }
  /// Members of slices.json that say where a voxel is.
  [[nodiscard]] std::string description() const;

  /// The file of a layer. Several threads may call it. @return sum of the labels of its voxels
  std::uint64_t make(const VoxelIntervals& set, int layer, Bytes& out) const;

 private:
  template <class Run>
  void for_each_run(const VoxelIntervals& set, int u, int v, Run&& run) const;
  [[nodiscard]] std::uint32_t grey(std::uint32_t label) const;

  DenseValues values_;
  LayerOptions options_;
  glm::ivec3 dims_;
  int layer_, columns_, rows_;        // axes
  glm::ivec2 size_;                   // pixels
  glm::ivec2 corner_;                 // pixels before the layer, to the left and above
  std::vector<std::uint32_t> least_;  // with gamma: the least label of grey i + 1
};

}  // namespace strata
