#include "apps/mpi/peers.h"

// The interface for C; that for C++ is no part of MPI any more.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>

#include "core/atomic_file.h"

namespace strata::apps {
namespace {

constexpr std::size_t kMostCounted = std::size_t{1} << 30;  // at a time: MPI counts by int

std::string mpi_reason(int error) {
  char text[MPI_MAX_ERROR_STRING] = {};
  int length = 0;
  if (MPI_Error_string(error, text, &length) != MPI_SUCCESS) return fmt::format("error {}", error);
  return {text, static_cast<std::size_t>(length)};
}

}  // namespace

struct Peers::Job {
  int rank = 0, size = 1, local = 1, thread_level = MPI_THREAD_SINGLE;
  MPI_Win window = MPI_WIN_NULL;
  std::uint64_t* counters = nullptr;
  std::function<bool()> stopped;
  std::mutex mutex;  // of calls

  /// Waits without a busy processor: ranks may be more than processors.
  void wait(MPI_Request request) const {
    auto pause = std::chrono::microseconds(10);
    for (int done = 0;;) {
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      if (done != 0) return;
      if (stopped && stopped()) leave();
      std::this_thread::sleep_for(pause);
      pause = std::min(pause * 2, std::chrono::microseconds(2000));
    }
  }
  [[noreturn]] static void leave() {
    remove_temporary_files();
    std::_Exit(static_cast<int>(ErrorCode::kCancelled));
  }
};

struct Peers::SharedFile::File {
  std::string path;
  MPI_File handle = MPI_FILE_NULL;
  std::mutex* mutex = nullptr;
};

Peers::Peers(std::unique_ptr<Job> job) : job_(std::move(job)) {}
Peers::Peers(Peers&&) noexcept = default;

Result<Peers> Peers::join(int* argc, char*** argv) {
  auto job = std::make_unique<Job>();
  int error = MPI_Init_thread(argc, argv, MPI_THREAD_SERIALIZED, &job->thread_level);
  if (error != MPI_SUCCESS) return fail(ErrorCode::kInternal, "MPI: {}", mpi_reason(error));
  MPI_Comm_rank(MPI_COMM_WORLD, &job->rank);
  MPI_Comm_size(MPI_COMM_WORLD, &job->size);
  MPI_Comm local = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &local);
  MPI_Comm_size(local, &job->local);
  MPI_Comm_free(&local);
  const MPI_Aint bytes =
      job->rank == 0 ? static_cast<MPI_Aint>(kCounters * sizeof(std::uint64_t)) : 0;
  error = MPI_Win_allocate(bytes, sizeof(std::uint64_t), MPI_INFO_NULL, MPI_COMM_WORLD,
                           &job->counters, &job->window);
  if (error != MPI_SUCCESS) return fail(ErrorCode::kInternal, "MPI: {}", mpi_reason(error));
  MPI_Win_lock_all(0, job->window);
  if (job->rank == 0) std::fill_n(job->counters, kCounters, 0);
  MPI_Win_sync(job->window);
  MPI_Barrier(MPI_COMM_WORLD);
  return Peers(std::move(job));
}

Peers::~Peers() {
  if (!job_) return;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibarrier(MPI_COMM_WORLD, &request);
  job_->wait(request);
  MPI_Win_unlock_all(job_->window);
  MPI_Win_free(&job_->window);
  MPI_Finalize();
}

int Peers::rank() const { return job_->rank; }
int Peers::size() const { return job_->size; }
int Peers::on_this_machine() const { return job_->local; }
bool Peers::threads_may_call() const { return job_->thread_level >= MPI_THREAD_SERIALIZED; }
void Peers::set_stopped(std::function<bool()> stopped) { job_->stopped = std::move(stopped); }
void Peers::leave() const { Job::leave(); }

std::uint64_t Peers::largest(std::uint64_t number) const {
  std::uint64_t result = 0;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(&number, &result, 1, MPI_UINT64_T, MPI_MAX, MPI_COMM_WORLD, &request);
  job_->wait(request);
  return result;
}

std::vector<std::uint64_t> Peers::sum(const std::vector<std::uint64_t>& numbers) const {
  std::vector<std::uint64_t> sums(numbers.size(), 0);
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ireduce(numbers.data(), sums.data(), static_cast<int>(numbers.size()), MPI_UINT64_T, MPI_SUM,
              0, MPI_COMM_WORLD, &request);
  job_->wait(request);
  return sums;
}

std::vector<std::string> Peers::gather(const std::string& text) const {
  const std::size_t piece = gathered_at_once(static_cast<std::size_t>(job_->size));
  const std::uint64_t longest = largest(text.size());
  std::vector<std::string> texts = gather_piece(text.substr(0, piece));
  for (std::size_t at = piece; at < longest; at += piece) {
    const auto more = gather_piece(at < text.size() ? text.substr(at, piece) : std::string());
    for (std::size_t i = 0; i < more.size(); ++i) texts[i] += more[i];
  }
  return texts;
}

std::vector<std::string> Peers::gather_piece(const std::string& text) const {
  const auto ranks = static_cast<std::size_t>(job_->size);
  const int length = static_cast<int>(text.size());
  std::vector<int> lengths(ranks, 0), begins(ranks, 0);
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Igather(&length, 1, MPI_INT, lengths.data(), 1, MPI_INT, 0, MPI_COMM_WORLD, &request);
  job_->wait(request);
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < ranks; ++i) {
    begins[i] = static_cast<int>(bytes);
    bytes += static_cast<std::size_t>(lengths[i]);
  }
  std::string all(bytes, '\0');
  MPI_Igatherv(text.data(), length, MPI_CHAR, all.data(), lengths.data(), begins.data(), MPI_CHAR,
               0, MPI_COMM_WORLD, &request);
  job_->wait(request);
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < ranks && job_->rank == 0; ++i) {
    texts.push_back(
        all.substr(static_cast<std::size_t>(begins[i]), static_cast<std::size_t>(lengths[i])));
  }
  return texts;
}

std::string Peers::broadcast(const std::string& text) const {
  std::uint64_t length = text.size();
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibcast(&length, 1, MPI_UINT64_T, 0, MPI_COMM_WORLD, &request);
  job_->wait(request);
  std::string result = job_->rank == 0 ? text : std::string(length, '\0');
  for (std::size_t at = 0; at < length; at += kMostCounted) {
    const int part = static_cast<int>(std::min(kMostCounted, length - at));
    MPI_Ibcast(result.data() + at, part, MPI_CHAR, 0, MPI_COMM_WORLD, &request);
    job_->wait(request);
  }
  return result;
}

std::uint64_t Peers::take(int counter, std::uint64_t amount) const {
  std::uint64_t before = 0;
  const std::lock_guard lock(job_->mutex);
  MPI_Fetch_and_op(&amount, &before, MPI_UINT64_T, 0, counter, MPI_SUM, job_->window);
  MPI_Win_flush(0, job_->window);
  return before;
}

Result<Peers::SharedFile> Peers::open(const std::string& path) const {
  SharedFile shared;
  shared.file_ = std::make_shared<SharedFile::File>();
  shared.file_->path = path;
  shared.file_->mutex = &job_->mutex;
  const int error = MPI_File_open(MPI_COMM_WORLD, path.c_str(), MPI_MODE_WRONLY, MPI_INFO_NULL,
                                  &shared.file_->handle);
  if (error == MPI_SUCCESS) return shared;
  return fail(ErrorCode::kOutput, "{}: cannot write: {}", path, mpi_reason(error));
}

Result<void> Peers::SharedFile::write_at(std::uint64_t offset, const void* data,
                                         std::size_t bytes) const {
  const auto* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const std::size_t part = std::min(bytes, kMostCounted);
    MPI_Status status;
    int written = 0;
    const std::lock_guard lock(*file_->mutex);
    const int error = MPI_File_write_at(file_->handle, static_cast<MPI_Offset>(offset), from,
                                        static_cast<int>(part), MPI_BYTE, &status);
    if (error == MPI_SUCCESS) MPI_Get_count(&status, MPI_BYTE, &written);
    if (error != MPI_SUCCESS || written != static_cast<int>(part)) {
      return fail(ErrorCode::kOutput, "{}: cannot write {} bytes at {}: {}", file_->path, part,
                  offset, error == MPI_SUCCESS ? "no space" : mpi_reason(error));
    }
    from += part, offset += part, bytes -= part;
  }
  return {};
}

Result<void> Peers::SharedFile::close() {
  if (!file_) return {};
  const int error = MPI_File_close(&file_->handle);
  if (error == MPI_SUCCESS) return {};
  return fail(ErrorCode::kOutput, "{}: cannot finish: {}", file_->path, mpi_reason(error));
}

}  // namespace strata::apps
