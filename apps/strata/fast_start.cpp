// Highway 1.0.3 measures the resolution of the timer whenever its library is loaded, for a
// benchmark tool inside it: 8 ms of every start, more than reading a mesh of 100,000 triangles.
// The dynamic linker takes the executable's definition before the library's, so this one spares the
// measurement. Nothing of Strata uses that tool.

#include <hwy/nanobenchmark.h>

#include <cstdint>

namespace hwy::platform {

// Not declared in a public header of 1.0.3.
HWY_DLLEXPORT std::uint64_t TimerResolution();
std::uint64_t TimerResolution() { return 1; }

}  // namespace hwy::platform
