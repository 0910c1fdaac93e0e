#include "strata/gl/context.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <thread>

#include "gl/workarounds.h"
#include "strata/gl/buffer.h"
#include "strata/gl/shader_program.h"
#include "tests/gl/gl_testing.h"

namespace strata::glsl {
extern const gl::GlslPiece tests_gl_sum_comp;
}

namespace strata::gl {
namespace {

using GlContext = test::GlTest;
using GlBuffer = test::GlTest;
using GlProgram = test::GlTest;

TEST_F(GlContext, SaysWhatItIs) {
  const Info& info = context_->info();
  EXPECT_FALSE(info.renderer.empty());
  EXPECT_FALSE(info.version.empty());
  EXPECT_TRUE(info.window_system.starts_with("EGL ")) << info.window_system;
  EXPECT_TRUE(std::is_sorted(info.extensions.begin(), info.extensions.end()));
  EXPECT_FALSE(info.has_extension("GL_STRATA_nonsense"));
  // What OpenGL 4.5 promises at least.
  EXPECT_GE(info.limits.storage_block_bytes, 1u << 24);
  EXPECT_GE(info.limits.storage_bindings, 8u);
  EXPECT_GE(info.limits.compute_groups[0], 65535u);
  EXPECT_GE(info.limits.compute_invocations, 1024u);
  EXPECT_GE(info.limits.texture_side, 16384u);
  EXPECT_GE(info.limits.subpixel_bits, 4u);
  EXPECT_FALSE(info.int64_atomics_reason.empty());
}

TEST_F(GlContext, TwoLiveSideBySideAndInOtherThreads) {
  auto other = Context::headless({.debug = true, .device = ""});
  ASSERT_TRUE(other) << other.error().message;
  (*other)->release_current();
  std::thread([&] {
    ASSERT_TRUE((*other)->make_current());
    auto buffer = Buffer::allocate(16);
    ASSERT_TRUE(buffer);
    buffer->clear(7);
    EXPECT_EQ(buffer->download_all<std::uint32_t>(), (std::vector<std::uint32_t>(4, 7)));
    *buffer = Buffer();
    EXPECT_TRUE((*other)->check());
    (*other)->release_current();
  }).join();
  other->reset();
  ASSERT_TRUE(context_->make_current());
}

TEST_F(GlContext, AMistakeComesBackAsASentence) {
  auto buffer = Buffer::allocate(64);
  ASSERT_TRUE(buffer);
  buffer->bind(100000);  // no such binding
  const auto checked = context_->check();
  ASSERT_FALSE(checked);
  EXPECT_NE(checked.error().message.find("GL_INVALID_VALUE"), std::string::npos)
      << checked.error().message;
  EXPECT_TRUE(context_->check());  // said once
}

TEST_F(GlContext, ADeviceThatIsNotThereIsNamed) {
  const auto none = Context::headless({.debug = false, .device = "device:4711"});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kUsage);
  EXPECT_NE(none.error().message.find("device:4711"), std::string::npos) << none.error().message;
  const auto nonsense = Context::headless({.debug = false, .device = "toaster"});
  ASSERT_FALSE(nonsense);
  EXPECT_NE(nonsense.error().message.find("toaster"), std::string::npos);
  ASSERT_TRUE(context_->make_current());
}

TEST_F(GlBuffer, GivesBackWhatItGot) {
  std::vector<std::uint32_t> data(1000);
  std::iota(data.begin(), data.end(), 5u);
  auto buffer = Buffer::of(std::span<const std::uint32_t>(data));
  ASSERT_TRUE(buffer) << buffer.error().message;
  EXPECT_EQ(buffer->bytes(), 4000u);
  EXPECT_EQ(buffer->download_all<std::uint32_t>(), data);
  std::vector<std::uint32_t> part(10);
  buffer->download(std::span(part), 400);
  EXPECT_TRUE(std::equal(part.begin(), part.end(), data.begin() + 100));
  buffer->clear(9, 8, 12);
  std::fill(data.begin() + 2, data.begin() + 5, 9u);
  EXPECT_EQ(buffer->download_all<std::uint32_t>(), data);
  ASSERT_TRUE(buffer->reserve(100));
  EXPECT_EQ(buffer->bytes(), 4000u);  // enough was there
  ASSERT_TRUE(buffer->reserve(5000));
  EXPECT_EQ(buffer->bytes(), 5000u);
}

TEST_F(GlBuffer, OneOfNoBytesIsHarmless) {
  auto buffer = Buffer::allocate(0);
  ASSERT_TRUE(buffer);
  buffer->bind(0);
  buffer->clear();
  EXPECT_TRUE(buffer->download_all<std::uint32_t>().empty());
}

TEST_F(GlProgram, ComputesASumOverMoreGroupsThanOneRowHolds) {
  const GlslPiece piece = glsl::tests_gl_sum_comp;
  auto program = Program::compute({&piece, 1}, {.extensions = {}, .defines = {{"SCALE", "3u"}}});
  ASSERT_TRUE(program) << program.error().message;
  const std::uint32_t count = 65535 * 64 + 1000;
  auto input = Buffer::allocate(count * std::uint64_t{4});
  auto output = Buffer::allocate(4);
  ASSERT_TRUE(input && output);
  input->clear(2);
  output->clear(0);
  input->bind(0);
  output->bind(1);
  program->set("count", count);
  const Groups groups = groups_for(count, 64);
  EXPECT_EQ(groups.x, 65535u);
  program->dispatch(groups.x, groups.y);
  EXPECT_EQ(output->download_all<std::uint32_t>()[0], count * 6);
}

TEST_F(GlProgram, ARefusedShaderNamesPieceAndLine) {
  const GlslPiece pieces[] = {{"first.glsl", "uint f() { return 1u; }\n"},
                              {"second.glsl",
                               "layout(local_size_x = 1) in;\n\n"
                               "void main() { nonsense(f()); }\n"}};
  const auto program = Program::compute(pieces);
  ASSERT_FALSE(program);
  EXPECT_NE(program.error().message.find("second.glsl:3"), std::string::npos)
      << program.error().message;
}

/// STRATA_GL_FAULTS for the contexts that are made while it lives.
struct Provoked {
  explicit Provoked(const char* faults) { setenv("STRATA_GL_FAULTS", faults, 1); }
  ~Provoked() { unsetenv("STRATA_GL_FAULTS"); }
};

TEST_F(GlContext, ThatIsLostSaysSoBeforeRubbishIsTrusted) {
  const Provoked fault("lose-context=2");
  auto lost = Context::headless({.debug = true, .device = ""});
  ASSERT_TRUE(lost) << lost.error().message;
  auto buffer = Buffer::allocate(8);
  ASSERT_TRUE(buffer);
  buffer->clear(7);
  EXPECT_EQ(buffer->download_all<std::uint32_t>(), (std::vector<std::uint32_t>(2, 7)));
  EXPECT_TRUE(check_errors("first"));
  EXPECT_NE(buffer->download_all<std::uint32_t>(), (std::vector<std::uint32_t>(2, 7)));
  for (int i = 0; i < 2; ++i) {  // for good
    const auto checked = check_errors("second");
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().code, ErrorCode::kInternal);
    EXPECT_EQ(checked.error().message.find("second: the OpenGL context was lost, "), 0u)
        << checked.error().message;
    EXPECT_FALSE((*lost)->check());
  }
  *buffer = Buffer();
  lost->reset();
  // Another one can be had.
  const auto next = Context::headless({.debug = true, .device = ""});
  ASSERT_TRUE(next);
  EXPECT_TRUE((*next)->check());
}

TEST_F(GlProgram, CanBeRefusedByName) {
  const Provoked fault("hardware,refuse-shader=second");
  auto made = Context::headless({.debug = true, .device = ""});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_FALSE((*made)->info().is_software);
  const GlslPiece first = {"first.glsl", "layout(local_size_x = 1) in;\nvoid main() {}\n"};
  const GlslPiece second = {"second.glsl", first.text};
  EXPECT_TRUE(Program::compute({&first, 1}));
  const auto refused = Program::compute({&second, 1});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("refuses a shader"), std::string::npos);
  EXPECT_NE(refused.error().message.find("second.glsl"), std::string::npos)
      << refused.error().message;
}

TEST(GlFaults, ThatAreNoneAreRefused) {
  for (const char* words : {"lose-context=0", "lose-context=abc", "lose-context=3x",
                            "losecontext=3", "refuse-shader", "hardware=yes"}) {
    const Provoked fault(words);
    const auto made = Context::headless();
    ASSERT_FALSE(made) << words;
    EXPECT_NE(made.error().message.find("STRATA_GL_FAULTS"), std::string::npos)
        << made.error().message;
  }
}

TEST(GlWorkarounds, AreSwitchedByName) {
  Info info;
  info.renderer = "llvmpipe (LLVM 15)";
  const auto state = [&](std::string_view switches) {
    const auto all = choose_workarounds(info, switches);
    return std::any_of(all.begin(), all.end(), [](const Workaround& w) { return w.in_force; });
  };
  EXPECT_TRUE(state(""));
  EXPECT_FALSE(state("-all"));
  for (const Workaround& workaround : choose_workarounds(info, "-all")) {
    EXPECT_FALSE(workaround.story.empty());
    EXPECT_TRUE(state("-all,+" + std::string(workaround.name)));
    EXPECT_TRUE(state("-all," + std::string(workaround.name)));
  }
}

}  // namespace
}  // namespace strata::gl
