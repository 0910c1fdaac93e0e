#pragma once

#include <functional>
#include <memory>
#include <string>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/list_source.h"
#include "strata/hashbuffer/tile_lists.h"

namespace strata::csg {

class SurfaceSource;

/// Which GPU a job wants, and who hears of it.
struct GpuRequest {
  /// Empty: a hardware GPU if there is one and it is fit, else none. Else what asks for one, such
  /// as
  /// "--backend gl", for messages: a software renderer will do, and that there is none is an error.
  std::string required_by;
  std::function<void(std::string text)> note;  ///< what was chosen, and why; may be empty
  std::function<void(std::string text)> warn;  ///< where the CPU takes over; may be empty
};

/// The GPU of a job. What it gives is the CPU's, bit for bit; it was tried on a small example.
class Gpu {
 public:
  /// Null where the CPU is to do the work, a note says why. Never null where a GPU is required.
  /// @return kUsage where one is required and no context can be had
  static Result<std::unique_ptr<Gpu>> open(GpuRequest request);

  virtual ~Gpu() = default;
  /// Null where `store` or the driver is no good: a warning says so. An error where a GPU is
  /// required, or for a stop. Where none is required, a GPU that fails later leaves the rest to the
  /// CPU. @param execution  of the lists; its memory limit bounds the pixels done at once
  virtual Result<ListSource*> lists(StoreKind store, const Execution& execution = {}) = 0;
  virtual Result<SurfaceSource*> surfaces() = 0;
};

}  // namespace strata::csg
