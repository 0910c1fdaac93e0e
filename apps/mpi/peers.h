#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "strata/core/result.h"

namespace strata::apps {

/// Bytes of a rank's text that are gathered at a time: those of all ranks are counted by int.
[[nodiscard]] constexpr std::size_t gathered_at_once(std::size_t ranks) {
  constexpr std::size_t kMost = std::size_t{1} << 20, kAll = std::numeric_limits<int>::max();
  return ranks > kAll / kMost ? kAll / ranks : kMost;
}

/// The processes of an MPI job, the ranks. All calls of MPI are in peers.cpp. The functions that
/// say so are collective: every rank calls them, in the same order. Waiting asks `stopped` and ends
/// the process then, since a rank that is gone never answers.
class Peers {
 public:
  /// Joins the job. One at a time. @return kInternal naming MPI's reason
  static Result<Peers> join(int* argc, char*** argv);
  Peers(Peers&&) noexcept;
  Peers& operator=(Peers&&) = delete;
  /// Leaves the job; collective.
  ~Peers();

  [[nodiscard]] int rank() const;
  [[nodiscard]] int size() const;
  /// Ranks on this machine.
  [[nodiscard]] int on_this_machine() const;
  /// The MPI library lets several threads call it, one at a time.
  [[nodiscard]] bool threads_may_call() const;

  /// What waiting does besides: asked each time; true ends this process by leave().
  void set_stopped(std::function<bool()> stopped);
  /// Ends this process, with what it has not finished removed; mpirun ends the others.
  [[noreturn]] void leave() const;

  // Collective.
  /// The largest of the numbers of all.
  [[nodiscard]] std::uint64_t largest(std::uint64_t number) const;
  /// Sums, on rank 0. @pre all ranks give as many numbers
  [[nodiscard]] std::vector<std::uint64_t> sum(const std::vector<std::uint64_t>& numbers) const;
  /// The texts of all, on rank 0.
  [[nodiscard]] std::vector<std::string> gather(const std::string& text) const;
  /// The text of rank 0.
  [[nodiscard]] std::string broadcast(const std::string& text) const;

  static constexpr int kCounters = 4;
  /// Counters on rank 0 that all ranks take numbers from: adds to one. Not collective.
  /// @return its value before
  std::uint64_t take(int counter, std::uint64_t amount) const;

  /// A file that all ranks write into.
  class SharedFile {
   public:
    SharedFile() = default;
    /// Any thread, where threads_may_call(). @return kOutput naming the file
    Result<void> write_at(std::uint64_t offset, const void* data, std::size_t bytes) const;
    /// Collective. @return kOutput
    Result<void> close();

   private:
    friend class Peers;
    struct File;
    std::shared_ptr<File> file_;
  };
  /// Opens a file that is there; collective. @return kOutput naming the file, on some ranks
  Result<SharedFile> open(const std::string& path) const;

 private:
  struct Job;
  [[nodiscard]] std::vector<std::string> gather_piece(const std::string& text) const;
  explicit Peers(std::unique_ptr<Job> job);
  std::unique_ptr<Job> job_;
};

}  // namespace strata::apps
