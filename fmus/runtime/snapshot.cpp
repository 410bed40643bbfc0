#include "runtime/snapshot.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "model/hash.hpp"

namespace fmu {
namespace {

static_assert(std::endian::native == std::endian::little, "serialised states are little-endian");

using Word = std::uint64_t;
constexpr Word kMagic = 0x3153554d46414354;  // "TCAFMUS1"
constexpr Word kVersion = 3;
constexpr std::size_t kFixedWords = 19;  // all but the values, built_with, memory and input_rates

std::size_t value_count(const Blueprint& blueprint) {
  return blueprint.parameters.size() + std::tuple_size_v<Polynomial> * blueprint.inputs.size();
}

class Writer {
 public:
  explicit Writer(std::span<std::byte> bytes) : bytes_(bytes) {}
  void put(Word word) {
    std::memcpy(bytes_.data() + used_, &word, sizeof(Word));
    used_ += sizeof(Word);
  }
  void put(double value) { put(std::bit_cast<Word>(value)); }
  void put(std::span<const double> values) {
    put(Word{values.size()});
    for (const double value : values) put(value);
  }
  std::span<const std::byte> written() const { return bytes_.first(used_); }

 private:
  std::span<std::byte> bytes_;
  std::size_t used_ = 0;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::size_t bytes_left() const { return bytes_.size(); }
  Word word() {
    if (bytes_.size() < sizeof(Word)) throw Error("the bytes end too early");
    Word word;
    std::memcpy(&word, bytes_.data(), sizeof(Word));
    bytes_ = bytes_.subspan(sizeof(Word));
    return word;
  }
  bool flag() {
    const Word word_ = word();
    if (word_ > 1) throw Error("the serialised state has a flag that is neither 0 nor 1");
    return word_ == 1;
  }
  double number() { return std::bit_cast<double>(word()); }
  std::vector<double> numbers() {
    const Word count = word();
    if (count > bytes_.size() / sizeof(Word)) throw Error("the bytes end too early");
    std::vector<double> values(count);
    for (double& value : values) value = number();
    return values;
  }

 private:
  std::span<const std::byte> bytes_;
};

/// Refuses everything but what serialise() wrote for this table.
void check(const Blueprint& blueprint, std::span<const std::byte> bytes) {
  const std::string remedy = "; pass the bytes that fmi2SerializeFMUstate of this FMU wrote, unchanged";
  Reader reader(bytes);
  if (bytes.size() % sizeof(Word) != 0 || bytes.size() < kFixedWords * sizeof(Word) || reader.word() != kMagic)
    throw Error("this is no serialised state of a tca-cosim FMU (" + std::to_string(bytes.size()) + " bytes)" + remedy);
  if (const Word version = reader.word(); version != kVersion)
    throw Error("the serialised state has format version " + std::to_string(version) + ", this FMU reads version " +
                std::to_string(kVersion) + "; serialise it anew with this FMU");
  if (const Word length = reader.word(); length != bytes.size())
    throw Error("the serialised state is " + std::to_string(length) + " bytes long, " + std::to_string(bytes.size()) +
                " were given" + remedy);
  Reader last(bytes.last(sizeof(Word)));
  if (last.word() != hash(bytes.first(bytes.size() - sizeof(Word))))
    throw Error("the serialised state is damaged: its checksum does not match" + remedy);
  if (reader.word() != hash(blueprint.guid))
    throw Error("the serialised state belongs to another FMU, version or configuration than " +
                blueprint.identity.name + " " + blueprint.guid + remedy);
}

[[noreturn]] void refuse(const std::string& what) {
  throw Error("the serialised state is not one that this FMU can be in: " + what +
              "; pass the bytes that fmi2SerializeFMUstate wrote, unchanged");
}

/// Refuses values that no sequence of calls produces. A checksum protects against damage, not against forgery, and
/// whatever a state sets must be safe to build and to run with.
void validate(const Blueprint& blueprint, const Snapshot& snapshot) {
  const Progress& progress = snapshot.progress;
  const bool is_slave = progress.interface == Interface::co_simulation;
  const bool is_starting = progress.mode == Mode::instantiated || progress.mode == Mode::initialization;
  const unsigned slave = in(Mode::step_complete) | in(Mode::step_failed),
                 exchange = in(Mode::event) | in(Mode::continuous);
  if (progress.mode == Mode::fatal || (in(progress.mode) & (is_slave ? exchange : slave)))
    refuse("state '" + std::string(kModeNames[static_cast<std::size_t>(progress.mode)]) + "' of an instance for " +
           std::string(kInterfaceNames[static_cast<std::size_t>(progress.interface)]));
  if (!std::isfinite(progress.time) || !std::isfinite(progress.start) || std::isnan(progress.stop))
    refuse("its time is not finite");
  if (!std::isfinite(progress.last_step) || progress.last_step < 0.0) refuse("its last step is not a length");
  const bool is_built = !snapshot.built_with.empty();
  if (is_built && snapshot.built_with.size() != blueprint.parameters.size())
    refuse("it has another number of parameters");
  if (progress.mode == Mode::instantiated && progress.is_initialised)
    refuse("it has started before its initialisation");
  if ((!is_starting || progress.is_initialised) && !(is_built && progress.is_initialised)) refuse("it was never built");
  if (!progress.is_initialised && !snapshot.memory.empty()) refuse("it remembers steps without having started");
  for (std::size_t i = 0; i < blueprint.parameters.size(); ++i) {
    const Variable& row = blueprint.rows[blueprint.parameters[i]];
    const double value = value_of(row, snapshot.data.data());
    if (!is_in_range(row, value)) refuse(row.name + " is out of its range");
    if (!is_built) continue;
    if (!is_in_range(row, snapshot.built_with[i])) refuse(row.name + " is out of its range");
    if (progress.is_initialised && (!row.is_tunable || row.is_retuned) && value != snapshot.built_with[i])
      refuse(row.name + " differs from what it was built with");
  }
  for (const std::size_t index : blueprint.inputs) {
    const Variable& row = blueprint.rows[index];
    const auto parts = load<Polynomial>(snapshot.data.data(), row.offset);
    for (const double part : parts)
      if (!std::isfinite(part)) refuse(row.name + " is not finite");
    if (!is_in_widened_range(row, parts[0])) refuse(row.name + " is out of its range");
  }
  if (!snapshot.input_rates.empty() && snapshot.input_rates.size() != blueprint.inputs.size())
    refuse("it has another number of inputs");
  for (const double rate : snapshot.input_rates)
    if (!std::isfinite(rate)) refuse("the rate of an input is not finite");
}

}  // namespace

std::size_t serialised_size(const Blueprint& blueprint, const Snapshot& snapshot) {
  return sizeof(Word) * (kFixedWords + value_count(blueprint) + snapshot.built_with.size() + snapshot.memory.size() +
                         snapshot.input_rates.size());
}

void serialise(const Blueprint& blueprint, const Snapshot& snapshot, std::span<std::byte> bytes) {
  const Progress& progress = snapshot.progress;
  Writer writer(bytes);
  writer.put(kMagic);
  writer.put(kVersion);
  writer.put(Word{serialised_size(blueprint, snapshot)});
  writer.put(hash(blueprint.guid));
  writer.put(Word{static_cast<unsigned>(progress.mode)});
  writer.put(Word{progress.is_initialised});
  writer.put(progress.time);
  writer.put(progress.stop);
  writer.put(Word{progress.steps});
  writer.put(Word{static_cast<unsigned>(progress.interface)});
  writer.put(progress.last_step);
  writer.put(Word{progress.warnings_given});
  writer.put(Word{progress.is_tolerance_set});
  writer.put(progress.start);
  std::vector<double> values;
  for (const std::size_t index : blueprint.parameters)
    values.push_back(value_of(blueprint.rows[index], snapshot.data.data()));
  for (const std::size_t index : blueprint.inputs)
    for (const double part : load<Polynomial>(snapshot.data.data(), blueprint.rows[index].offset))
      values.push_back(part);
  writer.put(std::span<const double>(values));
  writer.put(std::span(snapshot.built_with));
  writer.put(std::span(snapshot.memory));
  writer.put(std::span(snapshot.input_rates));
  writer.put(hash(writer.written()));
}

Snapshot deserialise(const Blueprint& blueprint, std::span<const std::byte> bytes, std::span<const std::byte> data) {
  check(blueprint, bytes);
  Reader reader(bytes.subspan(4 * sizeof(Word)));  // behind magic, version, length, table
  Snapshot snapshot;
  snapshot.data.assign(data.begin(), data.end());
  Progress& progress = snapshot.progress;
  const Word mode = reader.word();
  if (mode >= kModeNames.size()) throw Error("the serialised state claims to be in state " + std::to_string(mode));
  progress.mode = static_cast<Mode>(mode);
  progress.is_initialised = reader.flag();
  progress.time = reader.number();
  progress.stop = reader.number();
  progress.steps = reader.word();
  const Word interface = reader.word();
  if (interface >= kInterfaceNames.size())
    throw Error("the serialised state claims to be of interface " + std::to_string(interface));
  progress.interface = static_cast<Interface>(interface);
  progress.last_step = reader.number();
  progress.warnings_given = static_cast<std::uint32_t>(reader.word());
  progress.is_tolerance_set = reader.flag();
  progress.start = reader.number();
  const std::vector<double> values = reader.numbers();
  snapshot.built_with = reader.numbers();
  snapshot.memory = reader.numbers();
  snapshot.input_rates = reader.numbers();
  if (reader.bytes_left() != sizeof(Word)) throw Error("the serialised state has bytes behind its end");
  if (values.size() != value_count(blueprint)) throw Error("the serialised state does not fit this FMU's variables");
  auto next = values.begin();
  for (const std::size_t index : blueprint.parameters) {
    const Variable& row = blueprint.rows[index];
    if (!is_in_range(row, *next)) refuse(row.name + " is out of its range");
    set_value(row, snapshot.data.data(), *next++);
  }
  for (const std::size_t index : blueprint.inputs) {
    Polynomial parts;
    for (double& part : parts) part = *next++;
    store(snapshot.data.data(), blueprint.rows[index].offset, parts);
  }
  snapshot.is_foreign = true;
  validate(blueprint, snapshot);
  return snapshot;
}

}  // namespace fmu
