#include "mesh/text/plain_lines.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace strata::detail {
namespace {

/// Text that ends, with its zero byte, where readable memory ends; or as many bytes before that.
class TextAtTheEdge {
 public:
  explicit TextAtTheEdge(const std::string& text, std::size_t before = 0) {
    pages_ = static_cast<char*>(
        mmap(nullptr, 3 * kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    mprotect(pages_ + 2 * kPage, kPage, PROT_NONE);
    begin_ = pages_ + 2 * kPage - text.size() - 1 - before;
    std::copy(text.begin(), text.end(), begin_);
    std::fill(begin_ + text.size() + 1, pages_ + 2 * kPage, '7');  // nobody's digits
  }
  TextAtTheEdge(const TextAtTheEdge&) = delete;
  TextAtTheEdge& operator=(const TextAtTheEdge&) = delete;
  ~TextAtTheEdge() { munmap(pages_, 3 * kPage); }
  [[nodiscard]] const char* begin() const { return begin_; }

 private:
  static constexpr std::size_t kPage = 4096;
  char* pages_ = nullptr;
  char* begin_ = nullptr;
};

/// A number as exporters write them, and some that no exporter would.
std::string any_number(std::mt19937_64& random) {
  const auto digits = [&](std::size_t most) {
    std::string text;
    for (std::size_t n = 1 + random() % most; n != 0; --n) {
      text += static_cast<char>('0' + random() % 10);
    }
    return text;
  };
  std::string text = random() % 2 != 0 ? "-" : "";
  text += digits(random() % 9 == 0 ? 20 : 4);
  if (random() % 6 != 0) text += '.';
  if (text.back() == '.') text += digits(random() % 9 == 0 ? 20 : 8);
  if (random() % 20 == 0) text += "e-7";
  return text;
}

double by_library(const std::string& text) {
  double value = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

TEST(PlainLines, VerticesHaveTheBitsOfTheLibraryAnywhereInAPage) {
  std::mt19937_64 random(51);
  for (int i = 0; i < 100000; ++i) {
    const std::string numbers[] = {any_number(random), any_number(random), any_number(random)};
    const std::string line = numbers[0] + ' ' + numbers[1] + ' ' + numbers[2] + '\n';
    const TextAtTheEdge text(line + "1 2 3", random() % 120);
    glm::dvec3 position;
    const char* const next = plain_vertex(text.begin(), position);
    ASSERT_EQ(next, text.begin() + line.size()) << line;
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(std::bit_cast<std::uint64_t>(position[axis]),
                std::bit_cast<std::uint64_t>(by_library(numbers[axis])))
          << line;
    }
  }
}

TEST(PlainLines, TrianglesAreThoseOfTheLine) {
  std::mt19937_64 random(52);
  for (int i = 0; i < 50000; ++i) {
    constexpr std::uint32_t kMost[] = {10, 1000, 100000, 10000000};
    glm::uvec3 expected;
    for (int k = 0; k < 3; ++k)
      expected[k] = static_cast<std::uint32_t>(random() % kMost[random() % 4]);
    std::string line;
    for (int k = 0; k < 3; ++k)
      line += std::string(1 + random() % 4 / 3, ' ') + std::to_string(expected[k]);
    line = line.substr(1) + (random() % 4 == 0 ? "\r\n" : "\n");
    const TextAtTheEdge text(line, random() % 120);
    glm::uvec3 corners;
    ASSERT_EQ(plain_triangle(text.begin(), corners), text.begin() + line.size()) << line;
    ASSERT_EQ(corners, expected) << line;
  }
}

TEST(PlainLines, AllElseIsLeftToTheCaller) {
  for (const char* line :
       {"", "\n", "1 2\n", "1 2 3", "1 2 3 4\n", "1.5 2.5\n3.5\n", "1.5 2.5 3.5x\n",
        "1.5 2.5 3.5 1\n", "1.5 x 3.5\n", "1.5\t2.5\t3.5\n", "--1.5 2.5 3.5\n",
        "1.5 2.5 3.5 # end\n", "1.5 2.5 \\\n3.5\n", "1.5,2.5,3.5\n", "- 1.5 2.5\n"}) {
    for (const std::size_t before : {std::size_t{0}, std::size_t{100}}) {
      const TextAtTheEdge text(line, before);
      glm::dvec3 position;
      EXPECT_EQ(plain_vertex(text.begin(), position), nullptr) << line;
    }
  }
  for (const char* line :
       {"", "\n", "1 2\n", "1 2 3", "1 2 3 4\n", "1 2\n3\n", "1 2 3/4\n", "1 -2 3\n", "1 2.0 3\n",
        "1 2 10000000\n", "1\t2\t3\n", "1 2 3 # end\n"}) {
    for (const std::size_t before : {std::size_t{0}, std::size_t{100}}) {
      const TextAtTheEdge text(line, before);
      glm::uvec3 corners;
      EXPECT_EQ(plain_triangle(text.begin(), corners), nullptr) << line;
    }
  }
}

}  // namespace
}  // namespace strata::detail
