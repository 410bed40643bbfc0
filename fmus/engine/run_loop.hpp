// The algebraic loop of one part of a run: what is known of it, and its iteration over a step or at one instant.
#pragma once

#include <memory>

#include "engine/iteration.hpp"
#include "engine/member.hpp"
#include "engine/past_solutions.hpp"

namespace engine {

using Members = std::vector<std::unique_ptr<Member>>;

// A loop's unknowns and what is learned of them, in memory of its own.
class LoopMemory {
 public:
  explicit LoopMemory(std::vector<double> nominals);
  LoopMemory(const LoopMemory&) = delete;
  LoopMemory& operator=(const LoopMemory&) = delete;

  TcaComponent& component() { return component_; }

 private:
  std::vector<double> scale_, columns_, combined_, times_, solutions_;
  TcaComponent component_;
};

class RunLoop {
 public:
  RunLoop(const TcaPlan& plan, const TcaPart& part);

  void begin();   // forgets what was learned, for another run
  void arrive();  // forgets past solutions: polynomials do not continue across events

  // Iterates until the end values of the unknowns are consistent. sweep(): sets inputs by guess(), steps all members
  // of the part, and returns whether all succeeded; restore(): sets them back to the start of the step.
  template <class Sweep, class Restore>
  LoopResult step(const Members& members, double time, double length, double end, Sweep sweep, Restore restore) {
    begin_step(members, time);
    set_first_guess(members, time, length, end);
    const auto evaluate = [&](const std::vector<double>& x, double* swept) {
      set_guess(end, x, false);
      if (!sweep()) return false;
      pack(members, false, swept);
      return true;
    };
    const LoopResult result = iteration_.solve(start_.data(), x_, evaluate, restore);
    if (result.good) past_.add(end, x_.data());
    return result;
  }

  // Iterates at one instant, from the outputs that there are; rates: those of outputs that have them are unknown too.
  template <class Sweep>
  LoopResult settle(const Members& members, double time, bool rates, Sweep sweep) {
    Instant& instant = rates ? later_ : first_;
    instant.memory.component().kept = 0;
    pack(members, rates, instant.x.data());
    instant.start = instant.x;
    const auto evaluate = [&](const std::vector<double>& x, double* swept) {
      set_guess(time, x, rates);
      if (!sweep()) return false;
      pack(members, rates, swept);
      return true;
    };
    return instant.iteration.solve(instant.start.data(), instant.x, evaluate, [] { return true; });
  }

  const Sample& guess(size_t member) const { return guesses_[member]; }

  void remember();  // what was learned so far, for forget()
  void forget();

 private:
  // Unknowns that are outputs of one member: so many, from the first one on.
  struct Group {
    size_t member, first, count;
  };
  static std::vector<Group> groups_of(const TcaPart& part);

  // Memory of an iteration at one instant, which learns nothing from others.
  struct Instant {
    Instant(const TcaPlan& plan, std::vector<double> nominals);

    LoopMemory memory;
    Iteration iteration;
    std::vector<double> start, x;
  };

  void begin_step(const Members& members, double time);
  void set_first_guess(const Members& members, double time, double length, double end);
  void predict(const Member& source, const Group& group, double time, double length);
  void pack(const Members& members, bool rates, double* x) const;
  void set_guess(double time, const std::vector<double>& x, bool rates);
  std::vector<double> instant_nominals(bool rates) const;

  const TcaPlan& plan_;
  const TcaPart& part_;
  const Blas blas_;
  const std::vector<Group> groups_;
  LoopMemory memory_;
  Iteration iteration_;
  PastSolutions past_;
  Instant first_, later_;  // at the start of a run, and when rates are known
  std::vector<double> start_, x_, polynomial_, shifted_, columns_;
  std::vector<Sample> guesses_;  // of all members; empty where none of their outputs are guessed
};

}  // namespace engine
