#include "apps/session/progress.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>

namespace strata {
namespace {

using namespace std::chrono_literals;

/// A pseudo terminal, or a pipe; what was written to `in` can be read back.
class Screen {
 public:
  explicit Screen(bool terminal) {
    if (terminal) {
      out_ = posix_openpt(O_RDWR | O_NOCTTY);
      if (out_ >= 0 && grantpt(out_) == 0 && unlockpt(out_) == 0) {
        in_ = open(ptsname(out_), O_RDWR | O_NOCTTY);
      }
    } else {
      std::array<int, 2> ends{};
      if (pipe(ends.data()) == 0) {
        out_ = ends[0];
        in_ = ends[1];
      }
    }
    fcntl(out_, F_SETFL, O_NONBLOCK);
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen() {
    close(in_);
    close(out_);
  }
  [[nodiscard]] bool good() const { return in_ >= 0; }
  [[nodiscard]] int descriptor() const { return in_; }
  void set_columns(unsigned short columns) const {
    winsize size{};
    size.ws_col = columns;
    size.ws_row = 24;
    ioctl(in_, TIOCSWINSZ, &size);
  }
  [[nodiscard]] std::string text() const {
    std::string result;
    std::array<char, 4096> buffer{};
    for (ssize_t got; (got = read(out_, buffer.data(), buffer.size())) > 0;) {
      result.append(buffer.data(), static_cast<std::size_t>(got));
    }
    return result;
  }

 private:
  int in_ = -1, out_ = -1;
};

class Progress : public testing::Test {
 protected:
  void SetUp() override {
    setenv("TERM", "xterm", 1);
    unsetenv("NO_COLOR");
  }
};

TEST(ProgressLine, ShowsTheFractionAndTheRest) {
  EXPECT_EQ(progress_line("lists", 0.5, 12.0, 32, false), "lists [###   ]  50 %  12 s left");
}

TEST(ProgressLine, NeverFillsTheLastColumn) {
  for (int columns = 0; columns < 120; ++columns) {
    for (const double fraction : {0.0, 0.004, 0.5, 0.999, 1.0}) {
      const std::string line = progress_line("intervals", fraction, 100.0, columns, false);
      ASSERT_LE(static_cast<int>(line.size()), std::max(columns - 1, 0)) << line;
    }
  }
}

TEST(ProgressLine, HundredPercentOnlyWhenDone) {
  EXPECT_NE(progress_line("x", 0.9999, 0.0, 80, false).find(" 99 %"), std::string::npos);
  EXPECT_NE(progress_line("x", 1.0, 0.0, 80, false).find("100 %"), std::string::npos);
}

TEST(ProgressLine, StrangeFractionsAreClamped) {
  const std::string none = progress_line("x", 0.0, 5.0, 80, false);
  EXPECT_EQ(progress_line("x", -3.0, 5.0, 80, false), none);
  EXPECT_EQ(progress_line("x", std::nan(""), 5.0, 80, false), none);
  EXPECT_EQ(progress_line("x", std::numeric_limits<double>::infinity(), 5.0, 80, false),
            progress_line("x", 1.0, 5.0, 80, false));
}

TEST(ProgressLine, TheRestIsGivenInReadableUnits) {
  EXPECT_NE(progress_line("x", 0.5, 99.0, 80, false).find("99 s left"), std::string::npos);
  EXPECT_NE(progress_line("x", 0.5, 100.0, 80, false).find("2 min left"), std::string::npos);
  EXPECT_NE(progress_line("x", 0.5, 7200.0, 80, false).find("2 h left"), std::string::npos);
  EXPECT_EQ(progress_line("x", 0.5, 1.0, 80, false).find("left"), std::string::npos);
}

TEST_F(Progress, DrawsOnATerminalAndCleansUp) {
  const Screen screen(true);
  if (!screen.good()) GTEST_SKIP() << "no pseudo terminals here";
  screen.set_columns(60);
  {
    ProgressBar bar("lists", ProgressMode::kAuto, screen.descriptor());
    EXPECT_TRUE(bar.draws());
    bar.update(0.5);
    EXPECT_NE(screen.text().find("50 %"), std::string::npos);
  }
  EXPECT_EQ(screen.text(), "\r\x1b[K");
}

TEST_F(Progress, IsSilentInAPipe) {
  const Screen screen(false);
  ASSERT_TRUE(screen.good());
  {
    ProgressBar bar("lists", ProgressMode::kAuto, screen.descriptor());
    EXPECT_FALSE(bar.draws());
    EXPECT_FALSE(bar.callback());
    bar.update(0.5);
  }
  EXPECT_EQ(screen.text(), "");
}

TEST_F(Progress, IsSilentOnADumbTerminalAndWhenToldSo) {
  const Screen screen(true);
  if (!screen.good()) GTEST_SKIP() << "no pseudo terminals here";
  EXPECT_FALSE(ProgressBar("x", ProgressMode::kNone, screen.descriptor()).draws());
  setenv("TERM", "dumb", 1);
  EXPECT_FALSE(ProgressBar("x", ProgressMode::kAuto, screen.descriptor()).draws());
  EXPECT_TRUE(ProgressBar("x", ProgressMode::kBar, screen.descriptor()).draws());
}

TEST_F(Progress, RedrawsAtMostTenTimesASecond) {
  const Screen screen(false);
  ProgressBar bar("lists", ProgressMode::kBar, screen.descriptor());
  const ProgressBar::Clock::time_point start = ProgressBar::Clock::now();
  for (int ms = 0; ms < 1000; ++ms) bar.update(ms / 1000.0, start + ms * 1ms);
  const std::string text = screen.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 10);
}

TEST_F(Progress, ANewPhaseIsDrawnAtOnce) {
  const Screen screen(false);
  ProgressBar bar("lists", ProgressMode::kBar, screen.descriptor());
  const ProgressBar::Clock::time_point start = ProgressBar::Clock::now();
  bar.update(0.5, start);
  (void)screen.text();
  bar.begin("write", start);
  bar.update(0.0, start);
  EXPECT_NE(screen.text().find("write"), std::string::npos);
}

TEST_F(Progress, NoColorIsHonoured) {
  const Screen screen(false);
  {
    ProgressBar bar("x", ProgressMode::kBar, screen.descriptor());
    bar.update(0.5);
    EXPECT_NE(screen.text().find("\x1b[32m"), std::string::npos);
  }
  (void)screen.text();
  setenv("NO_COLOR", "1", 1);
  ProgressBar bar("x", ProgressMode::kBar, screen.descriptor());
  bar.update(0.5);
  const std::string text = screen.text();
  EXPECT_NE(text.find("50 %"), std::string::npos);
  EXPECT_EQ(text.find("\x1b[32m"), std::string::npos);
}

TEST_F(Progress, CallbackDraws) {
  const Screen screen(false);
  ProgressBar bar("x", ProgressMode::kBar, screen.descriptor());
  bar.callback()(0.25);
  EXPECT_NE(screen.text().find("25 %"), std::string::npos);
}

}  // namespace
}  // namespace strata
