#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <new>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"

// What all bindings share: errors become exceptions, long work runs without the interpreter's lock
// and stops at Ctrl-C, arrays own what they show.

namespace strata::python {

namespace py = pybind11;

/// Throws the exception of strata._errors that belongs to the error. @pre the lock is held
[[noreturn]] void raise(const Error& error);
/// The same of a text.
[[noreturn]] void refuse(ErrorCode code, const std::string& message);

/// The value, or the error as an exception.
template <class T>
T value_of(Result<T>&& result) {
  if (!result) raise(result.error());
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

/// How a call runs.
struct Limits {
  int threads = 0;           ///< as Execution::threads
  std::uint64_t memory = 0;  ///< bytes; 0: half of the machine's memory
};
/// Checks both. Throws UsageError.
[[nodiscard]] Execution execution_of(const Limits& limits, std::stop_token stop);

/// Runs `work` on a thread of its own. Meanwhile this one, without the lock, waits and looks for
/// signals: after Ctrl-C the work is asked to stop, and KeyboardInterrupt is thrown once it has.
void run_on_worker(const std::function<void(std::stop_token)>& work);

/// run_on_worker() of a function that takes an Execution and returns a Result.
template <class Work>
auto run(const Limits& limits, Work&& work) {
  using Outcome = std::invoke_result_t<Work, const Execution&>;
  std::optional<Outcome> outcome;
  std::stop_source unused;
  static_cast<void>(execution_of(limits, unused.get_token()));  // refuses before a thread starts
  run_on_worker([&](std::stop_token stop) { outcome.emplace(work(execution_of(limits, stop))); });
  return value_of(*std::move(outcome));
}

/// An array of the vector's memory, which is not copied.
template <class T>
[[nodiscard]] py::array array_of(std::vector<T>&& values, const py::dtype& dtype,
                                 std::vector<py::ssize_t> shape,
                                 std::vector<py::ssize_t> strides = {}) {
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* held) { delete static_cast<std::vector<T>*>(held); });
  return py::array(dtype, std::move(shape), std::move(strides), kept->data(), owner);
}
/// A flat one.
template <class T>
[[nodiscard]] py::array array_of(std::vector<T>&& values) {
  const auto size = static_cast<py::ssize_t>(values.size());
  return array_of(std::move(values), py::dtype::of<T>(), {size});
}

/// An array of `rows` x `columns` values that `owner` holds. It cannot be written to.
template <class T>
[[nodiscard]] py::array view_of(const T* values, std::size_t rows, int columns,
                                const py::object& owner) {
  py::array made(py::dtype::of<T>(), {static_cast<py::ssize_t>(rows), py::ssize_t{columns}}, {},
                 values, owner);
  made.attr("setflags")(py::arg("write") = false);
  return made;
}

/// Rows of an array that Python code has checked: contiguous, of this type.
template <class T>
using Values = py::array_t<T, py::array::c_style>;

/// Three numbers.
[[nodiscard]] inline py::tuple tuple_of(const glm::dvec3& v) {
  return py::make_tuple(v.x, v.y, v.z);
}
[[nodiscard]] inline glm::dvec3 vec_of(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

void bind_meshes(py::module_& module);
void bind_voxels(py::module_& module);
void bind_voxelize(py::module_& module);
void bind_lists(py::module_& module);
void bind_solids(py::module_& module);

}  // namespace strata::python
