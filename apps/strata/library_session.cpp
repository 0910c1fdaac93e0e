#include "apps/strata/library_session.h"

#include <utility>

namespace strata::apps {

csg::InputMessages messages_of(Session& session) {
  csg::InputMessages messages;
  messages.warn = [&session](std::string code, std::string message) {
    session.warn(std::move(code), std::move(message));
  };
  messages.note = [&session](std::string_view line) { session.note(line); };
  messages.echo = [&session](std::string_view line) { session.echo(line); };
  messages.opened = [&session](std::span<const FileIdentity> files) {
    return session.opened(files);
  };
  return messages;
}

Result<std::unique_ptr<csg::Gpu>> open_gpu(Backend backend, Session& session) {
  if (backend == Backend::kCpu) return nullptr;
#ifdef STRATA_HAVE_GL
  csg::GpuRequest request;
  if (backend == Backend::kGl) request.required_by = "--backend gl";
  request.note = [&session](const std::string& text) { session.note(text); };
  request.warn = [&session](std::string text) { session.warn("backend", std::move(text)); };
  return csg::Gpu::open(std::move(request));
#else
  (void)session;
  if (backend == Backend::kAuto) return nullptr;
  return fail(ErrorCode::kUsage,
              "--backend gl: this strata was built without OpenGL (STRATA_WITH_GL, libepoxy-dev)");
#endif
}

Result<VoxelGrid> fit_input_grid(const Bounds& box, const GridRequest& request,
                                 const std::string& file) {
  if (auto valid = check_grid_request(request); !valid) return tl::unexpected(valid.error());
  auto grid = fit_grid(box, request);
  if (!grid) return fail(grid.error().code, "{}: {}", file, grid.error().message);
  return grid;
}

}  // namespace strata::apps
