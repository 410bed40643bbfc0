// The algebraic loop of one component over a macro step, solved as cosim/algebraic_loop.py does by quasi-Newton (IQN).
#pragma once

#include <vector>

#include "engine/iteration.hpp"
#include "engine/past_solutions.hpp"
#include "engine/subsystem.hpp"

namespace engine {

class Loop {
 public:
  Loop(const TcaBlock& block, TcaComponent& component, std::vector<Subsystem>& nodes);

  LoopResult solve(double time, double length, double end);

  void remember();  ///< What was learned so far, for forget().
  void forget();

 private:
  void pack(const double* (*sample)(Subsystem&), double* x);
  bool sweep(const std::vector<double>& x, double time, double length, double end);
  bool restore();

  TcaComponent& component_;
  std::vector<Subsystem>& nodes_;
  Iteration iteration_;
  PastSolutions past_;
  std::vector<double> start_, x_;
  std::vector<std::vector<double>> guesses_;  // samples of all nodes with the guess in them
  std::vector<const double*> guess_;
};

}  // namespace engine
