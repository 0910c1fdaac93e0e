// Media files: what they may say, and that every mistake is named with its place.

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "strata/transparency/media/media.h"
#include "tests/support/temporary_folder.h"

namespace strata::transparency {
namespace {

class ReadMedia : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string path() const { return (folder_.path() / "fog.json").string(); }
  [[nodiscard]] Result<MediaSettings> read(const std::string& text) const {
    write("fog.json", text);
    return read_media(path());
  }
  /// The message of a file with a mistake, without the folder.
  [[nodiscard]] std::string message(const std::string& text) const {
    const auto settings = read(text);
    if (settings) return {};
    EXPECT_EQ(settings.error().code, ErrorCode::kInput);
    std::string words = settings.error().message;
    const std::string folder = folder_.path().string() + "/";
    EXPECT_EQ(words.find(folder), 0u) << words;
    return words.substr(std::min(folder.size(), words.size()));
  }

  testkit::TemporaryFolder folder_;
};

const std::string kWhole = R"({
  "ambient": [0.5, 0.25, 1],
  "light": {"direction": [1, 2, 3], "radiance": 8, "shadows": true, "shadow_size": 256,
            "shadow_steps": 16, "visibility": "fourier", "visibility_size": 8},
  "media": [
    {"object": "bottle", "extinction": [0.5, 0.25, 2], "albedo": 0.75, "surface": true},
    {"object": "glass", "surface": [1, 0.5, 0, 0.25]},
    {"object": "*", "extinction": 0.125}
  ],
  "particles": [
    {"centre": [0, 1, -1.5], "radius": 0.25, "extinction": 2, "albedo": [1, 0.5, 0]},
    {"centre": [0, 0, 0], "radius": 1}
  ]
})";

TEST_F(ReadMedia, TakesAllThatTheDocumentNames) {
  const auto settings = read(kWhole);
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->ambient, glm::vec3(0.5f, 0.25f, 1.0f));
  EXPECT_EQ(settings->light.at, glm::dvec3(1, 2, 3));
  EXPECT_FALSE(settings->light.point);
  EXPECT_EQ(settings->light.radiance, glm::vec3(8.0f));
  EXPECT_TRUE(settings->light.shadows);
  EXPECT_EQ(settings->light.shadow_size, 256);
  EXPECT_EQ(settings->light.shadow_steps, 16);
  EXPECT_EQ(settings->light.visibility, ShadowVisibility::kFourier);
  EXPECT_EQ(settings->light.visibility_size, 8);
  ASSERT_EQ(settings->media.size(), 3u);
  EXPECT_EQ(settings->media[0].object, "bottle");
  EXPECT_EQ(settings->media[0].medium.extinction, glm::vec3(0.5f, 0.25f, 2.0f));
  EXPECT_EQ(settings->media[0].medium.albedo, glm::vec3(0.75f));
  EXPECT_TRUE(settings->media[0].medium.surface);
  EXPECT_FALSE(settings->media[0].medium.surface_colour);
  EXPECT_TRUE(settings->media[1].medium.surface);
  EXPECT_EQ(settings->media[1].medium.surface_colour, glm::vec4(1.0f, 0.5f, 0.0f, 0.25f));
  EXPECT_EQ(settings->media[2].object, "*");
  EXPECT_EQ(settings->media[2].medium.albedo, glm::vec3(1.0f));
  EXPECT_FALSE(settings->media[2].medium.surface);
  ASSERT_EQ(settings->particles.size(), 2u);
  EXPECT_EQ(settings->particles[0].centre, glm::dvec3(0, 1, -1.5));
  EXPECT_EQ(settings->particles[0].radius, 0.25);
  EXPECT_EQ(settings->particles[0].albedo, glm::vec3(1.0f, 0.5f, 0.0f));
  EXPECT_EQ(settings->particles[1].extinction, glm::vec3(1.0f));

  const auto point = read(R"({"light": {"position": [4, 5, 6]}})");
  ASSERT_TRUE(point);
  EXPECT_TRUE(point->light.point);
  EXPECT_EQ(point->light.radiance, glm::vec3(1.0f));
  ASSERT_TRUE(read("{}"));
  EXPECT_TRUE(read("{}")->media.empty());
}

TEST_F(ReadMedia, TakesTablesOfParticles) {
  write("drops.csv", "x, y, z, r\r\n1,2,3,0.5\n\n +1e0 ,-2,3.25,4,0.1,0.2,0.3,1,0.5,0\n");
  const auto settings =
      read(R"({"particles": {"file": "drops.csv", "extinction": [3, 4, 5], "albedo": 0.5}})");
  ASSERT_TRUE(settings) << settings.error().message;
  ASSERT_EQ(settings->files.size(), 2u);
  EXPECT_TRUE(settings->files[0].is_same_file(identify_file(path())));
  EXPECT_TRUE(settings->files[1].is_same_file(identify_file(folder_.file("drops.csv"))));
  ASSERT_EQ(settings->particles.size(), 2u);
  EXPECT_EQ(settings->particles[0].centre, glm::dvec3(1, 2, 3));
  EXPECT_EQ(settings->particles[0].radius, 0.5);
  EXPECT_EQ(settings->particles[0].extinction, glm::vec3(3, 4, 5));
  EXPECT_EQ(settings->particles[0].albedo, glm::vec3(0.5f));
  EXPECT_EQ(settings->particles[1].centre, glm::dvec3(1, -2, 3.25));
  EXPECT_EQ(settings->particles[1].extinction, glm::vec3(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(settings->particles[1].albedo, glm::vec3(1.0f, 0.5f, 0.0f));
}

TEST_F(ReadMedia, NamesThePlaceOfAMistake) {
  const std::pair<const char*, const char*> cases[] = {
      {R"([1])", "fog.json: the file must be an object, got [1]"},
      {R"({"medium": []})", "fog.json: the file has a member 'medium'"},
      {R"({"ambient": -1})", "fog.json: ambient must be 0 to 1000000, got -1"},
      {R"({"ambient": [1, 2]})", "fog.json: ambient must be 3 numbers, got [1,2]"},
      {R"({"ambient": [1, "x", 2]})", "fog.json: ambient[1] must be a number, got \"x\""},
      {R"({"media": {}})", "fog.json: media must be a list, got {}"},
      {R"({"media": [3]})", "fog.json: media[0] must be an object, got 3"},
      {R"({"media": [{"extinction": 1}]})", "fog.json: media[0] must have a member 'object'"},
      {R"({"media": [{"object": 7}]})", "fog.json: media[0].object must be a text, got 7"},
      {R"({"media": [{"object": "a"}, {"object": "a"}]})",
       "fog.json: media[1] is a second medium for 'a'"},
      {R"({"media": [{"object": "a", "albedo": [0, 0, 1.5]}]})",
       "fog.json: media[0].albedo[2] must be 0 to 1, got 1.5"},
      {R"({"media": [{"object": "a", "extinction": 1e7}]})",
       "fog.json: media[0].extinction must be 0 to 1000000, got 10000000"},
      {R"({"media": [{"object": "a", "surface": [1, 1, 1]}]})",
       "fog.json: media[0].surface must be 4 numbers, got [1,1,1]"},
      {R"({"light": {}})", "fog.json: light must have one member of 'direction' and 'position'"},
      {R"({"light": {"direction": [0, 0, 0]}})", "fog.json: light.direction must not be 0, 0, 0"},
      {R"({"light": {"direction": [0, 0, 1], "shadows": 1}})",
       "fog.json: light.shadows must be true or false, got 1"},
      {R"({"light": {"direction": [0, 0, 1], "shadow_size": 9000}})",
       "fog.json: light.shadow_size must be 1 to 8192, got 9000"},
      {R"({"light": {"direction": [0, 0, 1], "shadow_steps": 1.5}})",
       "fog.json: light.shadow_steps must be a whole number, got 1.5"},
      {R"({"light": {"direction": [0, 0, 1], "visibility": "list"}})",
       "fog.json: light.visibility must be lists, slices, occupancy, fourier or nodes, got 'list'"},
      {R"({"particles": [{"radius": 1}]})", "fog.json: particles[0] must have a member 'centre'"},
      {R"({"particles": [{"centre": [0, 0, 0], "radius": 0}]})",
       "fog.json: particles[0].radius must be above 0, got 0"},
      {R"({"particles": {"extinction": 1}})",
       "fog.json: particles must have a member 'file', or be a list"},
      {R"({"particles": {"file": "none.csv"}})", "none.csv: the file cannot be opened"},
      {R"({"particles": {"file": "."}})", ".: particles are read from regular files"},
      {"{\n\"ambient\": 1e999}", "fog.json: number overflow"},
      {"{\n\"ambient\": ]}", "fog.json: parse error at line 2, column 12"},
      {"", "fog.json: parse error at line 1, column 1"}};
  for (const auto& [text, right] : cases) {
    EXPECT_EQ(message(text).substr(0, std::string(right).size()), right) << text;
  }
}

TEST_F(ReadMedia, NamesTheLineOfATable) {
  const std::pair<const char*, const char*> cases[] = {
      {"1,2,3,4\n1,2,3\n", "drops.csv:2: a line must have 4 or 10 columns, got 3"},
      {"x,y,z,r\nx,y,z,r\n", "drops.csv:2: the x must be a number"},
      {"1,y,z,r\n", "drops.csv:1: the y must be a number"},
      {"1,2,3,0\n", "drops.csv:1: the radius must be above 0, got 0"},
      {"\n1,2,nan,1\n", "drops.csv:2: the z must be a number"},
      {"1,2,3,1e999\n", "drops.csv:1: the radius must be a number"},
      {"1,2,3,4,5,6,-7,1,1,1\n", "drops.csv:1: the blue extinction must be 0 to 1e6, got -7"},
      {"1,2,3,4,5,6,7,1,2,1\n", "drops.csv:1: the green albedo must be 0 to 1, got 2"},
      {"1,2,3,4,5,6,7,1,1,1,1\n", "drops.csv:1: a line must have 4 or 10 columns, got more"}};
  for (const auto& [text, right] : cases) {
    write("drops.csv", text);
    EXPECT_EQ(message(R"({"particles": {"file": "drops.csv"}})"), right);
  }
}

TEST_F(ReadMedia, RefusesEveryTruncatedFile) {
  for (std::size_t length = 0; length < kWhole.size(); ++length) {
    EXPECT_NE(message(kWhole.substr(0, length)), "") << length;
  }
  EXPECT_EQ(message(kWhole), "");
  const auto none = read_media((folder_.path() / "none.json").string());
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kInput);
  EXPECT_FALSE(read_media(folder_.path().string()));
}

}  // namespace
}  // namespace strata::transparency
