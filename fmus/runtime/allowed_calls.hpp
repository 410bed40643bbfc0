// Which function the FMI 2.0 standard allows in which state of an instance (2.0.4, sections 3.2.3 and 4.2.4), one row
// each.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace fmu {

enum class Interface : std::uint8_t { co_simulation, model_exchange };
inline constexpr std::array<std::string_view, 2> kInterfaceNames{"co-simulation", "model exchange"};

/// States of both interfaces; those between initialization and terminated belong to one of them.
enum class Mode : std::uint8_t {
  instantiated,
  initialization,
  step_complete,
  step_failed,
  event,
  continuous,
  terminated,
  error,
  fatal
};
inline constexpr std::array<std::string_view, 9> kModeNames{
    "instantiated",         "initialization mode", "step complete", "step failed", "event mode",
    "continuous-time mode", "terminated",          "error",         "fatal"};

constexpr unsigned in(Mode mode) { return 1u << static_cast<unsigned>(mode); }

struct Call {
  std::string_view name;
  unsigned slave;     // one bit per Mode, co-simulation
  unsigned exchange;  // the same, model exchange
  constexpr unsigned allowed(Interface interface) const {
    return interface == Interface::co_simulation ? slave : exchange;
  }
  constexpr bool is_allowed(Interface interface, Mode mode) const { return allowed(interface) & in(mode); }
};

namespace call {
inline constexpr unsigned kStart = in(Mode::instantiated), kInitialization = in(Mode::initialization),
                          kStepped = in(Mode::step_complete), kFailed = in(Mode::step_failed), kEvent = in(Mode::event),
                          kContinuous = in(Mode::continuous), kTerminated = in(Mode::terminated),
                          kError = in(Mode::error);

/// The same for both interfaces, where a slave that waits for its next step is what an initialised model is.
constexpr Call both(std::string_view name, unsigned modes) {
  // The standard lets a host only end or restore after a discarded step. Our state is valid at the last successful
  // time, so going on from there is allowed too.
  constexpr unsigned slave = kStepped | kFailed, exchange = kEvent | kContinuous;
  const unsigned common = modes & ~(slave | exchange);
  return {name, common | (modes & slave), common | (modes & exchange)};
}
constexpr Call slave_only(std::string_view name, unsigned modes) { return {name, modes, 0}; }
constexpr Call exchange_only(std::string_view name, unsigned modes) { return {name, 0, modes}; }

inline constexpr unsigned kRunning = kStepped | kFailed | kEvent | kContinuous;
inline constexpr unsigned kLive = kStart | kInitialization | kRunning | kTerminated | kError;
inline constexpr unsigned kReadable = kInitialization | kRunning | kTerminated | kError;
inline constexpr unsigned kSettable = kStart | kInitialization | kRunning;
inline constexpr unsigned kDiscrete = kSettable & ~kContinuous;

inline constexpr Call set_debug_logging = both("fmi2SetDebugLogging", kLive);
inline constexpr Call setup_experiment = both("fmi2SetupExperiment", kStart);
inline constexpr Call enter_initialization = both("fmi2EnterInitializationMode", kStart);
inline constexpr Call exit_initialization = both("fmi2ExitInitializationMode", kInitialization);
inline constexpr Call terminate = both("fmi2Terminate", kRunning);
inline constexpr Call reset = both("fmi2Reset", kLive);
inline constexpr Call get_real = both("fmi2GetReal", kReadable);
inline constexpr Call get_integer = both("fmi2GetInteger", kReadable);
inline constexpr Call get_boolean = both("fmi2GetBoolean", kReadable);
inline constexpr Call get_string = both("fmi2GetString", kReadable);
inline constexpr Call set_real = both("fmi2SetReal", kSettable);
inline constexpr Call set_integer = both("fmi2SetInteger", kDiscrete);
inline constexpr Call set_boolean = both("fmi2SetBoolean", kDiscrete);
inline constexpr Call set_string = both("fmi2SetString", kDiscrete);
inline constexpr Call get_state = both("fmi2GetFMUstate", kLive);
inline constexpr Call set_state = both("fmi2SetFMUstate", kLive);
inline constexpr Call free_state = both("fmi2FreeFMUstate", kLive);
inline constexpr Call state_size = both("fmi2SerializedFMUstateSize", kLive);
inline constexpr Call serialize_state = both("fmi2SerializeFMUstate", kLive);
inline constexpr Call deserialize_state = both("fmi2DeSerializeFMUstate", kLive);
inline constexpr Call directional_derivative = both("fmi2GetDirectionalDerivative", kReadable);

inline constexpr Call set_input_derivatives =
    slave_only("fmi2SetRealInputDerivatives", kSettable & ~kEvent & ~kContinuous);
inline constexpr Call get_output_derivatives =
    slave_only("fmi2GetRealOutputDerivatives", kStepped | kFailed | kTerminated | kError);
inline constexpr Call do_step = slave_only("fmi2DoStep", kStepped | kFailed);
inline constexpr Call cancel_step =
    slave_only("fmi2CancelStep", 0);  // only while a step is in progress: ours never are
inline constexpr unsigned kInquirable = kStepped | kFailed | kTerminated;
inline constexpr Call get_status = slave_only("fmi2GetStatus", kInquirable);
inline constexpr Call get_real_status = slave_only("fmi2GetRealStatus", kInquirable);
inline constexpr Call get_integer_status = slave_only("fmi2GetIntegerStatus", kInquirable);
inline constexpr Call get_boolean_status = slave_only("fmi2GetBooleanStatus", kInquirable);
inline constexpr Call get_string_status = slave_only("fmi2GetStringStatus", kInquirable);

inline constexpr unsigned kEnded = kTerminated | kError;
inline constexpr Call enter_event_mode = exchange_only("fmi2EnterEventMode", kEvent | kContinuous);
inline constexpr Call new_discrete_states = exchange_only("fmi2NewDiscreteStates", kEvent);
inline constexpr Call enter_continuous_time_mode = exchange_only("fmi2EnterContinuousTimeMode", kEvent);
inline constexpr Call completed_integrator_step = exchange_only("fmi2CompletedIntegratorStep", kContinuous);
inline constexpr Call set_time = exchange_only("fmi2SetTime", kEvent | kContinuous);
inline constexpr Call set_continuous_states = exchange_only("fmi2SetContinuousStates", kContinuous);
inline constexpr Call get_derivatives =
    exchange_only("fmi2GetDerivatives", kInitialization | kEvent | kContinuous | kEnded);
inline constexpr Call get_event_indicators =
    exchange_only("fmi2GetEventIndicators", kInitialization | kEvent | kContinuous | kEnded);
inline constexpr Call get_continuous_states =
    exchange_only("fmi2GetContinuousStates", kInitialization | kEvent | kContinuous | kEnded);
inline constexpr Call get_nominals =
    exchange_only("fmi2GetNominalsOfContinuousStates", kStart | kInitialization | kEvent | kContinuous | kEnded);
}  // namespace call

}  // namespace fmu
