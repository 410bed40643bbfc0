// Blocks of macro steps; see block.h and Master._advance in cosim/master.py.
#include "engine/block.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "engine/loop.hpp"

namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

class Block {
 public:
  Block(TcaBlock& block, TcaSteps& steps) : block_(block), steps_(steps) {
    for (std::size_t k = 0; k < block.nodes; ++k) {
      nodes_.emplace_back(block.node[k], block.blas);
      varying_ += block.node[k].varying;
      width_ += block.node[k].recorded;
    }
    loops_.reserve(block.components);
    for (std::size_t k = 0; k < block.components; ++k) {
      loops_.emplace_back();
      if (block.component[k].size) loops_.back().emplace(block, block.component[k], nodes_);
      if (block.component[k].size) last_ = &block.component[k];
    }
  }

  long take() {
    const auto begin = Clock::now();
    std::size_t done = 0;
    bool failed = false, stuck = false;
    while (!failed && done < steps_.steps && since(begin) < steps_.limit) {
      if (!save()) {
        failed = true;  // nothing has moved yet
      } else if (!step(done)) {
        failed = true;
        stuck = !go_back();
      } else {
        ++done;
      }
    }
    steps_.failed = failed;
    steps_.seconds = since(begin);
    return stuck ? -1 : static_cast<long>(done);
  }

 private:
  bool save() {
    for (auto& loop : loops_)
      if (loop) loop->remember();
    return std::all_of(nodes_.begin(), nodes_.end(), [](engine::Subsystem& node) { return node.save(); });
  }

  bool go_back() {
    bool good = true;
    for (engine::Subsystem& node : nodes_) good = node.go_back() && good;
    for (auto& loop : loops_)
      if (loop) loop->forget();
    return good;
  }

  bool step(std::size_t number) {
    const double time = steps_.times[number], length = steps_.lengths[number], end = steps_.ends[number];
    double* log = steps_.logs + 3 * number;
    log[0] = 1.0, log[1] = log[2] = 0.0;
    set_signals(number);
    for (std::size_t c = 0; c < block_.components; ++c) {
      const TcaComponent& component = block_.component[c];
      for (std::size_t k = component.first; k < component.first + component.count; ++k) {
        const TcaNode& node = nodes_[k].node();
        if (!nodes_[k].receive(node.upstream_group, node.upstream, nodes_, time)) return false;
      }
      if (!loops_[c]) {
        for (std::size_t k = component.first; k < component.first + component.count; ++k)
          if (!nodes_[k].step(time, length, end)) return false;
        continue;
      }
      const engine::LoopResult result = loops_[c]->solve(time, length, end);
      if (!result.good) return false;
      log[0] = std::max(log[0], result.sweeps);
      log[1] = std::max(log[1], result.residual);
      log[2] = std::max(log[2], result.error);
    }
    if (!record(number)) return false;
    for (engine::Subsystem& node : nodes_) node.accept();
    if (last_) {
      const std::size_t size = 2 * last_->size * last_->size;
      std::copy_n(last_->combined, size, steps_.combined + number * size);
      steps_.kept[number] = last_->kept;
    }
    return true;
  }

  void set_signals(std::size_t number) {
    const double* signal = steps_.signals + number * engine::rows * varying_;
    for (engine::Subsystem& each : nodes_) {
      const TcaNode& node = each.node();
      for (std::size_t k = 0; k < node.varying; ++k, ++signal)
        for (int row = 0; row < engine::rows; ++row)
          node.polynomials[row * node.inputs + node.varying_columns[k]] = signal[row * varying_];
    }
  }

  bool record(std::size_t number) {
    const auto begin = Clock::now();
    double* row = steps_.records + number * width_;
    for (engine::Subsystem& node : nodes_) {
      if (!node.record(row)) return false;
      row += node.node().recorded;
    }
    steps_.recording_seconds += since(begin);
    return true;
  }

  TcaBlock& block_;
  TcaSteps& steps_;
  std::vector<engine::Subsystem> nodes_;
  std::vector<std::optional<engine::Loop>> loops_;  // of each component
  TcaComponent* last_ = nullptr;
  std::size_t varying_ = 0, width_ = 0;
};

}  // namespace

long tca_take_steps(TcaBlock* block, TcaSteps* steps) { return Block(*block, *steps).take(); }

size_t tca_layout(void) {
  return (size_t{TCA_INTERFACE} << 20) + sizeof(TcaBlas) + sizeof(TcaGroup) + sizeof(TcaNode) + sizeof(TcaComponent) +
         sizeof(TcaBlock) + sizeof(TcaSteps);
}
