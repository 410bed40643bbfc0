#include "runtime/snapshot.hpp"

#include <bit>
#include <cstring>
#include <string>

#include "model/hash.hpp"

namespace fmu {
namespace {

static_assert(std::endian::native == std::endian::little, "serialised states are little-endian");

using Word = std::uint64_t;
constexpr Word kMagic = 0x3153554d46414354;  // "TCAFMUS1"
constexpr Word kVersion = 2;
constexpr std::size_t kFixedWords = 14;  // all but the values, built_with and memory

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
  Word word() {
    if (bytes_.size() < sizeof(Word)) throw Error("the bytes end too early");
    Word word;
    std::memcpy(&word, bytes_.data(), sizeof(Word));
    bytes_ = bytes_.subspan(sizeof(Word));
    return word;
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
    throw Error("the serialised state belongs to another FMU or version than " + blueprint.identity.name + " " +
                blueprint.guid + remedy);
}

}  // namespace

std::size_t serialised_size(const Blueprint& blueprint, const Snapshot& snapshot) {
  return sizeof(Word) * (kFixedWords + value_count(blueprint) + snapshot.built_with.size() + snapshot.memory.size());
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
  std::vector<double> values;
  for (const std::size_t index : blueprint.parameters)
    values.push_back(value_of(blueprint.rows[index], snapshot.data.data()));
  for (const std::size_t index : blueprint.inputs)
    for (const double part : load<Polynomial>(snapshot.data.data(), blueprint.rows[index].place))
      values.push_back(part);
  writer.put(std::span<const double>(values));
  writer.put(std::span(snapshot.built_with));
  writer.put(std::span(snapshot.memory));
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
  progress.is_initialised = reader.word() != 0;
  progress.time = reader.number();
  progress.stop = reader.number();
  progress.steps = reader.word();
  const Word interface = reader.word();
  if (interface >= kInterfaceNames.size())
    throw Error("the serialised state claims to be of interface " + std::to_string(interface));
  progress.interface = static_cast<Interface>(interface);
  const std::vector<double> values = reader.numbers();
  snapshot.built_with = reader.numbers();
  snapshot.memory = reader.numbers();
  if (values.size() != value_count(blueprint)) throw Error("the serialised state does not fit this FMU's variables");
  auto next = values.begin();
  for (const std::size_t index : blueprint.parameters) set_value(blueprint.rows[index], snapshot.data.data(), *next++);
  for (const std::size_t index : blueprint.inputs) {
    Polynomial parts;
    for (double& part : parts) part = *next++;
    store(snapshot.data.data(), blueprint.rows[index].place, parts);
  }
  return snapshot;
}

}  // namespace fmu
