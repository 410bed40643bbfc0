// Which function the FMI 2.0 standard allows in which state of a co-simulation slave (2.0.4, section 4.2.4), one row
// each.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace fmu {

enum class Mode : std::uint8_t { instantiated, initialization, step_complete, step_failed, terminated, error, fatal };
inline constexpr std::array<std::string_view, 7> kModeNames{
    "instantiated", "initialization mode", "step complete", "step failed", "terminated", "error", "fatal"};

constexpr unsigned in(Mode mode) { return 1u << static_cast<unsigned>(mode); }

struct Call {
  std::string_view name;
  unsigned allowed;  // one bit per Mode
  constexpr bool is_allowed(Mode mode) const { return allowed & in(mode); }
};

namespace call {
inline constexpr unsigned kStart = in(Mode::instantiated), kInitialization = in(Mode::initialization),
                          kStepped = in(Mode::step_complete), kFailed = in(Mode::step_failed),
                          kTerminated = in(Mode::terminated), kError = in(Mode::error);
inline constexpr unsigned kLive = kStart | kInitialization | kStepped | kFailed | kTerminated | kError;
inline constexpr unsigned kReadable = kInitialization | kStepped | kFailed | kTerminated | kError;
// The standard lets a host only end or restore after a discarded step. Our state is valid at the last successful time,
// so going on from there is allowed too.
inline constexpr unsigned kSteppable = kStepped | kFailed;
inline constexpr unsigned kSettable = kStart | kInitialization | kSteppable;

inline constexpr Call set_debug_logging{"fmi2SetDebugLogging", kLive};
inline constexpr Call setup_experiment{"fmi2SetupExperiment", kStart};
inline constexpr Call enter_initialization{"fmi2EnterInitializationMode", kStart};
inline constexpr Call exit_initialization{"fmi2ExitInitializationMode", kInitialization};
inline constexpr Call terminate{"fmi2Terminate", kSteppable};
inline constexpr Call reset{"fmi2Reset", kLive};
inline constexpr Call get_real{"fmi2GetReal", kReadable};
inline constexpr Call get_integer{"fmi2GetInteger", kReadable};
inline constexpr Call get_boolean{"fmi2GetBoolean", kReadable};
inline constexpr Call get_string{"fmi2GetString", kReadable};
inline constexpr Call set_real{"fmi2SetReal", kSettable};
inline constexpr Call set_integer{"fmi2SetInteger", kSettable};
inline constexpr Call set_boolean{"fmi2SetBoolean", kSettable};
inline constexpr Call set_string{"fmi2SetString", kSettable};
inline constexpr Call get_state{"fmi2GetFMUstate", kLive};
inline constexpr Call set_state{"fmi2SetFMUstate", kLive};
inline constexpr Call free_state{"fmi2FreeFMUstate", kLive};
inline constexpr Call state_size{"fmi2SerializedFMUstateSize", kLive};
inline constexpr Call serialize_state{"fmi2SerializeFMUstate", kLive};
inline constexpr Call deserialize_state{"fmi2DeSerializeFMUstate", kLive};
inline constexpr Call directional_derivative{"fmi2GetDirectionalDerivative", kReadable};
inline constexpr Call set_input_derivatives{"fmi2SetRealInputDerivatives", kSettable};
inline constexpr Call get_output_derivatives{"fmi2GetRealOutputDerivatives", kReadable & ~kInitialization};
inline constexpr Call do_step{"fmi2DoStep", kSteppable};
inline constexpr Call cancel_step{"fmi2CancelStep", 0};  // only while a step is in progress, and ours never are
inline constexpr unsigned kInquirable = kStepped | kFailed | kTerminated;
inline constexpr Call get_status{"fmi2GetStatus", kInquirable};
inline constexpr Call get_real_status{"fmi2GetRealStatus", kInquirable};
inline constexpr Call get_integer_status{"fmi2GetIntegerStatus", kInquirable};
inline constexpr Call get_boolean_status{"fmi2GetBooleanStatus", kInquirable};
inline constexpr Call get_string_status{"fmi2GetStringStatus", kInquirable};
// Model exchange is not offered: no state allows its functions.
inline constexpr Call enter_event_mode{"fmi2EnterEventMode", 0};
inline constexpr Call new_discrete_states{"fmi2NewDiscreteStates", 0};
inline constexpr Call enter_continuous_time_mode{"fmi2EnterContinuousTimeMode", 0};
inline constexpr Call completed_integrator_step{"fmi2CompletedIntegratorStep", 0};
inline constexpr Call set_time{"fmi2SetTime", 0};
inline constexpr Call set_continuous_states{"fmi2SetContinuousStates", 0};
inline constexpr Call get_derivatives{"fmi2GetDerivatives", 0};
inline constexpr Call get_event_indicators{"fmi2GetEventIndicators", 0};
inline constexpr Call get_continuous_states{"fmi2GetContinuousStates", 0};
inline constexpr Call get_nominals{"fmi2GetNominalsOfContinuousStates", 0};
}  // namespace call

}  // namespace fmu
