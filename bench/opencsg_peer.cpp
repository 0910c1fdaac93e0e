#include "bench/opencsg_peer.h"

#include <GL/glew.h>
// GLEW's header comes before all of GL's.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <opencsg.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <utility>

namespace strata::bench {
namespace {

/// A corner of a face as the shading pass takes it.
struct Corner {
  glm::vec3 position, normal;
};

/// Buffers of a solid: shared vertices for OpenCSG's passes, corners with normals to shade.
struct Buffers {
  GLuint positions = 0, indices = 0, corners = 0;
  GLsizei count = 0;
};

GLuint upload(GLenum target, const void* data, std::size_t bytes) {
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(target, buffer);
  glBufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
  glBindBuffer(target, 0);
  return buffer;
}

Buffers make_buffers(const PeerSolid& solid) {
  std::vector<glm::vec3> positions(solid.positions.begin(), solid.positions.end());
  std::vector<Corner> corners;
  corners.reserve(3 * solid.triangles.size());
  for (const glm::uvec3& t : solid.triangles) {
    const glm::dvec3 across = glm::cross(solid.positions[t.y] - solid.positions[t.x],
                                         solid.positions[t.z] - solid.positions[t.x]);
    const double length = glm::length(across);
    const glm::vec3 normal(length > 0 ? across / length : glm::dvec3(0, 0, 1));
    for (int i = 0; i < 3; ++i) corners.push_back({positions[t[i]], normal});
  }
  Buffers buffers;
  buffers.count = static_cast<GLsizei>(3 * solid.triangles.size());
  buffers.positions =
      upload(GL_ARRAY_BUFFER, positions.data(), positions.size() * sizeof(glm::vec3));
  buffers.indices =
      upload(GL_ELEMENT_ARRAY_BUFFER, solid.triangles.data(), solid.triangles.size_bytes());
  buffers.corners = upload(GL_ARRAY_BUFFER, corners.data(), corners.size() * sizeof(Corner));
  return buffers;
}

void draw_positions(const Buffers& buffers) {
  glEnableClientState(GL_VERTEX_ARRAY);
  glBindBuffer(GL_ARRAY_BUFFER, buffers.positions);
  glVertexPointer(3, GL_FLOAT, 0, nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers.indices);
  glDrawElements(GL_TRIANGLES, buffers.count, GL_UNSIGNED_INT, nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, 0);
  glBindBuffer(GL_ARRAY_BUFFER, 0);
  glDisableClientState(GL_VERTEX_ARRAY);
}

void draw_corners(const Buffers& buffers) {
  glEnableClientState(GL_VERTEX_ARRAY);
  glEnableClientState(GL_NORMAL_ARRAY);
  glBindBuffer(GL_ARRAY_BUFFER, buffers.corners);
  glVertexPointer(3, GL_FLOAT, sizeof(Corner), nullptr);
  glNormalPointer(GL_FLOAT, sizeof(Corner),
                  reinterpret_cast<const void*>(offsetof(Corner, normal)));
  glDrawArrays(GL_TRIANGLES, 0, buffers.count);
  glBindBuffer(GL_ARRAY_BUFFER, 0);
  glDisableClientState(GL_NORMAL_ARRAY);
  glDisableClientState(GL_VERTEX_ARRAY);
}

class MeshPrimitive : public OpenCSG::Primitive {
 public:
  MeshPrimitive(OpenCSG::Operation operation, const PeerSolid& solid, const Buffers& buffers)
      : Primitive(operation, solid.convexity), buffers_(&buffers) {}
  void render() override { draw_positions(*buffers_); }

 private:
  const Buffers* buffers_;
};

/// From eye space to what OpenGL clips, so that window depths are View's depths and pixels its
/// pixels.
glm::dmat4 clip_from_eye(const View& view) {
  // image = (u w, v w, depth w, w); window coordinates have v upwards.
  glm::dmat4 clip_from_image(0.0);
  clip_from_image[0][0] = 2.0 / view.size.x;
  clip_from_image[1][1] = -2.0 / view.size.y;
  clip_from_image[2][2] = 2.0 / kPictureDepthLimit;
  clip_from_image[3] = {-1.0, 1.0, -1.0, 1.0};
  return clip_from_image * view.image_from_world * glm::inverse(view.eye_from_world);
}

/// The box around a solid in normalized device coordinates; all of space when it cannot be told.
void set_box(OpenCSG::Primitive& primitive, const Bounds& box, const glm::dmat4& clip_from_world) {
  glm::dvec3 low(1.0), high(-1.0);
  for (int i = 0; i < 8; ++i) {
    const glm::dvec4 p = clip_from_world * glm::dvec4((i & 1) != 0 ? box.high.x : box.low.x,
                                                      (i & 2) != 0 ? box.high.y : box.low.y,
                                                      (i & 4) != 0 ? box.high.z : box.low.z, 1.0);
    if (!(p.w > 0)) return;
    low = glm::min(low, glm::dvec3(p) / p.w);
    high = glm::max(high, glm::dvec3(p) / p.w);
  }
  const glm::vec3 l(glm::max(low, glm::dvec3(-1.0))), h(glm::min(high, glm::dvec3(1.0)));
  primitive.setBoundingBox(l.x, l.y, l.z, h.x, h.y, h.z);
}

}  // namespace

struct OpenCsgPeer::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLSurface surface = EGL_NO_SURFACE;
  EGLContext context = EGL_NO_CONTEXT;
  glm::ivec2 size{0};
  glm::dmat4 projection{1.0}, model{1.0};
  std::vector<Buffers> solids;
  std::vector<std::vector<std::unique_ptr<MeshPrimitive>>> products;
  std::vector<Product> sources;

  ~Impl() {
    if (context != EGL_NO_CONTEXT) {
      clear();
      OpenCSG::freeResources();
      eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      eglDestroyContext(display, context);
    }
    if (surface != EGL_NO_SURFACE) eglDestroySurface(display, surface);
    if (display != EGL_NO_DISPLAY) eglTerminate(display);
  }

  Result<void> start();

  void clear() {
    products.clear();
    for (const Buffers& b : solids) {
      for (const GLuint buffer : {b.positions, b.indices, b.corners}) glDeleteBuffers(1, &buffer);
    }
    solids.clear();
  }

  void shade(std::uint32_t solid, bool subtracted) const {
    // Of a solid that is taken away its back faces are seen, from within.
    constexpr std::array<GLfloat, 4> kFace{0.976f, 0.843f, 0.173f, 1},
        kCut{0.616f, 0.796f, 0.318f, 1};
    glCullFace(subtracted ? GL_FRONT : GL_BACK);
    glLightModeli(GL_LIGHT_MODEL_TWO_SIDE, subtracted ? 1 : 0);
    glMaterialfv(GL_FRONT_AND_BACK, GL_AMBIENT_AND_DIFFUSE, (subtracted ? kCut : kFace).data());
    draw_corners(solids[solid]);
  }
};

Result<void> OpenCsgPeer::Impl::start() {
  const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display == nullptr) return fail(ErrorCode::kInternal, "EGL without platforms");
  display = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) == 0) {
    return fail(ErrorCode::kInternal, "no EGL display without a surface");
  }
  constexpr std::array<EGLint, 17> kConfig{EGL_SURFACE_TYPE,
                                           EGL_PBUFFER_BIT,
                                           EGL_RENDERABLE_TYPE,
                                           EGL_OPENGL_BIT,
                                           EGL_RED_SIZE,
                                           8,
                                           EGL_GREEN_SIZE,
                                           8,
                                           EGL_BLUE_SIZE,
                                           8,
                                           EGL_ALPHA_SIZE,
                                           8,
                                           EGL_DEPTH_SIZE,
                                           24,
                                           EGL_STENCIL_SIZE,
                                           8,
                                           EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  if (eglChooseConfig(display, kConfig.data(), &config, 1, &configs) == 0 || configs == 0) {
    return fail(ErrorCode::kInternal, "no EGL configuration with depth and stencil");
  }
  const std::array<EGLint, 5> area{EGL_WIDTH, size.x, EGL_HEIGHT, size.y, EGL_NONE};
  surface = eglCreatePbufferSurface(display, config, area.data());
  eglBindAPI(EGL_OPENGL_API);
  context = eglCreateContext(display, config, EGL_NO_CONTEXT, nullptr);
  if (surface == EGL_NO_SURFACE || context == EGL_NO_CONTEXT ||
      eglMakeCurrent(display, surface, surface, context) == 0) {
    return fail(ErrorCode::kInternal, "no OpenGL context: EGL error {:#x}", eglGetError());
  }
  // It also looks for a display, which is not there and not needed; what counts comes first.
  glewExperimental = GL_TRUE;
  const GLenum state = glewInit();
  if (state != GLEW_OK && state != GLEW_ERROR_NO_GLX_DISPLAY) {
    return fail(ErrorCode::kInternal, "GLEW cannot start: {}", state);
  }
  return {};
}

OpenCsgPeer::OpenCsgPeer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
OpenCsgPeer::~OpenCsgPeer() = default;

Result<std::unique_ptr<OpenCsgPeer>> OpenCsgPeer::make(const glm::ivec2& size, int threads) {
  setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 1);
  setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
  auto impl = std::make_unique<Impl>();
  impl->size = size;
  if (auto done = impl->start(); !done) return tl::unexpected(done.error());
  return std::unique_ptr<OpenCsgPeer>(new OpenCsgPeer(std::move(impl)));
}

std::string OpenCsgPeer::renderer() const {
  const auto text = [](GLenum name) {
    const GLubyte* found = glGetString(name);
    return found == nullptr ? std::string("?") : std::string(reinterpret_cast<const char*>(found));
  };
  return text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION) + ", " + OPENCSG_VERSION_STRING;
}

void OpenCsgPeer::load(std::span<const PeerSolid> solids, std::span<const Product> products,
                       const View& view, bool with_boxes) {
  impl_->clear();
  impl_->projection = clip_from_eye(view);
  impl_->model = view.eye_from_world;
  const glm::dmat4 clip_from_world = impl_->projection * impl_->model;
  for (const PeerSolid& solid : solids) impl_->solids.push_back(make_buffers(solid));
  impl_->sources.assign(products.begin(), products.end());
  for (const Product& product : products) {
    auto& primitives = impl_->products.emplace_back();
    const auto add = [&](OpenCSG::Operation operation, std::uint32_t solid) {
      primitives.push_back(
          std::make_unique<MeshPrimitive>(operation, solids[solid], impl_->solids[solid]));
      if (with_boxes) set_box(*primitives.back(), solids[solid].box, clip_from_world);
    };
    for (const std::uint32_t solid : product.intersected) add(OpenCSG::Intersection, solid);
    for (const std::uint32_t solid : product.subtracted) add(OpenCSG::Subtraction, solid);
  }
}

void OpenCsgPeer::draw() {
  glViewport(0, 0, impl_->size.x, impl_->size.y);
  glClearColor(1.0f, 1.0f, 0.898f, 1.0f);
  glClearDepth(1.0);
  glDepthMask(GL_TRUE);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  glMatrixMode(GL_PROJECTION);
  glLoadMatrixd(glm::value_ptr(impl_->projection));
  glMatrixMode(GL_MODELVIEW);
  glLoadIdentity();
  // Two lights of the eye.
  constexpr std::array<GLfloat, 4> kFirst{-1, 1, 1, 0}, kSecond{1, -1, 1, 0}, kWhite{1, 1, 1, 1};
  glLightfv(GL_LIGHT0, GL_POSITION, kFirst.data());
  glLightfv(GL_LIGHT1, GL_POSITION, kSecond.data());
  glLightfv(GL_LIGHT1, GL_DIFFUSE, kWhite.data());
  glLoadMatrixd(glm::value_ptr(impl_->model));
  glShadeModel(GL_FLAT);
  glEnable(GL_DEPTH_TEST);
  std::vector<OpenCSG::Primitive*> primitives;
  for (std::size_t i = 0; i < impl_->products.size(); ++i) {
    glDepthFunc(GL_LESS);
    if (impl_->products[i].size() > 1) {
      primitives.clear();
      for (const auto& primitive : impl_->products[i]) primitives.push_back(primitive.get());
      OpenCSG::render(primitives);
      glDepthFunc(GL_EQUAL);
    }
    glEnable(GL_CULL_FACE);
    glEnable(GL_LIGHTING);
    glEnable(GL_LIGHT0);
    glEnable(GL_LIGHT1);
    for (const std::uint32_t solid : impl_->sources[i].intersected) impl_->shade(solid, false);
    for (const std::uint32_t solid : impl_->sources[i].subtracted) impl_->shade(solid, true);
    glDisable(GL_LIGHTING);
    glDisable(GL_CULL_FACE);
  }
  glFinish();
}

std::vector<float> OpenCsgPeer::depths() const {
  const auto width = static_cast<std::size_t>(impl_->size.x);
  const auto height = static_cast<std::size_t>(impl_->size.y);
  std::vector<float> pixels(width * height);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, impl_->size.x, impl_->size.y, GL_DEPTH_COMPONENT, GL_FLOAT, pixels.data());
  for (std::size_t row = 0; row < height / 2; ++row) {
    std::swap_ranges(pixels.begin() + static_cast<std::ptrdiff_t>(row * width),
                     pixels.begin() + static_cast<std::ptrdiff_t>((row + 1) * width),
                     pixels.begin() + static_cast<std::ptrdiff_t>((height - 1 - row) * width));
  }
  return pixels;
}

}  // namespace strata::bench
