#pragma once

#include <memory>

#include "apps/strata/commands.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"
#include "strata/hashbuffer/list_source.h"

namespace strata::apps {

class Session;

/// The GPU of a job. What it gives is the CPU's, bit for bit; it was tried on a small example.
class Gpu {
 public:
  /// Null where the CPU is to do the work: --backend cpu, or auto without a hardware GPU; a note
  /// says why. A software renderer is used under --backend gl only.
  /// @return kUsage under --backend gl, with a sentence, where no context can be had or the driver
  /// lacks something
  static Result<std::unique_ptr<Gpu>> open(Backend backend, Session& session);

  virtual ~Gpu() = default;
  /// Null where `store`, or the driver under --backend auto, is no good: a warning says so.
  /// @return as open()
  virtual Result<ListSource*> lists(StoreKind store) = 0;
  virtual Result<csg::SurfaceSource*> surfaces() = 0;
};

}  // namespace strata::apps
