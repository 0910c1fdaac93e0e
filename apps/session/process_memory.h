#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace strata {

/// Largest resident memory of this process so far, in bytes (VmHWM); 0 when the system does not
/// tell.
[[nodiscard]] std::uint64_t peak_memory_bytes();

/// Makes peak_memory_bytes() start again from what is resident now. @return false when the system
/// refuses.
bool reset_peak_memory();

/// Memory of the machine in bytes.
[[nodiscard]] std::uint64_t physical_memory_bytes();

/// The smallest memory limit of the control groups this process is in (containers, batch systems),
/// in bytes; empty without one. Version 1 and 2. The arguments are for tests.
/// @param membership a file like /proc/self/cgroup
/// @param mount where the control groups are mounted
[[nodiscard]] std::optional<std::uint64_t> cgroup_memory_limit(
    const std::string& membership = "/proc/self/cgroup",
    const std::string& mount = "/sys/fs/cgroup");

/// Memory this process may use: the least of the machine, its control groups and its address space
/// limit (ulimit -v), in bytes.
[[nodiscard]] std::uint64_t usable_memory_bytes();

}  // namespace strata
