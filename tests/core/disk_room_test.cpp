#include "core/disk_room.h"

#include <gtest/gtest.h>
#include <sys/statvfs.h>

#include <limits>

#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

TEST(DiskRoom, AFileLargerThanTheDiskIsRefusedWithBothNumbers) {
  const testkit::TemporaryFolder folder;
  struct statvfs disk {};
  ASSERT_EQ(statvfs(folder.path().c_str(), &disk), 0);
  const std::uint64_t all = std::uint64_t{disk.f_blocks} * std::uint64_t{disk.f_frsize};
  EXPECT_TRUE(check_room(folder.file("small"), 1));
  for (const std::uint64_t bytes :
       {all + 2'000'000'000'000, std::numeric_limits<std::uint64_t>::max()}) {
    const auto large = check_room(folder.file("large"), bytes);
    ASSERT_FALSE(large);
    EXPECT_EQ(large.error().code, ErrorCode::kLimit);
    const std::string begin = folder.file("large") + ": the file takes ";
    EXPECT_NE(large.error().message.find(" TB, but the disk has room for "), std::string::npos);
    EXPECT_EQ(large.error().message.find(begin), 0u) << large.error().message;
  }
}

TEST(DiskRoom, WhatIsNoFileHasRoom) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  EXPECT_TRUE(check_room("-", kMost));
  EXPECT_TRUE(check_room("/dev/null", kMost));
  EXPECT_TRUE(check_room("/no/such/folder/file", kMost));
}

}  // namespace
}  // namespace strata
