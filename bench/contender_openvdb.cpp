#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "bench/contenders.h"
#include "bench/openvdb_solid.h"

namespace strata::bench {
namespace {

class MaskSet : public VoxelSet {
 public:
  explicit MaskSet(openvdb::BoolGrid::Ptr mask) : mask_(std::move(mask)) {}
  [[nodiscard]] std::uint64_t solid_voxels() const override { return mask_->activeVoxelCount(); }

 private:
  openvdb::BoolGrid::Ptr mask_;
};

class OpenVdb : public Contender {
 public:
  explicit OpenVdb(int threads) : threads_(threads) {}
  [[nodiscard]] std::string name() const override { return "OpenVDB"; }
  [[nodiscard]] int threads() const override { return threads_; }
  void prepare() override { openvdb::initialize(); }
  std::shared_ptr<VoxelSet> voxelize(const TriangleSoup& mesh, const VoxelGrid& grid) override {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads_));
    tbb::task_arena arena(threads_);
    return arena.execute([&] { return std::make_shared<MaskSet>(openvdb_solid(mesh, grid)); });
  }

 private:
  int threads_;
};

}  // namespace

std::unique_ptr<Contender> make_openvdb(int threads) { return std::make_unique<OpenVdb>(threads); }

}  // namespace strata::bench
