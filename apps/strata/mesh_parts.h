#pragma once

#include <span>

#include "apps/commands/commands.h"
#include "apps/session/session.h"
#include "strata/csg/boundary/face_parts.h"
#include "strata/csg/input/scene_input.h"

namespace strata::apps {

/// The parts and colours that files give the faces of their meshes, as --ids and --colours ask.
/// Solids of scenes stay one part each.
/// @param facts  of the files, with attributes
/// @return kInput: attributes that are not those of the mesh; kLimit; kCancelled
Result<csg::FaceParts> face_parts(const csg::Tree& tree, std::span<const csg::InputFacts> facts,
                                  csg::BoundaryParts parts, Session& session,
                                  const Execution& execution);

/// The world's unit, which a 3MF states; the millimetre where it is not known.
[[nodiscard]] LengthUnit unit_of_output(const csg::SceneInput& input);

}  // namespace strata::apps
