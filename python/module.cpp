#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>

#include "core/printable.h"
#include "python/call.h"
#include "python/data.h"

namespace strata::python {

void raise(const Error& error) { refuse(error.code, error.message); }

void refuse(ErrorCode code, const std::string& message) {
  // Names in it may come from files, and be no UTF-8.
  const py::object made = py::module_::import("strata._errors")
                              .attr("error_of")(static_cast<int>(code), printable_lines(message));
  PyErr_SetObject(py::type::handle_of(made).ptr(), made.ptr());
  throw py::error_already_set();
}

Execution execution_of(const Limits& limits, std::stop_token stop) {
  constexpr int kMostThreads = 4096;
  if (limits.threads < 0 || limits.threads > kMostThreads) {
    refuse(ErrorCode::kUsage,
           fmt::format("threads must be 0 to {}, got {}", kMostThreads, limits.threads));
  }
  Execution execution;
  execution.threads = limits.threads;
  execution.stop = std::move(stop);
  execution.memory_limit = limits.memory;
  if (limits.memory == 0) {
    execution.memory_limit = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) / 2 *
                             static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  }
  return execution;
}

namespace {

/// Whether a piece of work has ended, and how.
class Ending {
 public:
  void set(std::exception_ptr failure) {
    const std::lock_guard lock(mutex_);
    failure_ = std::move(failure);
    ended_ = true;
    changed_.notify_all();
  }
  /// @return whether it has ended
  bool wait(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [this] { return ended_; });
  }
  [[nodiscard]] const std::exception_ptr& failure() const { return failure_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::exception_ptr failure_;
  bool ended_ = false;
};

/// Looks for signals until the work has ended. @return Python's exception, if a handler threw one
std::optional<py::error_already_set> watch(Ending& ending, std::stop_source& stop) {
  constexpr std::chrono::milliseconds kPause{50};
  std::optional<py::error_already_set> interrupt;
  while (!ending.wait(kPause)) {
    if (interrupt) continue;
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() == 0) continue;
    interrupt.emplace();
    stop.request_stop();
  }
  return interrupt;
}

}  // namespace

void run_on_worker(const std::function<void(std::stop_token)>& work) {
  Ending ending;
  std::stop_source stop;
  std::optional<py::error_already_set> interrupt;
  const auto job = [&] {
    std::exception_ptr failure;
    try {
      work(stop.get_token());
    } catch (...) {
      failure = std::current_exception();
    }
    ending.set(failure);
  };
  {
    const py::gil_scoped_release free;
    try {
      const std::jthread worker(job);
      interrupt = watch(ending, stop);
    } catch (const std::system_error&) {
      job();  // the system gives no thread
    }
  }
  if (interrupt) throw *std::move(interrupt);
  if (!ending.failure()) return;
  try {
    std::rethrow_exception(ending.failure());
  } catch (const std::bad_alloc&) {
    refuse(ErrorCode::kLimit, "out of memory");
  } catch (const std::length_error&) {
    refuse(ErrorCode::kLimit, "out of memory");
  }
}

}  // namespace strata::python

PYBIND11_MODULE(_strata, module) {
  namespace py = pybind11;
  module.doc() = "The native part of strata. Its functions take arrays that strata has checked.";
  module.attr("version") = STRATA_VERSION;
  py::class_<strata::python::Limits>(module, "Limits")
      .def(py::init<int, std::uint64_t>(), py::arg("threads"), py::arg("memory"));
  py::class_<strata::python::SolidData, strata::python::SolidPtr>(module, "Solid");
  strata::python::bind_meshes(module);
  strata::python::bind_voxels(module);
  strata::python::bind_voxelize(module);
  strata::python::bind_lists(module);
  strata::python::bind_solids(module);
}
