#include "apps/view/scene/loader.h"

namespace strata::view {

void Loader::start(const apps::CsgCommand& command, int threads) {
  cancel();  // so that it reports no more
  progress_ = 0;
  begin_ = std::chrono::steady_clock::now();
  job_.start("reading", [this, command, threads](const std::stop_token& stop) {
    Execution execution;
    execution.threads = threads;
    execution.stop = stop;
    execution.progress = [this, stop](double fraction) {
      if (!stop.stop_requested()) progress_ = fraction;
    };
    return load_model(command, execution);
  });
}

double Loader::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

}  // namespace strata::view
