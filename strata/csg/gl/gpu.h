#pragma once

#include <functional>
#include <memory>
#include <string>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/build_ldi.h"
#include "strata/hashbuffer/tile_lists.h"

namespace strata::csg {

class SurfaceSource;

/// Which GPU a job wants, and the callbacks for messages about it.
struct GpuRequest {
  /// Empty: a hardware GPU if there is one that passes the self-test, else none. Otherwise the name
  /// of the option that requires OpenGL, such as "--backend gl", for messages. Then a software
  /// renderer is accepted, and no OpenGL is an error.
  std::string required_by;
  std::function<void(std::string text)> note;  ///< the choice, and its reason; may be empty
  std::function<void(std::string text)> warn;  ///< when the CPU takes over; may be empty
};

/// The GPU of a job. Its results equal the CPU's, bit for bit; a small example has tested that.
class Gpu {
 public:
  /// Null if the CPU does the work; a note says why. Never null if a GPU is required.
  /// @return kUsage if a GPU is required and no context can be made
  static Result<std::unique_ptr<Gpu>> open(GpuRequest request);

  virtual ~Gpu() = default;
  /// Null if `store` or the driver cannot be used; a warning says so. An error if a GPU is
  /// required, or for a stop. If none is required, a GPU that fails later leaves the rest to the
  /// CPU. @param execution  for the lists; its memory limit bounds the pixels done at once
  virtual Result<ListSource*> lists(StoreKind store, const Execution& execution = {}) = 0;
  /// As lists(), for Preview::set_source().
  virtual Result<SurfaceSource*> surfaces() = 0;
};

}  // namespace strata::csg
