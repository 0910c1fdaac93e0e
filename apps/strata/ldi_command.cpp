#include <glm/vec3.hpp>
#include <utility>

#include "apps/session/option_values.h"
#include "apps/session/session.h"
#include "apps/strata/library_session.h"
#include "apps/strata/run_commands.h"
#include "strata/csg/input/solid_input.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/hashbuffer/formats/ldi_io.h"
#include "strata/raster/lattice_mesh.h"

namespace strata::apps {

Result<void> run_ldi(const LdiCommand& command, Session& session) {
  const bool exr = has_extension(command.output, ".exr");
  const bool npz = has_extension(command.output, ".npz");
  const bool png = has_extension(command.output, ".png");
  if (!exr && !npz && !png) {
    return fail(ErrorCode::kUsage, "{}: layered depth images are written as .exr, .npz or .png",
                command.output);
  }
  if (!exr && command.samples) {
    return fail(ErrorCode::kUsage, "{}: --samples needs an .exr file", command.output);
  }
  auto input =
      csg::load_solids(command.input, false, messages_of(session), session.execution("reading"));
  if (!input) return tl::unexpected(input.error());
  if (auto strict = session.check_strict(); !strict) return strict;
  const auto grid = fit_input_grid(input->bounds, command.grid, command.input.files.front());
  if (!grid) return tl::unexpected(grid.error());

  const Execution execution = session.execution("depth lists", 0.8);
  if (auto done = input->fit(*grid, execution); !done) return done;
  const auto lattice = snap_to_lattice(input->soup, *grid, execution);
  if (!lattice) return tl::unexpected(lattice.error());
  const auto gpu = open_gpu(command.backend, session);
  if (!gpu) return tl::unexpected(gpu.error());
  ListSource* source = nullptr;
  if (*gpu) {
    const auto lists = (*gpu)->lists(command.store, session.execution("depth lists"));
    if (!lists) return tl::unexpected(lists.error());
    source = *lists;
  }
  const RasterTarget target = raster_target(*grid, command.axis);
  const TileListFilter* filter = input->tree ? &input->tree->filter() : nullptr;
  auto image = source != nullptr ? build_ldi(*source, *lattice, target, execution, filter)
                                 : build_ldi(*lattice, target,
                                             {.store = command.store, .offsets = command.offsets},
                                             execution, filter);
  if (!image) return tl::unexpected(image.error());
  image->world_from_image = world_from_image(*grid, command.axis);
  session.note(fmt::format("{} x {} pixels, {}", image->width, image->height,
                           counted(image->items.size(), "crossing")));

  const Execution writing = session.execution("writing", 1.0);
  if (png) return write_xray_png(command.output, *image);
  return exr ? write_ldi_exr(command.output, *image, {.samples = command.samples}, writing)
             : write_ldi_npz(command.output, *image, {}, writing);
}

}  // namespace strata::apps
