#include "apps/session/process_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <string_view>

namespace strata {
namespace {

// The first number of a one-line file; empty for "max" and for what cannot be read.
std::optional<std::uint64_t> number_in(const std::string& path) {
  std::ifstream in(path);
  std::string word;
  if (!(in >> word)) return std::nullopt;
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

void keep_least(std::optional<std::uint64_t>& least, std::optional<std::uint64_t> value) {
  if (value && (!least || *value < *least)) least = value;
}

}  // namespace

std::uint64_t peak_memory_bytes() {
  // Not getrusage: its ru_maxrss also counts what the process was before exec.
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    constexpr std::string_view kKey = "VmHWM:";
    if (!line.starts_with(kKey)) continue;
    std::uint64_t kilobytes = 0;
    const char* const begin = line.data() + std::min(line.find_first_of("0123456789"), line.size());
    std::from_chars(begin, line.data() + line.size(), kilobytes);
    return kilobytes * 1024;
  }
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

bool reset_peak_memory() {
  std::ofstream out("/proc/self/clear_refs");
  out << "5" << std::flush;
  return out.good();
}

std::uint64_t physical_memory_bytes() {
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return 0;
  return static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page);
}

std::optional<std::uint64_t> cgroup_memory_limit(const std::string& membership,
                                                 const std::string& mount) {
  // Lines are "number:controllers:path"; version 2 has number 0 and no controllers.
  std::optional<std::uint64_t> least;
  std::ifstream in(membership);
  for (std::string line; std::getline(in, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool version2 = controllers == ",,";
    if (!version2 && controllers.find(",memory,") == std::string::npos) continue;
    const std::string root = version2 ? mount : mount + "/memory";
    const char* const file = version2 ? "/memory.max" : "/memory.limit_in_bytes";
    // A group is bound by its parents too. Inside a container the path may name groups that are not
    // mounted here; the mount itself is then the container's group.
    std::string group = line.substr(second + 1);
    for (;;) {
      while (!group.empty() && group.back() == '/') group.pop_back();
      keep_least(least, number_in(root + group + file));
      const std::size_t slash = group.rfind('/');
      if (slash == std::string::npos) break;
      group.resize(slash);
    }
  }
  return least;
}

std::uint64_t usable_memory_bytes() {
  std::uint64_t usable = physical_memory_bytes();
  // Version 1 says "no limit" with a number near 2^63: the least of the two ignores it.
  if (const auto limit = cgroup_memory_limit()) usable = std::min(usable, *limit);
  rlimit space{};
  if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY) {
    usable = std::min<std::uint64_t>(usable, space.rlim_cur);
  }
  return usable;
}

}  // namespace strata
