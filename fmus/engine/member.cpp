#include "engine/member.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace engine {
namespace {

constexpr size_t longest_message = 1000;  // characters kept of one message, and of all messages of a run

bool failed(fmi2Status status) { return status > fmi2Warning; }

template <typename Set, typename Value>
bool set(Set* function, fmi2Component component, const TcaValues& values, const Value* of) {
  return values.size == 0 || !failed(function(component, values.references, values.size, of));
}

}  // namespace

void Member::log(fmi2ComponentEnvironment environment, fmi2String, fmi2Status status, fmi2String, fmi2String message,
                 ...) {
  auto& [messages, warning] = static_cast<Member*>(environment)->said_;
  if (status == fmi2OK || (status == fmi2Warning ? !warning.empty() : messages.size() > longest_message)) return;
  char text[longest_message];
  va_list arguments;
  va_start(arguments, message);
  std::vsnprintf(text, sizeof text, message, arguments);
  va_end(arguments);
  if (status == fmi2Warning)
    warning = text;  // there is room for it: steps allocate nothing
  else
    messages += messages.empty() ? text : std::string("; ") + text;
}

Member::Member(const TcaMember& declared)
    : declared_(declared),
      library_(declared.library),
      callbacks_{&Member::log, std::calloc, std::free, nullptr, this},
      inputs_(orders * declared.inputs),
      held_(orders * declared.inputs),
      ones_(declared.outputs, 1) {
  for (int order = 1; order < orders; ++order)
    for (size_t k = 0; k < declared.inputs; ++k) {
      derivative_references_.push_back(declared.input_references[k]);
      derivative_orders_.push_back(order);
    }
  for (Sample* one : {&past_[0], &past_[1], &past_[2], &current_}) {
    one->values.resize(declared.outputs);
    one->rates.resize(declared.outputs);
  }
  said_.warning.reserve(longest_message);
  component_ = library_.instantiate(declared.name, fmi2CoSimulation, declared.guid, declared.resources, &callbacks_,
                                    fmi2False, fmi2True);
  if (!component_) throw std::runtime_error(std::string(declared.name) + " cannot be instantiated: " + said_.messages);
}

Member::~Member() {
  if (start_) library_.free_state(component_, &start_);
  if (component_) library_.free_instance(component_);
}

const char* Member::begin(const TcaPlan& plan, const double* parameters, bool again) {
  said_.messages.clear();
  said_.warning.clear();
  std::fill(inputs_.begin(), inputs_.end(), 0.0);
  has_held_ = is_initializing_ = false;
  degree_ = 0;
  known_ = 0;
  if (again && failed(library_.reset(component_))) return "fmi2Reset";
  if (failed(
          library_.setup_experiment(component_, plan.tolerance > 0.0, plan.tolerance, plan.start, fmi2True, plan.stop)))
    return "fmi2SetupExperiment";
  const TcaMember& d = declared_;
  if (!set(library_.set_real, component_, d.reals, static_cast<const fmi2Real*>(d.reals.values)) ||
      !set(library_.set_integer, component_, d.integers, static_cast<const fmi2Integer*>(d.integers.values)) ||
      !set(library_.set_boolean, component_, d.booleans, static_cast<const fmi2Boolean*>(d.booleans.values)) ||
      !set(library_.set_string, component_, d.strings, static_cast<const fmi2String*>(d.strings.values)))
    return "setting parameters";
  for (size_t k = 0; k < d.varied; ++k)
    if (failed(library_.set_real(component_, d.varied_references + k, 1, parameters + d.varied_columns[k])))
      return "setting parameters";
  return nullptr;
}

const char* Member::initialize() {
  const auto write = [&] {
    return declared_.inputs &&
           failed(library_.set_real(component_, declared_.input_references, declared_.inputs, inputs_.data()));
  };
  if (!is_initializing_) {
    if (write()) return "setting inputs";
    if (failed(library_.enter_initialization(component_))) return "fmi2EnterInitializationMode";
    is_initializing_ = true;
  }
  if (write()) return "setting inputs";
  if (declared_.outputs &&
      failed(library_.get_real(component_, declared_.output_references, declared_.outputs, current_.values.data())))
    return "reading outputs";
  return nullptr;
}

const char* Member::exit_initialization() {
  return failed(library_.exit_initialization(component_)) ? "fmi2ExitInitializationMode" : nullptr;
}

// Sends values, and derivatives up to the highest order used in this run; constant inputs that the FMU has are not
// sent.
const char* Member::send_inputs() {
  const size_t n = declared_.inputs;
  if (!n || (has_held_ && held_ == inputs_)) return nullptr;
  has_held_ = false;
  if (failed(library_.set_real(component_, declared_.input_references, n, inputs_.data()))) return "setting inputs";
  int degree = declared_.input_degree;
  const auto zero = [](double value) { return value == 0.0; };
  while (degree && std::all_of(inputs_.begin() + degree * n, inputs_.begin() + (degree + 1) * n, zero)) --degree;
  degree_ = std::max(degree_, degree);
  if (degree_ && failed(library_.set_input_derivatives(component_, derivative_references_.data(), degree_ * n,
                                                       derivative_orders_.data(), inputs_.data() + n)))
    return "setting derivatives of inputs";
  if (!degree) {
    held_ = inputs_;
    has_held_ = true;
  }
  return nullptr;
}

const char* Member::sample(Sample& into, double time) {
  into.time = time;
  if (!declared_.outputs) return nullptr;
  if (failed(library_.get_real(component_, declared_.output_references, declared_.outputs, into.values.data())))
    return "reading outputs";
  for (double value : into.values)
    if (!std::isfinite(value)) return "an output is not finite";
  if (declared_.needs_rates &&
      failed(library_.get_output_derivatives(component_, declared_.output_references, declared_.outputs, ones_.data(),
                                             into.rates.data())))
    return "reading derivatives of outputs";
  return nullptr;
}

const char* Member::sample_after_event(double time) {
  if (const char* what = send_inputs()) return what;
  if (const char* what = sample(current_, time)) return what;
  past_[2] = current_;
  known_ = 1;
  return nullptr;
}

const char* Member::step(double time, double length, double end) {
  if (const char* what = send_inputs()) return what;
  if (failed(library_.do_step(component_, time, length, fmi2True))) return "fmi2DoStep";
  return sample(current_, end);
}

const char* Member::keep() {
  if (failed(library_.get_state(component_, &kept_.state))) return "fmi2GetFMUstate";
  kept_.inputs = inputs_, kept_.past = past_, kept_.known = known_, kept_.current = current_;
  return nullptr;
}

const char* Member::go_back() {
  const bool good = !failed(library_.set_state(component_, kept_.state));
  library_.free_state(component_, &kept_.state);
  kept_.state = nullptr;
  inputs_ = kept_.inputs, past_ = kept_.past, known_ = kept_.known, current_ = kept_.current;
  has_held_ = false;
  return good ? nullptr : "fmi2SetFMUstate";
}

const char* Member::save() { return failed(library_.get_state(component_, &start_)) ? "fmi2GetFMUstate" : nullptr; }

const char* Member::restore() {
  has_held_ = false;
  return failed(library_.set_state(component_, start_)) ? "fmi2SetFMUstate" : nullptr;
}

void Member::accept() {
  std::swap(past_[0], past_[1]);
  std::swap(past_[1], past_[2]);
  past_[2].time = current_.time;
  past_[2].values = current_.values;  // of one size: nothing is allocated
  past_[2].rates = current_.rates;
  if (known_ < past_.size()) ++known_;
}

const char* Member::record(double* outputs) {
  if (!declared_.recorded) return nullptr;
  return failed(library_.get_real(component_, declared_.recorded_references, declared_.recorded, outputs))
             ? "reading outputs"
             : nullptr;
}

void Member::receive_tangent(const TcaLink& link, const Member& source, const Sample& newest) {
  input(0, link.input) = newest.values[link.output];
  if (source.declared_.needs_rates && source.known_) input(1, link.input) = newest.rates[link.output];
}

// The polynomials are those of cosim/extrapolation.py, about the start of the step, where the last past sample lies.
void Member::receive(const TcaLink& link, const Member& source, const Sample& newest, double time) {
  const Sample &a = source.past_[2], &b = newest;
  const double h = b.time - a.time, value = a.values[link.output], end = b.values[link.output], rise = end - value;
  const double slope = a.rates[link.output], last = b.rates[link.output];
  const bool rates = source.declared_.needs_rates;
  double c[orders] = {value, 0.0, 0.0, 0.0};
  int method = link.method;
  if (method == TCA_PARABOLA && source.known_ < 2) method = rates ? -TCA_PARABOLA : TCA_LINE;
  if (method == TCA_CUBIC && !rates) method = TCA_LINE;
  switch (method) {
    case TCA_CONSTANT:
      c[0] = end;
      break;
    case TCA_LINE:
      c[1] = rise / h;
      c[0] = value + c[1] * (time - a.time);
      break;
    case -TCA_PARABOLA:  // two samples, and the slope at the first
      c[1] = slope;
      c[2] = (rise / h - slope) * (2.0 / h);
      break;
    case TCA_PARABOLA: {  // about the newest sample, then moved to the start of the step
      const Sample& first = source.past_[1];
      const double before = (value - first.values[link.output]) / (a.time - first.time), after = rise / h;
      const double bend = (after - before) * (2.0 / (b.time - first.time)), at_end = after + bend * (0.5 * h);
      const double s = time - b.time;
      c[0] = end + s * at_end + s * s / 2.0 * bend;
      c[1] = at_end + s * bend;
      c[2] = bend;
      break;
    }
    default: {  // Hermite's cubic
      c[1] = slope;
      // Powers as Python takes them, products fused as the library does that multiplies these matrices for numpy.
      const volatile double two = 2.0;  // compilers take h * h for pow(h, 2.0)
      const double square = std::pow(h, two), cube = std::pow(h, 3.0);
      c[2] = std::fma(-2.0 / h, last, std::fma(6.0 / square, rise, -4.0 / h * slope));
      c[3] = std::fma(6.0 / square, last, std::fma(-12.0 / cube, rise, 6.0 / square * slope));
    }
  }
  for (int order = 0; order < orders; ++order) input(order, link.input) = c[order];
}

}  // namespace engine
