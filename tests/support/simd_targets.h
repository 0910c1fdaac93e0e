#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace strata::testkit {

/// Calls body(name) with run-time dispatch held to one SIMD target after another: all that were
/// compiled, the scalar one included, and that this machine has. Expects that the dispatch obeys.
/// For one thread at a time, while no other thread dispatches. @return the number of targets
int for_each_simd_target(const std::function<void(const std::string& name)>& body);

}  // namespace strata::testkit
