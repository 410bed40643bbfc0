// A plan in one thread: instances of all members, which one run after another uses.
#pragma once

#include <memory>

#include "engine/run_loop.hpp"

namespace engine {

class Run {
 public:
  explicit Run(const TcaPlan& plan);  // instantiates every FMU; throws std::runtime_error

  // Each returns whether it succeeded; outputs: row of what all members record.
  bool begin(const double* parameters, const double* inputs, double* outputs);
  bool step(size_t k, double* outputs);

  // Takes the first steps and goes back, so that memory is there and caches are warm; false where it cannot go back.
  bool rehearse(size_t steps);

  const std::string& failure() const { return failure_; }
  std::string warnings() const;              // the first of each member since the beginning; empty where there is none
  size_t width() const { return width_; }    // columns of a row of outputs
  size_t sweeps() const { return sweeps_; }  // most sweeps of a loop in the newest step

 private:
  struct Part {
    const TcaPart& declared;
    std::unique_ptr<RunLoop> loop;  // null: there is none
  };

  bool report(const char* what, const Member& member);
  bool report(const LoopResult& result, const Part& part);
  template <class Do>
  bool all_of(const Part& part, Do act);  // whether act(member) gives null for each, until one does not
  template <class Evaluate>
  bool settle(double time, bool initial, Evaluate evaluate);
  bool sweep(const Part& part, size_t number);
  bool arrive(size_t row, double time);
  bool record(double* outputs);
  void set_signals(size_t row);
  void set_polynomials(size_t m, size_t number);
  double driven(size_t k, size_t column, double otherwise) const;

  const TcaPlan& plan_;
  Members members_;
  std::vector<Part> parts_;
  std::vector<size_t> first_;  // number of the first input of each member, among those of all
  std::vector<long> own_;      // column of a run's own inputs for each of them; -1: none
  size_t inputs_ = 0, width_ = 0, sweeps_ = 0;
  const double* of_run_ = nullptr;  // (steps, driven) inputs of this run
  bool used_ = false;
  std::string failure_;
};

}  // namespace engine
