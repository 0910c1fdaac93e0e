#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "strata/transparency/techniques.h"

namespace strata::transparency {
namespace {

TEST(PapersPage, HasARowOfEachTechnique) {
  std::ifstream file(STRATA_SOURCE_DIR "/docs/papers.md");
  std::stringstream text;
  text << file.rdbuf();
  ASSERT_GT(text.str().size(), 1000u);
  for (const Technique* technique : techniques()) {
    EXPECT_NE(text.str().find("| `" + std::string(technique->name) + "` |"), std::string::npos)
        << technique->name << ": run ./dev bench papers --update-docs";
  }
}

}  // namespace
}  // namespace strata::transparency
