// Outcome of an operation that may fail: what failed, where, what to do about it, and whether a smaller step can help.
//
// The one way in which models, integrators and solvers report failure. Success is a null pointer: it allocates nothing.
// This folder depends on the standard library alone, so that the cores of both FMUs can use it without the FMI runtime.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace core {

/// Remedy open to a caller. The FMI runtime returns fmi2Discard or fmi2Error accordingly.
enum class Severity : std::uint8_t {
  discard,  // a smaller step, or another point, may succeed
  error     // no smaller step can help
};

struct Failure {
  Severity severity = Severity::error;
  std::string what;    // the quantity, its value and the allowed range
  std::string remedy;  // what the user can change; may be empty
  std::string where;   // the component, time [s] and step [s]; added by Status::at() on the way up

  /// "where: what; remedy"
  std::string text() const {
    std::string result = where;
    if (!result.empty()) result += ": ";
    result += what;
    if (!remedy.empty()) result += "; " + remedy;
    return result;
  }
};

/// Success, or a Failure. Movable, not copyable.
class [[nodiscard]] Status {
 public:
  Status() = default;

  /// A failure that a smaller step or another point may avoid.
  static Status discard(std::string what, std::string remedy = {}) {
    return Status(Severity::discard, std::move(what), std::move(remedy));
  }
  /// A failure that no smaller step can avoid.
  static Status error(std::string what, std::string remedy = {}) {
    return Status(Severity::error, std::move(what), std::move(remedy));
  }

  bool is_ok() const noexcept { return !failure_; }
  bool is_discard() const noexcept { return failure_ && failure_->severity == Severity::discard; }
  bool is_error() const noexcept { return failure_ && failure_->severity == Severity::error; }

  /// Precondition: !is_ok().
  const Failure& failure() const noexcept { return *failure_; }

  /// The whole message; empty on success.
  std::string text() const { return failure_ ? failure_->text() : std::string(); }

  /// The same status with the place of the failure put in front; does nothing on success. Build an expensive `where`
  /// only behind a test of is_ok().
  Status at(std::string_view where) && {
    if (failure_) failure_->where = std::string(where) + (failure_->where.empty() ? "" : ", ") + failure_->where;
    return std::move(*this);
  }

  /// The same failure as one that no smaller step can avoid; does nothing on success.
  Status as_error() && {
    if (failure_) failure_->severity = Severity::error;
    return std::move(*this);
  }

 private:
  Status(Severity severity, std::string what, std::string remedy)
      : failure_(std::make_unique<Failure>(Failure{severity, std::move(what), std::move(remedy), {}})) {}

  std::unique_ptr<Failure> failure_;
};

/// A value and whether it is valid.
template <class Value>
struct Result {
  Value value{};
  Status status;

  Result() = default;
  Result(Value good) : value(std::move(good)) {}        // NOLINT(google-explicit-constructor): return value;
  Result(Status failed) : status(std::move(failed)) {}  // NOLINT(google-explicit-constructor): return status;
};

}  // namespace core
