#include "apps/view/scene/render_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <future>
#include <mutex>
#include <tuple>
#include <vector>

#include "strata/csg/picture/picture.h"
#include "strata/mesh/shapes.h"

namespace strata::view {
namespace {

/// Draws nothing, and not before it is let.
class SlowRenderer final : public Renderer {
 public:
  struct Log {
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<glm::ivec2> begun;
    int allowed = 0;
    int cancelled = 0;
  };
  explicit SlowRenderer(Log& log) : log_(log) {}

  Result<Frame> draw(const FrameRequest& request, const Execution& execution) override {
    std::unique_lock lock(log_.mutex);
    log_.begun.push_back(request.size);
    log_.changed.notify_all();
    const std::stop_callback wake(execution.stop, [this] { log_.changed.notify_all(); });
    while (log_.allowed == 0 && !execution.stop.stop_requested()) {
      log_.changed.wait_for(lock, std::chrono::milliseconds(1));
    }
    if (execution.stop.stop_requested()) {
      ++log_.cancelled;
      return fail(ErrorCode::kCancelled, "stopped");
    }
    --log_.allowed;
    if (request.size.x == 13) return fail(ErrorCode::kGeometry, "thirteen");
    Frame frame;
    frame.number = request.number;
    frame.wanted = request.size;
    frame.samples = request.look.samples;
    frame.picture.width = request.size.x, frame.picture.height = request.size.y;
    return frame;
  }
  Result<Picked> pick(const FrameRequest&, const glm::ivec2& pixel, const Execution&) override {
    Picked picked;
    picked.pixel = pixel;
    picked.hit = true;
    return picked;
  }

 private:
  Log& log_;
};

class RenderThreadTest : public testing::Test {
 protected:
  RenderThreadTest() {
    thread_.emplace(std::make_unique<SlowRenderer>(log_), 1, [] {});
  }
  ~RenderThreadTest() override {
    allow(1000);
    thread_.reset();
  }
  void allow(int count) {
    const std::lock_guard lock(log_.mutex);
    log_.allowed += count;
    log_.changed.notify_all();
  }
  /// Waits until `count` pictures have been begun.
  void await_begun(std::size_t count) {
    std::unique_lock lock(log_.mutex);
    log_.changed.wait(lock, [&] { return log_.begun.size() >= count; });
  }
  void await_rest() {
    while (!thread_->resting()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  static FrameRequest request(int width = 800, int samples = 1) {
    FrameRequest result;
    result.look.samples = samples;
    result.what = std::make_shared<Arrangement>();
    result.size = {width, 600};
    return result;
  }
  SlowRenderer::Log log_;
  std::optional<RenderThread> thread_;
};

TEST_F(RenderThreadTest, ACoarsePictureComesBeforeTheWholeOne) {
  thread_->submit(request());
  await_begun(1);
  EXPECT_EQ(log_.begun[0], glm::ivec2(200, 150));
  allow(1);
  await_begun(2);
  const auto coarse = thread_->take_frame();
  ASSERT_TRUE(coarse);
  EXPECT_EQ(coarse->divisor, 4);
  EXPECT_EQ(coarse->wanted, glm::ivec2(800, 600));
  EXPECT_EQ(coarse->picture.width, 200);
  EXPECT_FALSE(thread_->resting());
  EXPECT_EQ(log_.begun[1], glm::ivec2(800, 600));
  allow(1);
  await_rest();
  const auto whole = thread_->take_frame();
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->divisor, 1);
  EXPECT_EQ(whole->picture.width, 800);
  EXPECT_FALSE(thread_->take_frame());
}

TEST_F(RenderThreadTest, APictureWithAllSamplesComesLast) {
  thread_->submit(request(800, 8));
  allow(2);
  await_begun(3);  // coarse, whole, and with all samples
  const auto whole = thread_->take_frame();
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->divisor, 1);
  EXPECT_EQ(whole->samples, 1);
  EXPECT_FALSE(whole->last);
  EXPECT_FALSE(thread_->resting());
  allow(1);
  await_rest();
  const auto smooth = thread_->take_frame();
  ASSERT_TRUE(smooth);
  EXPECT_EQ(smooth->samples, 8);
  EXPECT_TRUE(smooth->last);
  EXPECT_EQ(log_.begun.back(), glm::ivec2(800, 600));
}

TEST_F(RenderThreadTest, NothingWaitsForAllSamples) {
  thread_->submit(request(800, 8));
  allow(2);
  await_begun(3);  // the last one hangs
  thread_->pick({5, 6});
  while (!thread_->take_pick()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(log_.cancelled, 1);
  await_begun(4);  // it begins again
  const std::uint64_t number = thread_->submit(request(800, 8));
  await_begun(5);
  EXPECT_EQ(log_.cancelled, 2);
  allow(3);
  await_rest();
  const auto smooth = thread_->take_frame();
  ASSERT_TRUE(smooth);
  EXPECT_EQ(smooth->number, number);
  EXPECT_EQ(smooth->samples, 8);
}

TEST_F(RenderThreadTest, HeatMapsHaveOneSample) {
  FrameRequest heat = request(800, 8);
  heat.heat = Heat::kDepth;
  EXPECT_EQ(samples_at_rest(heat), 1);
  EXPECT_EQ(samples_at_rest(request(800, 8)), 8);
  allow(2);
  thread_->submit(heat);
  await_rest();
  EXPECT_EQ(log_.begun.size(), 2u);
  EXPECT_TRUE(thread_->take_frame()->last);
}

TEST_F(RenderThreadTest, ANewRequestStopsAWholePictureAtOnce) {
  thread_->submit(request());
  allow(1);
  await_begun(2);  // the whole one hangs
  const std::uint64_t number = thread_->submit(request());
  await_begun(3);  // it was stopped, though nothing let it go on
  EXPECT_EQ(log_.cancelled, 1);
  allow(2);
  await_rest();
  const auto frame = thread_->take_frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->number, number);
  EXPECT_FALSE(thread_->take_error());
}

TEST_F(RenderThreadTest, OfManyRequestsOnlyTheLastIsDrawn) {
  thread_->submit(request());
  await_begun(1);  // a coarse one is not stopped
  std::uint64_t last = 0;
  for (int i = 0; i < 20; ++i) last = thread_->submit(request());
  allow(3);
  await_rest();
  EXPECT_EQ(thread_->take_frame()->number, last);
  EXPECT_LE(log_.begun.size(), 3u);
}

TEST_F(RenderThreadTest, AFailureIsToldAndTheThreadGoesOn) {
  allow(3);
  thread_->submit(request(13), true);
  await_rest();
  const auto error = thread_->take_error();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->message, "thirteen");
  EXPECT_FALSE(thread_->take_error());
  thread_->submit(request(), true);
  await_rest();
  EXPECT_EQ(thread_->take_frame()->divisor, 1);
}

TEST_F(RenderThreadTest, PicksAreAnswered) {
  thread_->pick({1, 1});  // nothing is shown yet
  EXPECT_TRUE(thread_->resting());
  allow(2);
  thread_->submit(request());
  thread_->pick({5, 6});
  await_rest();
  const auto picked = thread_->take_pick();
  ASSERT_TRUE(picked && *picked);
  EXPECT_EQ((*picked)->pixel, glm::ivec2(5, 6));
}

TEST_F(RenderThreadTest, EndsWhileAPictureIsUnderWay) {
  thread_->submit(request());
  allow(1);
  await_begun(2);
  thread_.reset();
  EXPECT_EQ(log_.cancelled, 1);
}

/// A scene whose pictures take `fixed` ms and `whole` ms more when they are whole.
int settled_divisor(CoarsePolicy& policy, double fixed, double whole) {
  for (int i = 0; i < 20; ++i) {
    const int divisor = policy.divisor();
    policy.learn(divisor, fixed + whole / (divisor * divisor), true);
    if (divisor > 1) policy.learn(1, fixed + whole, false);
  }
  return policy.divisor();
}

TEST(CoarsePolicy, PicturesAreAsFineAsTimeAllows) {
  CoarsePolicy policy;
  EXPECT_EQ(policy.divisor(), 4);
  EXPECT_EQ(settled_divisor(policy, 1, 20), 1);
  EXPECT_EQ(settled_divisor(policy, 2, 100), 2);
  EXPECT_EQ(settled_divisor(policy, 3, 400), 4);
  EXPECT_EQ(settled_divisor(policy, 500, 9000), 16);
  EXPECT_EQ(settled_divisor(policy, 1, 20), 1);  // and back
  policy.forget();
  EXPECT_EQ(policy.divisor(), 4);
}

TEST(CoarsePolicy, OneSlowPictureDoesNotMakeTheNextOnesMuchCoarser) {
  CoarsePolicy policy;
  settled_divisor(policy, 2, 100);
  policy.learn(2, 300, true);
  EXPECT_LE(policy.divisor(), 4);
  policy.learn(4, 8, true);
  policy.learn(3, 13, true);
  EXPECT_EQ(policy.divisor(), 2);
}

TEST(CoarsePolicy, WhatHasChangedIsTriedAStepCoarser) {
  CoarsePolicy policy;
  settled_divisor(policy, 1, 20);
  EXPECT_EQ(policy.divisor(), 1);
  EXPECT_EQ(policy.divisor(true), 2);
}

TEST_F(RenderThreadTest, EndsWhileACoarsePictureIsUnderWay) {
  thread_->submit(request());
  await_begun(1);
  thread_.reset();
  EXPECT_EQ(log_.cancelled, 1);
}

TEST(CoarseSize, CoversTheWholePicture) {
  EXPECT_EQ(coarse_size({800, 600}, 4), glm::ivec2(200, 150));
  EXPECT_EQ(coarse_size({7, 3}, 4), glm::ivec2(2, 1));
  EXPECT_EQ(coarse_size({1, 1}, 16), glm::ivec2(1, 1));
}

csg::Tree ball_and_box() {
  csg::Tree tree;
  const auto mesh = [](const glm::dvec3& low, const glm::dvec3& high) {
    auto soup = std::make_shared<TriangleSoup>();
    for (int i = 0; i < 8; ++i) {
      soup->positions.emplace_back((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                                   (i & 4) != 0 ? high.z : low.z);
    }
    soup->triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                       {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return soup;
  };
  csg::Solid body, hole;
  body.mesh = mesh(glm::dvec3(-5), glm::dvec3(5));
  body.name = "body";
  hole.mesh = mesh(glm::dvec3(-2, -2, 1), glm::dvec3(2, 2, 9));
  hole.name = "hole";
  const auto a = tree.add_solid(body), b = tree.add_solid(hole);
  tree.set_root(tree.add(csg::Operation::kDifference, {a, b}));
  return tree;
}

TEST(CpuRenderer, PicturesAreThoseOfPreview) {
  auto what = std::make_shared<Arrangement>();
  what->tree = ball_and_box();
  FrameRequest request;
  request.what = what;
  request.size = {160, 120};
  request.camera.distance = 40;
  request.look.edges = true;
  const auto renderer = make_renderer();
  const auto frame = renderer->draw(request, {});
  ASSERT_TRUE(frame);
  csg::Preview preview(ball_and_box(), {}, 0);
  const auto expected = preview.picture(request.camera, request.size, request.look);
  ASSERT_TRUE(expected);
  EXPECT_EQ(frame->picture.pixels, expected->pixels);
  EXPECT_GT(frame->report.covered, 100u);
}

TEST(CpuRenderer, PicksAreThePixelsOfThePicture) {
  auto what = std::make_shared<Arrangement>();
  what->tree = ball_and_box();
  FrameRequest request;
  request.what = what;
  request.size = {97, 61};
  request.camera.distance = 40;
  const auto renderer = make_renderer();
  for (const auto projection : {Projection::kPerspective, Projection::kOrthographic}) {
    request.camera.projection = projection;
    csg::Preview preview(ball_and_box(), {}, 0);
    const auto view = make_view(request.camera, request.size, preview.box());
    ASSERT_TRUE(view);
    const auto image = preview.draw(*view);
    ASSERT_TRUE(image);
    int hits = 0;
    for (int v = 0; v < 61; v += 3) {
      for (int u = 0; u < 97; u += 3) {
        const auto picked = renderer->pick(request, {u, v}, {});
        ASSERT_TRUE(picked);
        const auto at = static_cast<std::size_t>(v * 97 + u);
        ASSERT_EQ(picked->hit, (*image)->depth[at] != csg::SurfaceImage::kNone);
        if (!picked->hit) continue;
        ++hits;
        EXPECT_EQ(picked->solid, (*image)->solid[at]);
        EXPECT_EQ(picked->triangle, (*image)->triangle[at] & ~csg::SurfaceImage::kExit);
        // On the box or in the hole, whose floor is at z = 1.
        const glm::dvec3 p = glm::abs(picked->where);
        const double outside = std::max({p.x, p.y, p.z});
        if (!picked->cut) {
          EXPECT_NEAR(outside, 5, 1e-3);
        } else {
          EXPECT_TRUE(std::abs(p.x - 2) < 1e-3 || std::abs(p.y - 2) < 1e-3 ||
                      std::abs(p.z - 1) < 1e-3);
        }
      }
    }
    EXPECT_GT(hits, 50);
  }
}

TEST(CpuRenderer, HeatMapsSayWhatTheirColoursMean) {
  auto what = std::make_shared<Arrangement>();
  what->tree = ball_and_box();
  what->model_solids = what->tree.solids().size();
  FrameRequest request;
  request.what = what;
  request.size = {64, 64};
  request.camera.projection = Projection::kOrthographic;
  request.camera.rotation = {0, 0, 0};
  request.camera.distance = 40;
  const auto renderer = make_renderer();
  request.heat = Heat::kDepth;
  auto frame = renderer->draw(request, {});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->scale.high, 4);
  EXPECT_EQ(frame->longest_list, 4u);
  EXPECT_EQ(frame->picture.pixels[32 * 64 + 32], heat_colour(1.0));
  request.heat = Heat::kThickness;
  frame = renderer->draw(request, {});
  ASSERT_TRUE(frame);
  // Below the hole there are 6 of 10 left.
  EXPECT_EQ(frame->scale.low, 6);
  EXPECT_EQ(frame->scale.high, 10);
  EXPECT_EQ(frame->picture.pixels[32 * 64 + 32], heat_colour(0.0));
  request.heat_range = glm::dvec2(0, 12);
  frame = renderer->draw(request, {});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->scale.high, 12);
  EXPECT_FALSE(frame->scale.above);
  EXPECT_EQ(frame->picture.pixels[32 * 64 + 32], heat_colour(0.5));
  // Along the normal the wall below the hole is as thick, and a pick says so.
  request.heat = Heat::kWall;
  frame = renderer->draw(request, {});
  ASSERT_TRUE(frame);
  EXPECT_GT(frame->report.covered, 1000u);
  const auto picked = renderer->pick(request, {32, 32}, {});
  ASSERT_TRUE(picked);
  ASSERT_TRUE(picked->thickness);
  EXPECT_NEAR(*picked->thickness, 6, 1e-3);
}

TEST(CpuRenderer, AScenesPartsAreSeenThroughByACheapTechniqueWhileItMoves) {
  auto what = std::make_shared<Arrangement>();
  what->tree = ball_and_box();
  what->model_solids = what->tree.solids().size();
  FrameRequest request;
  request.what = what;
  request.size = {64, 64};
  request.camera.distance = 60;
  const auto renderer = make_renderer();
  const auto solid = renderer->draw(request, {});
  request.see_through = SeenThrough{};
  request.see_through->opacity = 0.0f;
  const auto nothing = renderer->draw(request, {});
  request.see_through->opacity = 0.4f;
  const auto exact = renderer->draw(request, {});
  ASSERT_TRUE(solid && nothing && exact);
  const csg::Rgba ground(csg::default_scheme().background, 255);
  for (const csg::Rgba& pixel : nothing->picture.pixels) ASSERT_EQ(pixel, ground);
  // Slivers at outlines are no opaque surface.
  EXPECT_NEAR(static_cast<double>(exact->report.covered),
              static_cast<double>(solid->report.covered), 0.01 * 64 * 64);
  EXPECT_NE(exact->picture.pixels, solid->picture.pixels);
  EXPECT_GE(exact->longest_list, 2u);
  EXPECT_EQ(exact->drawn_by, "CPU, count-scan");
  request.moving = true;
  const auto moving = renderer->draw(request, {});
  ASSERT_TRUE(moving);
  EXPECT_EQ(moving->drawn_by, std::string("CPU, ") + kMovingTechnique);
  EXPECT_NE(moving->picture.pixels, exact->picture.pixels);
  // At rest, errors: none of the exact technique, some of a sum.
  request.moving = false;
  request.see_through->errors = true;
  const auto right = renderer->draw(request, {});
  request.see_through->technique = "weighted-average";
  const auto wrong = renderer->draw(request, {});
  ASSERT_TRUE(right && wrong);
  EXPECT_EQ(right->scale.heat, Heat::kError);
  EXPECT_EQ(right->scale.high, 0.0);
  EXPECT_GT(wrong->scale.high, 0.001);
  request.see_through->technique = "magic";
  EXPECT_FALSE(renderer->draw(request, {}));
}

TEST(CpuRenderer, MediaFillSolidsAtRest) {
  Model model;
  model.scene.tree = csg::Tree(make_box(glm::dvec3(-10), glm::dvec3(10)));
  FrameRequest request;
  request.what = arrange(model, {});
  request.size = {64, 64};
  request.camera.projection = Projection::kOrthographic;
  request.camera.rotation = {0, 0, 0};
  request.camera.distance = 60;
  request.see_through = SeenThrough{};
  auto media = std::make_shared<transparency::MediaSettings>();
  media->media.push_back({"*", {glm::vec3(0.1f), glm::vec3(0.0f)}});
  media->ambient = glm::vec3(0.0f);
  request.see_through->media = media;
  const auto renderer = make_renderer();
  const auto frame = renderer->draw(request, {});
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->drawn_by, "CPU, media");
  // Nothing is scattered: exp(-0.1 * 20) of the background comes through.
  const glm::vec3 ground(csg::default_scheme().background);
  const csg::Rgba middle = frame->picture.pixels[32 * 64 + 32];
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(middle[c], ground[c] * std::exp(-2.0f), 1.0f);
  EXPECT_EQ(frame->picture.pixels[0], csg::Rgba(csg::default_scheme().background, 255));
  request.moving = true;
  const auto moving = renderer->draw(request, {});
  ASSERT_TRUE(moving);
  EXPECT_EQ(moving->drawn_by, std::string("CPU, ") + kMovingTechnique);
}

TEST(CpuRenderer, HeatMapsCountTheScenesSolidsAloneAndWhereTheSectionLeavesThem) {
  Model model;
  model.scene.tree = ball_and_box();
  Looks looks;
  looks.section = csg::SectionPlane{{1, 0, 0}, 0, false};
  looks.ghosts = true;
  FrameRequest request;
  request.what = arrange(model, looks);
  ASSERT_GT(request.what->tree.solids().size(), request.what->model_solids);
  request.size = {64, 64};
  request.camera.projection = Projection::kOrthographic;
  request.camera.rotation = {0, 0, 0};
  request.camera.distance = 40;
  request.heat = Heat::kDepth;
  const auto renderer = make_renderer();
  for (const auto& [normal, empty, full] :
       {std::tuple(glm::dvec3(1, 0, 0), 34, 29), std::tuple(glm::dvec3(-1, 0, 0), 29, 34)}) {
    looks.section->normal = normal;
    request.what = arrange(model, looks);
    const auto frame = renderer->draw(request, {});
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->longest_list, 4u);
    EXPECT_EQ(frame->scale.high, 4);
    const auto at = [&, &pixels = frame->picture.pixels](int u, int v) {
      return pixels[static_cast<std::size_t>(v * 64 + u)];
    };
    EXPECT_EQ(at(full, 32), heat_colour(1.0));
    EXPECT_EQ(at(empty, 32), at(0, 0));  // cut away: the background
  }
  // Across the rays: what lies above the plane is cut away.
  looks.section = csg::SectionPlane{{0, 0, 1}, 3, false};
  request.what = arrange(model, looks);
  const auto frame = renderer->draw(request, {});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->longest_list, 2u);  // the hole's floor, the box's bottom
}

}  // namespace
}  // namespace strata::view
