#include "apps/session/process_memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <memory>
#include <string>

#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

using testkit::kSanitized;

/// Allocates, writes to and gives back; what is written is asked for, or compilers leave all of it
/// out.
void touch(std::size_t bytes) {
  const auto block = std::make_unique_for_overwrite<char[]>(bytes);
  std::memset(block.get(), 1, bytes);
  const volatile char* const written = block.get();
  for (std::size_t i = 0; i < bytes; i += 4096) ASSERT_EQ(written[i], 1);
}

TEST(Memory, ThePeakGrowsByWhatIsTouched) {
  reset_peak_memory();
  const std::uint64_t before = peak_memory_bytes();
  constexpr std::size_t kBytes = 64 << 20;
  touch(kBytes);
  const std::uint64_t after = peak_memory_bytes();
  EXPECT_GE(after, before + kBytes / 2);
  EXPECT_LE(after, usable_memory_bytes() + kBytes);
}

TEST(Memory, ThePeakStaysAfterMemoryIsGivenBackUntilReset) {
  if (kSanitized) GTEST_SKIP() << "sanitizers keep memory that was given back";
  if (!reset_peak_memory()) GTEST_SKIP() << "this system does not reset VmHWM";
  const std::uint64_t before = peak_memory_bytes();
  constexpr std::size_t kBytes = 64 << 20;
  touch(kBytes);
  EXPECT_GE(peak_memory_bytes(), before + kBytes / 2);
  ASSERT_TRUE(reset_peak_memory());
  EXPECT_LT(peak_memory_bytes(), before + kBytes / 2);
}

TEST(Memory, TheMachineHasSome) {
  EXPECT_GT(physical_memory_bytes(), std::uint64_t{64} << 20);
  EXPECT_GT(usable_memory_bytes(), 0u);
  EXPECT_LE(usable_memory_bytes(), physical_memory_bytes());
}

TEST(Memory, AnAddressSpaceLimitCounts) {
  if (kSanitized) GTEST_SKIP() << "sanitizers reserve more address space than any limit";
  const pid_t child = fork();
  if (child == 0) {
    const rlimit limit{64 << 20, 64 << 20};
    if (setrlimit(RLIMIT_AS, &limit) != 0) _exit(77);
    _exit(usable_memory_bytes() <= (64 << 20) ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

class CgroupMemory : public testing::Test {
 protected:
  void put(const std::string& name, const std::string& text) const { root_.write(name, text); }
  [[nodiscard]] std::optional<std::uint64_t> limit() const {
    return cgroup_memory_limit(root_.file("self"), root_.file("fs"));
  }
  testkit::TemporaryFolder root_;
};

TEST_F(CgroupMemory, Version2TakesTheLeastOfTheGroupAndItsParents) {
  put("self", "0::/user/job\n");
  put("fs/memory.max", "max\n");
  put("fs/user/memory.max", "3000000\n");
  put("fs/user/job/memory.max", "5000000\n");
  EXPECT_EQ(limit(), 3000000u);
}

TEST_F(CgroupMemory, Version1LooksAtTheMemoryController) {
  put("self", "5:cpu,cpuacct:/x\n4:memory:/x\n0::/elsewhere\n");
  put("fs/memory/x/memory.limit_in_bytes", "7000000\n");
  put("fs/cpu/x/memory.limit_in_bytes", "1\n");
  EXPECT_EQ(limit(), 7000000u);
}

TEST_F(CgroupMemory, AContainerSeesItsGroupAtTheMount) {
  put("self", "0::/docker/0123456789abcdef\n");
  put("fs/memory.max", "9000000\n");
  EXPECT_EQ(limit(), 9000000u);
}

TEST_F(CgroupMemory, NoLimitIsNoLimit) {
  EXPECT_EQ(limit(), std::nullopt);  // no such files
  put("self", "0::/\nrubbish\n:\n");
  put("fs/memory.max", "max\n");
  EXPECT_EQ(limit(), std::nullopt);
  put("fs/memory.max", "");
  EXPECT_EQ(limit(), std::nullopt);
  put("fs/memory.max", "12x\n");
  EXPECT_EQ(limit(), std::nullopt);
}

}  // namespace
}  // namespace strata
