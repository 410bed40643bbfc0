#include "engine/loop.hpp"

#include <algorithm>

namespace engine {

Loop::Loop(const TcaBlock& block, TcaComponent& component, std::vector<Subsystem>& nodes)
    : component_(component),
      nodes_(nodes),
      iteration_(block.blas, component, {block.tolerance, block.radius, block.max_sweeps}),
      past_(component),
      start_(component.size),
      x_(component.size),
      guesses_(nodes.size()),
      guess_(nodes.size()) {
  for (std::size_t k = 0; k < component.sources; ++k) {
    std::vector<double>& guess = guesses_[component.source[k]];
    guess.resize(1 + 2 * nodes[component.source[k]].node().outputs);
    guess_[component.source[k]] = guess.data();
  }
}

void Loop::pack(const double* (*sample)(Subsystem&), double* x) {
  const std::size_t* output = component_.output;
  for (std::size_t k = 0; k < component_.sources; ++k) {
    const double* from = sample(nodes_[component_.source[k]]);
    for (std::size_t i = 0; i < component_.source_size[k]; ++i) *x++ = from[1 + *output++];
  }
}

bool Loop::sweep(const std::vector<double>& x, double time, double length, double end) {
  const std::size_t* output = component_.output;
  const double* value = x.data();
  for (std::size_t k = 0; k < component_.sources; ++k) {
    const std::size_t source = component_.source[k];
    std::vector<double>& guess = guesses_[source];
    std::copy_n(nodes_[source].past(2), guess.size(), guess.data());
    guess[0] = end;
    for (std::size_t i = 0; i < component_.source_size[k]; ++i) guess[1 + *output++] = *value++;
  }
  const std::size_t last = component_.first + component_.count;
  for (std::size_t k = component_.first; k < last; ++k) {
    const TcaNode& node = nodes_[k].node();
    if (!nodes_[k].receive(node.torn_group, node.torn, nodes_, time, guess_.data())) return false;
  }
  for (std::size_t k = component_.first; k < last; ++k) {
    const TcaNode& node = nodes_[k].node();
    if (!nodes_[k].receive(node.forward_group, node.forward, nodes_, time) || !nodes_[k].step(time, length, end))
      return false;
  }
  return true;
}

bool Loop::restore() {
  const auto node = nodes_.begin() + static_cast<std::ptrdiff_t>(component_.first);
  return std::all_of(node, node + static_cast<std::ptrdiff_t>(component_.count),
                     [](Subsystem& each) { return each.restore(); });
}

LoopResult Loop::solve(double time, double length, double end) {
  pack([](Subsystem& node) { return node.past(2); }, start_.data());
  if (component_.solved < TCA_LEAST || component_.times[component_.solved - 1] != time) return {};
  past_.guess(end, x_.data());
  const LoopResult result = iteration_.solve(
      start_.data(), x_,
      [&](const std::vector<double>& x, double* swept) {
        if (!sweep(x, time, length, end)) return false;
        pack([](Subsystem& node) { return node.current(); }, swept);
        return true;
      },
      [&] { return restore(); });
  if (result.good) past_.add(end, x_.data());
  return result;
}

void Loop::remember() {
  iteration_.remember();
  past_.remember();
}

void Loop::forget() {
  iteration_.forget();
  past_.forget();
}

}  // namespace engine
