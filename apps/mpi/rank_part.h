#pragma once

#include "apps/mpi/peers.h"
#include "apps/voxelize/job_part.h"
#include "core/atomic_file.h"

namespace strata::apps {

/// One rank of `strata-mpi voxelize`. It takes rows of tiles from a counter, some at a time, until
/// all are taken. What the ranks write together lies under a temporary name of rank 0, which gives
/// it its name when all have finished.
class RankPart final : public JobPart {
 public:
  RankPart(Peers& peers, Session& session) : peers_(&peers), session_(&session) {}

  Result<void> check(const VoxelizeCommand& command, const VoxelizeOutcome& outcome) override;
  Result<std::unique_ptr<VoxelWriter>> open_writer(const VoxelizeCommand& command,
                                                   const VoxelizeOutcome& outcome,
                                                   const VoxelWriterOptions& file) override;
  Result<void> begin_pass(const VoxelizeOutcome& outcome, VoxelizeOptions& options) override;
  Result<void> end_pass(VoxelizeOutcome& outcome, const Result<void>& done) override;
  Result<void> finish(const VoxelizeCommand& command, VoxelizeOutcome& outcome, Session& session,
                      const Result<void>& done) override;
  [[nodiscard]] bool finds_walls() const override { return first(); }
  [[nodiscard]] bool tells_all() const override { return first(); }
  [[nodiscard]] bool reports() const override { return first(); }

  /// Collective: a success if all ranks have one. A rank that failed joins the next agreement, and
  /// none after it. @return rank 0: the first failure; others: theirs, or kCancelled
  Result<void> agree(const Result<void>& done);
  /// Whether an agreement failed: rank 0 tells why.
  [[nodiscard]] bool failed_together() const { return failed_; }

 private:
  [[nodiscard]] bool first() const { return peers_->rank() == 0; }
  Result<void> create(const VoxelizeCommand& command);
  Result<void> add_up(VoxelizeOutcome& outcome);
  Result<void> complete(const VoxelizeCommand& command, VoxelizeOutcome& outcome);

  Peers* peers_;
  Session* session_;
  bool failed_ = false;
  int passes_ = 0;                      ///< those that have begun
  std::uint64_t turns_ = 0;             ///< rows of tiles taken by this rank
  std::string format_;                  ///< of the output
  VoxelWriterOptions file_;             ///< what its voxels are
  std::optional<AtomicFolder> folder_;  ///< rank 0's, as file
  std::optional<AtomicFile> output_;
  std::string place_;  ///< the temporary name
  Peers::SharedFile shared_;
};

}  // namespace strata::apps
