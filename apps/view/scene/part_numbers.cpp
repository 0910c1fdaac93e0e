#include "apps/view/scene/part_numbers.h"

#include <sys/resource.h>

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

#include "strata/csg/boundary/boundary_mesh.h"

namespace strata::view {
namespace {

/// Usual values; plastics as printed solid.
constexpr Material kMaterials[] = {
    {"PLA", 1.24},       {"PETG", 1.27},  {"ABS", 1.04},    {"ASA", 1.07},       {"TPU", 1.21},
    {"nylon", 1.14},     {"PC", 1.20},    {"resin", 1.15},  {"aluminium", 2.70}, {"steel", 7.85},
    {"stainless", 8.00}, {"brass", 8.50}, {"copper", 8.96}, {"titanium", 4.43},  {"concrete", 2.40},
    {"wood", 0.70},      {"glass", 2.50}, {"water", 1.00}};

Result<PartNumbers> measure_safely(const Arrangement& what, const Execution& execution) {
  try {
    return measure_part(what, execution);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory while measuring");
  } catch (const std::exception& failure) {
    return fail(ErrorCode::kInternal, "internal error: {}", failure.what());
  }
}

}  // namespace

std::span<const Material> materials() { return kMaterials; }

const Material* find_material(std::string_view name) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  const auto* found =
      std::find_if(std::begin(kMaterials), std::end(kMaterials), [&](const Material& one) {
        return std::equal(one.name.begin(), one.name.end(), name.begin(), name.end(),
                          [&](char a, char b) { return lower(a) == lower(b); });
      });
  return found == std::end(kMaterials) ? nullptr : found;
}

double weight_of(const PartNumbers& numbers, const Material& material) {
  return numbers.volume * material.density / 1000.0;  // mm3 to cm3
}

Result<PartNumbers> measure_part(const Arrangement& what, const Execution& execution) {
  const auto measured = csg::exact_measures(what.tree, what.tree.root(), {}, execution);
  if (!measured) return tl::unexpected(measured.error());
  PartNumbers numbers;
  numbers.empty = measured->empty;
  if (!measured->empty) numbers.size = measured->high - measured->low;
  numbers.volume = measured->volume;
  numbers.area = measured->area;
  numbers.centre = measured->centre;
  numbers.open_holes = measured->report.caps.size();
  return numbers;
}

void PartMeasurer::start(std::shared_ptr<const Arrangement> what) {
  cancel();
  const std::lock_guard lock(mutex_);
  const std::uint64_t number = ++current_;
  busy_ = true;
  std::erase_if(jobs_, [](const Job& job) { return job.ended->load(); });
  auto ended = std::make_shared<std::atomic<bool>>(false);
  auto work = [this, what = std::move(what), number, ended](const std::stop_token& stop) {
    constexpr int kLow = 10;
    ::setpriority(PRIO_PROCESS, 0, kLow);  // on Linux, of this thread
    Execution execution;
    execution.threads = 1;
    execution.stop = stop;
    auto result = measure_safely(*what, execution);
    {
      const std::lock_guard inner(mutex_);
      if (number == current_) {
        busy_ = false;
        done_ = std::move(result);
      }
    }
    wake_();
    ended->store(true);
  };
  jobs_.push_back({ended, std::jthread(std::move(work))});
}

void PartMeasurer::cancel() {
  const std::lock_guard lock(mutex_);
  ++current_;
  busy_ = false;
  done_.reset();
  if (!jobs_.empty()) jobs_.back().thread.request_stop();
}

bool PartMeasurer::busy() const {
  const std::lock_guard lock(mutex_);
  return busy_;
}

std::optional<Result<PartNumbers>> PartMeasurer::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(done_, {});
}

}  // namespace strata::view
