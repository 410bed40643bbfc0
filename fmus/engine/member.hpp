// One FMU of a plan in one thread: its instance, the polynomials of its inputs, and the newest samples of its outputs.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/engine.h"
#include "engine/library.hpp"

namespace engine {

constexpr int orders = 4;  // rows of a polynomial: c0 to c3

// Outputs at one time, with their time derivatives where they are used.
struct Sample {
  double time = 0.0;
  std::vector<double> values, rates;
};

class Member {
 public:
  explicit Member(const TcaMember& declared);  // instantiates; throws std::runtime_error
  ~Member();
  Member(const Member&) = delete;
  Member& operator=(const Member&) = delete;

  // Prepares another run; parameters: (columns) of that run. All of these return what failed, or null.
  const char* begin(const TcaPlan& plan, const double* parameters, bool again);
  const char* initialize();  // with the inputs that are set, again and again where a loop is iterated
  const char* exit_initialization();
  const char* sample_after_event(double time);               // sends the inputs; the sample is the only one
  const char* step(double time, double length, double end);  // sends the inputs and advances
  const char* record(double* outputs);

  // Keeps what there is now, and returns to it, once.
  const char* keep();
  const char* go_back();

  // Keeps the start of a step, and returns to it, as often as its loop is iterated.
  const char* save();
  const char* restore();

  // Inputs whose source has the sample `newest` at the end of the step, or at the instant of an event.
  void receive(const TcaLink& link, const Member& source, const Sample& newest, double time);
  void receive_tangent(const TcaLink& link, const Member& source, const Sample& newest);

  void accept();                                      // makes the sample of the end of the step the newest of the past
  const Sample& current() const { return current_; }  // at the end of the step in progress
  const Sample& past(size_t before = 0) const { return past_[2 - before]; }  // at its start, or that many steps before
  size_t known() const { return known_; }                                    // such samples since the last event

  double& input(int order, size_t column) { return inputs_[order * declared_.inputs + column]; }
  const TcaMember& declared() const { return declared_; }
  const std::string& messages() const { return said_.messages; }  // of errors, logged since the beginning of the run
  const std::string& warning() const { return said_.warning; }    // the first one since then

 private:
  static void log(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
  const char* send_inputs();
  const char* sample(Sample& into, double time);

  const TcaMember declared_;
  Library library_;
  fmi2CallbackFunctions callbacks_;
  fmi2Component component_ = nullptr;
  struct {
    std::string messages, warning;
  } said_;
  std::vector<double> inputs_, held_;  // (orders, inputs); what the FMU has, where that is constant
  bool has_held_ = false, is_initializing_ = false;
  int degree_ = 0;  // highest order of derivatives sent in this run
  std::vector<fmi2ValueReference> derivative_references_;
  std::vector<fmi2Integer> derivative_orders_, ones_;
  std::array<Sample, 3> past_;  // newest last
  size_t known_ = 0;            // how many of them there are
  Sample current_;
  fmi2FMUstate start_ = nullptr;  // of a step

  struct Kept {
    fmi2FMUstate state = nullptr;
    std::vector<double> inputs;
    std::array<Sample, 3> past;
    size_t known = 0;
    Sample current;
  } kept_;
};

}  // namespace engine
