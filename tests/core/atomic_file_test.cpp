#include "core/atomic_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

using testkit::bytes_of;
using testkit::in_child;

void put(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

class AtomicFileTest : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::size_t entries() const { return place_.names().size(); }

  const testkit::TemporaryFolder place_;
  const fs::path folder_ = place_.path();
};

using AtomicFolderTest = AtomicFileTest;

TEST_F(AtomicFileTest, AppearsUnderItsNameOnlyAtCommit) {
  auto file = AtomicFile::create(at("a.bin"));
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(file->write("hello ", 6));
  ASSERT_TRUE(file->write("world", 5));
  EXPECT_FALSE(fs::exists(at("a.bin")));
  EXPECT_EQ(fs::path(file->temporary_path()).parent_path(), folder_);
  EXPECT_TRUE(fs::exists(file->temporary_path()));
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(bytes_of(at("a.bin")), "hello world");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFileTest, AWholeFileIsWrittenAtOnceOrNotAtAll) {
  ASSERT_TRUE(write_file(at("a.bin"), "hello world", 11));
  ASSERT_TRUE(write_file(at("a.bin"), "again", 5));
  EXPECT_EQ(bytes_of(at("a.bin")), "again");
  const auto failed = write_file(at("nowhere/a.bin"), "hello", 5);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::kOutput);
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFileTest, DestroyedUncommittedLeavesNothing) {
  {
    auto file = AtomicFile::create(at("a.bin"));
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write("half", 4));
    EXPECT_EQ(entries(), 1u);
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFileTest, UncommittedKeepsTheOldContent) {
  put(at("a.bin"), "old");
  {
    auto file = AtomicFile::create(at("a.bin"));
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write("new", 3));
  }
  EXPECT_EQ(bytes_of(at("a.bin")), "old");
}

TEST_F(AtomicFileTest, ReplacedFileKeepsItsPermissions) {
  put(at("a.bin"), "old");
  fs::permissions(at("a.bin"), fs::perms::owner_read | fs::perms::owner_write);
  auto file = AtomicFile::create(at("a.bin"));
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write("new", 3));
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(bytes_of(at("a.bin")), "new");
  EXPECT_EQ(fs::status(at("a.bin")).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(AtomicFileTest, ASymbolicLinkIsFollowed) {
  fs::create_directory(at("real"));
  put(at("real/a.bin"), "old");
  fs::create_symlink("real/a.bin", at("link.bin"));
  auto file = AtomicFile::create(at("link.bin"));
  ASSERT_TRUE(file);
  EXPECT_EQ(file->path(), at("link.bin"));
  ASSERT_TRUE(file->write("new", 3));
  ASSERT_TRUE(file->commit());
  EXPECT_TRUE(fs::is_symlink(at("link.bin")));
  EXPECT_EQ(bytes_of(at("real/a.bin")), "new");
}

TEST_F(AtomicFileTest, TwoWritersOfOneNameDoNotMix) {
  auto first = AtomicFile::create(at("a.bin"));
  auto second = AtomicFile::create(at("a.bin"));
  ASSERT_TRUE(first && second);
  EXPECT_NE(first->temporary_path(), second->temporary_path());
  ASSERT_TRUE(first->write("1", 1));
  ASSERT_TRUE(second->write("2", 1));
  ASSERT_TRUE(first->commit());
  EXPECT_EQ(bytes_of(at("a.bin")), "1");
  ASSERT_TRUE(second->commit());
  EXPECT_EQ(bytes_of(at("a.bin")), "2");
}

TEST_F(AtomicFileTest, WriteAtFillsHolesFromSeveralThreads) {
  auto file = AtomicFile::create(at("a.bin"));
  ASSERT_TRUE(file);
  constexpr int kThreads = 4;
  constexpr std::size_t kPart = 10000;
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&file, t] {
        const std::string part(kPart, static_cast<char>('a' + t));
        EXPECT_TRUE(file->write_at(static_cast<std::uint64_t>(kThreads - 1 - t) * kPart,
                                   part.data(), part.size()));
      });
    }
  }
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(bytes_of(at("a.bin")), std::string(kPart, 'd') + std::string(kPart, 'c') +
                                       std::string(kPart, 'b') + std::string(kPart, 'a'));
}

TEST_F(AtomicFileTest, ALibraryMayWriteTheTemporaryByName) {
  auto file = AtomicFile::create(at("a.bin"));
  ASSERT_TRUE(file);
  put(file->temporary_path(), "by name");
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(bytes_of(at("a.bin")), "by name");
}

TEST_F(AtomicFileTest, MovedFromOwnsNothing) {
  auto created = AtomicFile::create(at("a.bin"));
  ASSERT_TRUE(created);
  std::optional<AtomicFile> target(std::move(*created));
  auto other = AtomicFile::create(at("b.bin"));
  ASSERT_TRUE(other);
  EXPECT_EQ(entries(), 2u);
  *target = std::move(*other);  // gives up a.bin
  EXPECT_EQ(entries(), 1u);
  ASSERT_TRUE(target->commit());
  EXPECT_TRUE(fs::exists(at("b.bin")));
  target.reset();
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFileTest, ACommitIsForOnce) {
  auto file = AtomicFile::create(at("a.bin"));
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->commit());
  const auto again = file->commit();
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::kInternal);
}

TEST_F(AtomicFileTest, TheErrorNamesThePathAndTheReason) {
  const struct {
    std::string path, reason;
  } cases[] = {
      {at("missing/a.bin"), "there is no folder " + at("missing")},
      {folder_.string(), "Is a directory"},
      {at(std::string(300, 'n')), "File name too long"},
      {at(std::string(5000, 'n')), "File name too long"},
      {"", "no name"},
  };
  for (const auto& [path, reason] : cases) {
    auto file = AtomicFile::create(path);
    if (file) {  // the temporary name is short enough, the final one is not
      const auto committed = file->commit();
      ASSERT_FALSE(committed) << path;
      EXPECT_NE(committed.error().message.find(reason), std::string::npos);
      continue;
    }
    EXPECT_EQ(file.error().code, ErrorCode::kOutput);
    EXPECT_NE(file.error().message.find(path), std::string::npos) << file.error().message;
    EXPECT_NE(file.error().message.find(reason), std::string::npos) << file.error().message;
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFileTest, AnUnwritableFolderIsRefused) {
  const int status = in_child([this] {
    // Root may write anywhere; any other user, here 65534, may not.
    fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec |
                                 fs::perms::others_read | fs::perms::others_exec);
    if (getuid() == 0 && (setgid(65534) != 0 || setuid(65534) != 0)) return 77;
    const auto file = AtomicFile::create(at("a.bin"));
    if (file) return 1;
    if (file.error().code != ErrorCode::kOutput) return 2;
    if (file.error().message.find("Permission denied") == std::string::npos) return 3;
    const auto folder = AtomicFolder::create(at("slices"));
    return folder ? 4 : 0;
  });
  fs::permissions(folder_, fs::perms::owner_all);
  if (status == 77) GTEST_SKIP() << "cannot become an unprivileged user here";
  EXPECT_EQ(status, 0);
}

TEST_F(AtomicFileTest, AFileTooLargeForItsLimitIsAnError) {
  const int status = in_child([this] {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, 4096};
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) return 77;
    auto file = AtomicFile::create(at("a.bin"));
    if (!file) return 1;
    const std::string data(10000, 'x');
    const auto written = file->write(data.data(), data.size());
    if (written) return 2;
    if (written.error().code != ErrorCode::kOutput) return 3;
    if (written.error().message !=
        at("a.bin") + ": cannot write 5904 bytes at position 4096: File too large") {
      return 4;
    }
    if (file->write_at(8192, "x", 1)) return 5;
    // What failed once must not be committed, even by a caller that ignores errors.
    const auto committed = file->commit();
    if (committed || committed.error().code != ErrorCode::kOutput) return 6;
    return fs::exists(at("a.bin")) ? 7 : 0;
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFileTest, AFullDeviceIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  auto file = AtomicFile::create("/dev/full");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->temporary_path(), "/dev/full");  // written directly, never renamed onto
  const auto written = file->write("x", 1);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kOutput);
  EXPECT_EQ(written.error().message,
            "/dev/full: cannot write 1 bytes at position 0: No space left on device");
  EXPECT_FALSE(file->commit());
}

TEST_F(AtomicFileTest, APipeWithANameIsNotReplaced) {
  ASSERT_EQ(mkfifo(at("pipe").c_str(), 0600), 0);
  const int reader = open(at("pipe").c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  auto file = AtomicFile::create(at("pipe"));
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(file->write("x", 1));
  ASSERT_TRUE(file->commit());
  EXPECT_TRUE(fs::is_fifo(at("pipe")));
  char received = 0;
  EXPECT_EQ(read(reader, &received, 1), 1);
  EXPECT_EQ(received, 'x');
  close(reader);
}

TEST_F(AtomicFileTest, DashIsStandardOutputAndStaysOpen) {
  const int status = in_child([this] {
    const int out = open(at("out").c_str(), O_WRONLY | O_CREAT, 0600);
    dup2(out, STDOUT_FILENO);
    for (const char* word : {"one ", "two"}) {
      auto file = AtomicFile::create("-");
      if (!file || file->temporary_path() != "-") return 1;
      if (!file->write(word, std::char_traits<char>::length(word))) return 2;
      if (!file->commit()) return 3;
    }
    return 0;
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(bytes_of(at("out")), "one two");
}

TEST_F(AtomicFileTest, ANonBlockingPipeIsWaitedFor) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_NONBLOCK), 0);
  const std::string data(1 << 20, 'x');  // sixteen times what a pipe holds
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    dup2(ends[1], STDOUT_FILENO);
    auto file = AtomicFile::create("-");
    _exit(file && file->write(data.data(), data.size()) && file->commit() ? 0 : 1);
  }
  close(ends[1]);
  fcntl(ends[0], F_SETFL, 0);
  std::size_t received = 0;
  std::vector<char> buffer(1 << 16);
  for (ssize_t got; (got = read(ends[0], buffer.data(), buffer.size())) > 0;) {
    received += static_cast<std::size_t>(got);
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(received, data.size());
}

TEST_F(AtomicFileTest, AClosedStandardStreamIsNotTakenOver) {
  const int status = in_child([this] {
    close(STDOUT_FILENO);
    auto file = AtomicFile::create(at("a.bin"));
    if (!file || !file->write("data", 4)) return 1;
    (void)!::write(STDOUT_FILENO, "talk", 4);
    return file->commit() ? 0 : 2;
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(bytes_of(at("a.bin")), "data");
}

TEST_F(AtomicFileTest, SignalRemovesAllLiveTemporaries) {
  const int status = in_child([this] {
    signal(SIGTERM, [](int) {
      remove_temporary_files();
      _exit(42);
    });
    auto kept = AtomicFile::create(at("kept.bin"));
    auto file = AtomicFile::create(at("a.bin"));
    auto folder = AtomicFolder::create(at("slices"));
    if (!kept || !file || !folder || !kept->commit()) return 1;
    fs::create_directories(folder->temporary_path() + "/deep/er");
    for (int i = 0; i < 200; ++i) {  // more than one buffer of directory entries
      put(folder->temporary_path() + "/" + std::to_string(i), "x");
      put(folder->temporary_path() + "/deep/er/" + std::to_string(i), "x");
    }
    raise(SIGTERM);
    return 2;
  });
  EXPECT_EQ(status, 42);
  EXPECT_EQ(entries(), 1u);
  EXPECT_TRUE(fs::exists(at("kept.bin")));
}

TEST_F(AtomicFileTest, AForkedChildDoesNotRemoveItsParentsFiles) {
  auto file = AtomicFile::create(at("a.bin"));
  ASSERT_TRUE(file);
  EXPECT_EQ(in_child([] {
              remove_temporary_files();
              return 0;
            }),
            0);
  EXPECT_TRUE(fs::exists(file->temporary_path()));
  EXPECT_TRUE(file->commit());
}

TEST_F(AtomicFileTest, CommitAfterRemovalFails) {
  const int status = in_child([this] {
    auto file = AtomicFile::create(at("a.bin"));
    if (!file) return 1;
    remove_temporary_files();
    return file->commit() ? 2 : 0;
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFileTest, TheTableIsBoundedAndReused) {
  for (int round = 0; round < 3; ++round) {
    std::vector<AtomicFile> files;
    for (int i = 0; i < kMaxTemporaries; ++i) {
      auto file = AtomicFile::create(at("f" + std::to_string(i)));
      ASSERT_TRUE(file) << i << ": " << file.error().message;
      files.push_back(std::move(*file));
    }
    const auto one_more = AtomicFile::create(at("more"));
    ASSERT_FALSE(one_more);
    EXPECT_EQ(one_more.error().code, ErrorCode::kLimit);
    EXPECT_NE(one_more.error().message.find("256"), std::string::npos);
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFolderTest, AppearsUnderItsNameOnlyAtCommit) {
  auto folder = AtomicFolder::create(at("slices/"));
  ASSERT_TRUE(folder) << folder.error().message;
  put(folder->temporary_path() + "/0.png", "x");
  EXPECT_FALSE(fs::exists(at("slices")));
  ASSERT_TRUE(folder->commit());
  EXPECT_EQ(bytes_of(at("slices/0.png")), "x");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFolderTest, DestroyedUncommittedLeavesNothing) {
  {
    auto folder = AtomicFolder::create(at("slices"));
    ASSERT_TRUE(folder);
    fs::create_directory(folder->temporary_path() + "/deep");
    put(folder->temporary_path() + "/deep/0.png", "x");
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFolderTest, ReplacesAnEmptyFolderButNotOneWithContent) {
  fs::create_directory(at("slices"));
  auto folder = AtomicFolder::create(at("slices"));
  ASSERT_TRUE(folder) << folder.error().message;
  put(folder->temporary_path() + "/0.png", "x");
  ASSERT_TRUE(folder->commit());
  EXPECT_EQ(bytes_of(at("slices/0.png")), "x");

  const auto refused = AtomicFolder::create(at("slices"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kOutput);
  EXPECT_EQ(refused.error().message,
            at("slices") + ": the folder is not empty; remove it, or choose another name");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFolderTest, ContentThatAppearsMeanwhileIsKept) {
  auto folder = AtomicFolder::create(at("slices"));
  ASSERT_TRUE(folder);
  put(folder->temporary_path() + "/0.png", "mine");
  fs::create_directory(at("slices"));
  put(at("slices/0.png"), "theirs");
  const auto committed = folder->commit();
  ASSERT_FALSE(committed);
  EXPECT_EQ(committed.error().code, ErrorCode::kOutput);
  EXPECT_EQ(bytes_of(at("slices/0.png")), "theirs");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFolderTest, AFileOfThatNameIsRefused) {
  put(at("slices"), "a file");
  const auto refused = AtomicFolder::create(at("slices"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kOutput);
}

using OutputGroupTest = AtomicFileTest;

Result<void> write_to(const std::string& path, const std::string& text) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  if (auto done = file->write(text.data(), text.size()); !done) return done;
  return file->commit();
}

TEST_F(OutputGroupTest, AppearsTogether) {
  put(at("b"), "old");
  OutputGroup group;
  ASSERT_TRUE(write_to(at("a"), "first"));
  ASSERT_TRUE(write_to(at("b"), "second"));
  auto folder = AtomicFolder::create(at("c/"));
  ASSERT_TRUE(folder);
  put(folder->temporary_path() + "/in", "third");
  ASSERT_TRUE(folder->commit());
  EXPECT_FALSE(fs::exists(at("a")));
  EXPECT_FALSE(fs::exists(at("c")));
  EXPECT_EQ(bytes_of(at("b")), "old");
  EXPECT_EQ(bytes_of(group.place_of(at("b"))), "second");
  EXPECT_EQ(group.place_of(at("other")), at("other"));
  ASSERT_TRUE(group.commit());
  EXPECT_EQ(bytes_of(at("a")), "first");
  EXPECT_EQ(bytes_of(at("b")), "second");
  EXPECT_EQ(bytes_of(at("c/in")), "third");
  EXPECT_EQ(entries(), 3u);
  EXPECT_TRUE(group.commit());  // of nothing
}

TEST_F(OutputGroupTest, OrNotAtAll) {
  put(at("b"), "old");
  {
    OutputGroup group;
    ASSERT_TRUE(write_to(at("a"), "first"));
    ASSERT_TRUE(write_to(at("b"), "second"));
    ASSERT_TRUE(write_to(at("c"), "third"));
    fs::create_directory(at("c"));  // meanwhile
    const auto done = group.commit();
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, ErrorCode::kOutput);
    EXPECT_NE(done.error().message.find(at("c")), std::string::npos);
    EXPECT_FALSE(fs::exists(at("a")));
    EXPECT_EQ(bytes_of(at("b")), "old");
    EXPECT_EQ(entries(), 2u);  // b and the folder c
  }
  {
    OutputGroup group;
    ASSERT_TRUE(write_to(at("d"), "first"));
  }
  EXPECT_EQ(entries(), 2u);
  ASSERT_TRUE(write_to(at("d"), "alone"));
  EXPECT_EQ(bytes_of(at("d")), "alone");
}

TEST_F(OutputGroupTest, IsOfItsThreadAlone) {
  OutputGroup group;
  std::thread([this] { EXPECT_TRUE(write_to(at("a"), "other")); }).join();
  EXPECT_EQ(bytes_of(at("a")), "other");
}

TEST_F(OutputGroupTest, ASignalRemovesWhatWaits) {
  EXPECT_EQ(in_child([this] {
              OutputGroup group;
              if (!write_to(at("a"), "first")) return 1;
              remove_temporary_files();
              return 0;
            }),
            0);
  EXPECT_EQ(entries(), 0u);
}

}  // namespace
}  // namespace strata
