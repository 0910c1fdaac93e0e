#include <fmt/format.h>

#include <utility>

#include "bench/contenders.h"
#include "strata/voxelize/voxelize.h"

namespace strata::bench {
namespace {

class IntervalSet : public VoxelSet {
 public:
  explicit IntervalSet(VoxelIntervals intervals) : intervals_(std::move(intervals)) {}
  [[nodiscard]] std::uint64_t solid_voxels() const override { return intervals_.solid_voxels(); }

 private:
  VoxelIntervals intervals_;
};

class Strata : public Contender {
 public:
  Strata(StoreKind store, int threads, bool closed) : threads_(threads) {
    options_.store = store;
    options_.closedness = closed ? Closedness::kAssumeClosed : Closedness::kAssumeOpen;
  }
  [[nodiscard]] std::string name() const override {
    switch (options_.store) {
      case StoreKind::kHaBuffer:
        return "strata ha";
      case StoreKind::kCountScan:
        return "strata scan";
      default:
        return "strata";
    }
  }
  [[nodiscard]] int threads() const override { return threads_; }
  std::shared_ptr<VoxelSet> voxelize(const TriangleSoup& mesh, const VoxelGrid& grid) override {
    Execution execution;
    execution.threads = threads_;
    auto intervals = strata::voxelize(mesh, grid, options_, execution);
    if (!intervals) {
      fmt::print(stderr, "bench: strata: {}\n", intervals.error().message);
      return nullptr;
    }
    return std::make_shared<IntervalSet>(std::move(*intervals));
  }

 private:
  VoxelizeOptions options_;
  int threads_;
};

}  // namespace

std::unique_ptr<Contender> make_strata(StoreKind store, int threads, bool closed) {
  return std::make_unique<Strata>(store, threads, closed);
}

}  // namespace strata::bench
