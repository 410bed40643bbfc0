#include "fmu/model_cache.hpp"

#include <atomic>
#include <deque>
#include <memory>

#include "core/spin_lock.hpp"

namespace thermal {
namespace {

std::atomic_flag is_taken;

std::deque<std::shared_ptr<const DerivedModel>>& kept() {
  static std::deque<std::shared_ptr<const DerivedModel>> models;
  return models;
}

}  // namespace

std::optional<DerivedModel> find_derived(const Parameters& parameters) {
  std::shared_ptr<const DerivedModel> kept_model;
  {
    const core::SpinLock lock(is_taken);
    for (const auto& each : kept())
      if (each->parameters.has_same_section(parameters)) kept_model = each;
  }
  return kept_model ? std::optional(*kept_model) : std::nullopt;
}

void keep_derived(const DerivedModel& derived) {
  auto copy = std::make_shared<const DerivedModel>(derived);
  const core::SpinLock lock(is_taken);
  kept().push_back(std::move(copy));
  if (kept().size() > kMaxDerived) kept().pop_front();
}

}  // namespace thermal
