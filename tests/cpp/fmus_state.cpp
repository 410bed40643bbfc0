// Saving, restoring and serialising: bitwise the same afterwards, in any instance, and damaged bytes refused.
#include <bit>
#include <thread>

#include "model/hash.hpp"
#include "probe/host.hpp"

namespace probe {
namespace {

/// All outputs, in the order of the table.
std::vector<double> outputs(Host& host) { return {host.get("x"), host.get("v"), host.get("reading")}; }

void push(Host& host, double t, double h) {
  host.set("force", 1.0 + t);
  host.set_derivative("force", 1, -2.0);
  host.set("bias", 0.1 * t);
  ASSERT_EQ(host.step(t, h), fmi2OK) << host.last();
}

TEST(State, RestoredStepsAreBitwiseTheSame) {
  Host host;
  host.set_integer("masses", 5);
  host.start();
  push(host, 0.0, 0.3);
  host.set_derivative("force", 2, 3.0);  // pending input derivatives belong to the state
  fmi2FMUstate state = host.save();
  ASSERT_EQ(host.step(0.3, 0.2), fmi2OK);
  const auto expected = outputs(host);
  push(host, 0.5, 0.7);
  for (int repeat = 0; repeat < 3; ++repeat) {
    ASSERT_EQ(host.restore(state), fmi2OK);
    ASSERT_EQ(host.step(0.3, 0.2), fmi2OK);
    EXPECT_EQ(outputs(host), expected);
  }
  EXPECT_EQ(host.get_integer("builds"), 1);
}

TEST(State, CarriesParametersAndWorksInAFreshInstance) {
  Host first, second;
  first.set_integer("masses", 7);
  first.set("mass", 0.5);
  first.start();
  first.set("tolerance", 1e-3);  // tunable, after the build
  push(first, 0.0, 0.3);
  const auto bytes = first.bytes();
  const auto at_save = outputs(first);
  push(first, 0.3, 0.2);
  ASSERT_EQ(second.restore(bytes), fmi2OK) << second.last();
  EXPECT_EQ(second.get_integer("masses"), 7);
  EXPECT_EQ(second.get("tolerance"), 1e-3);
  EXPECT_EQ(outputs(second), at_save);
  push(second, 0.3, 0.2);
  EXPECT_EQ(outputs(first), outputs(second));
  // The same parameters again: no build.
  ASSERT_EQ(second.restore(bytes), fmi2OK);
  EXPECT_EQ(second.get_integer("builds"), 1);
}

TEST(State, OfEveryModeIsRestored) {
  Host source;
  std::vector<std::vector<char>> modes{source.bytes()};
  fmi2EnterInitializationMode(source.fmu);
  source.set("bias", 0.5);
  modes.push_back(source.bytes());
  fmi2ExitInitializationMode(source.fmu);
  modes.push_back(source.bytes());
  Host target;
  ASSERT_EQ(target.restore(modes[2]), fmi2OK);
  EXPECT_EQ(target.step(0.0, 0.1), fmi2OK);
  ASSERT_EQ(target.restore(modes[1]), fmi2OK);
  EXPECT_EQ(target.step(0.0, 0.1), fmi2Error);
  EXPECT_EQ(target.get("x"), 0.5);
  EXPECT_EQ(fmi2ExitInitializationMode(target.fmu), fmi2OK);
  ASSERT_EQ(target.restore(modes[0]), fmi2OK);
  target.start();
  EXPECT_EQ(target.get("x"), 0.0);
}

TEST(State, FromBeforeAParameterChangeIsBuiltAgain) {
  Host host;
  host.set_integer("masses", 2);
  host.start();
  push(host, 0.0, 0.3);
  fmi2FMUstate two = host.save();
  const auto expected = outputs(host);
  fmi2Reset(host.fmu);
  host.set_integer("masses", 9);
  host.start();
  push(host, 0.0, 0.3);
  ASSERT_EQ(host.restore(two), fmi2OK) << host.last();
  EXPECT_EQ(outputs(host), expected);
  EXPECT_EQ(host.get_integer("masses"), 2);
}

TEST(State, HandlesAreReusedFreedAndChecked) {
  Host host, other;
  host.start();
  fmi2FMUstate state = host.save();
  const fmi2FMUstate same = state;
  push(host, 0.0, 0.3);
  EXPECT_EQ(fmi2GetFMUstate(host.fmu, &state), fmi2OK);  // writes over the given one
  EXPECT_EQ(state, same);
  push(host, 0.3, 0.3);
  EXPECT_EQ(host.restore(state), fmi2OK);
  EXPECT_EQ(host.step(0.3, 0.1), fmi2OK);
  EXPECT_EQ(other.restore(state), fmi2Error);
  EXPECT_TRUE(other.said({"unknown FMU state"}));
  EXPECT_EQ(fmi2FreeFMUstate(host.fmu, &state), fmi2OK);
  EXPECT_EQ(state, nullptr);
  EXPECT_EQ(fmi2FreeFMUstate(host.fmu, &state), fmi2OK);
  EXPECT_EQ(fmi2FreeFMUstate(host.fmu, nullptr), fmi2OK);
  EXPECT_EQ(host.restore(same), fmi2Error);
  EXPECT_EQ(host.restore(fmi2FMUstate{nullptr}), fmi2Error);
  host.save();  // never freed by the host: goes with the instance
}

TEST(Bytes, DamagedAnywhereAreRefusedAndNothingChanges) {
  Host host;
  host.set_integer("masses", 3);
  host.start();
  push(host, 0.0, 0.3);
  const auto good = host.bytes();
  push(host, 0.3, 0.2);
  const auto before = outputs(host);
  for (std::size_t i = 0; i < good.size(); ++i) {
    auto bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x10);
    ASSERT_EQ(host.restore(bad), fmi2Error) << "byte " << i;
  }
  EXPECT_TRUE(host.said({"fmi2DeSerializeFMUstate", "checksum"}));
  EXPECT_EQ(outputs(host), before);
  EXPECT_EQ(host.step(0.5, 0.1), fmi2OK);
}

TEST(Bytes, OfAnotherLengthVersionOrFmuAreRefused) {
  Host host;
  host.start();
  const auto good = host.bytes();
  for (const std::size_t size : {std::size_t{0}, std::size_t{8}, good.size() - 1, good.size() - 8}) {
    auto bad = good;
    bad.resize(size);
    bad.reserve(1);
    EXPECT_EQ(host.restore(bad), fmi2Error) << size;
  }
  auto longer = good;
  longer.resize(good.size() + 8);
  EXPECT_EQ(host.restore(longer), fmi2Error);
  EXPECT_TRUE(host.said({"bytes long"}));
  const auto with_word = [&](std::size_t word, std::uint64_t value) {
    auto bad = good;
    std::memcpy(&bad[8 * word], &value, 8);
    const auto sum = fmu::hash(std::as_bytes(std::span(bad)).first(bad.size() - 8));
    std::memcpy(&bad[bad.size() - 8], &sum, 8);
    return bad;
  };
  EXPECT_EQ(host.restore(with_word(0, 42)), fmi2Error);
  EXPECT_TRUE(host.said({"no serialised state"}));
  EXPECT_EQ(host.restore(with_word(1, 2)), fmi2Error);
  EXPECT_TRUE(host.said({"version 2", "reads version 3"}));
  EXPECT_EQ(host.restore(with_word(3, 42)), fmi2Error);
  EXPECT_TRUE(host.said({"another FMU", "probe"}));
  // A checksum that somebody made fit does not make nonsense acceptable.
  EXPECT_EQ(host.restore(with_word(4, 99)), fmi2Error);
  EXPECT_TRUE(host.said({"state 99"}));
  EXPECT_EQ(host.restore(with_word(9, 2)), fmi2Error);
  EXPECT_TRUE(host.said({"interface 2"}));
  EXPECT_EQ(host.restore(with_word(14, ~std::uint64_t{0})), fmi2Error);
  const auto with_number = [&](std::size_t word, double number) {
    return with_word(word, std::bit_cast<std::uint64_t>(number));
  };
  // Words: 14 before the values, each vector behind its count; nine parameters, two inputs of four numbers.
  const std::size_t values = 15, built = values + 9 + 2 * 4 + 1, memory = built + 9 + 1;
  for (const double bad : {-5.0, 1e9, kNaN, kInfinity, 0.5}) {
    EXPECT_EQ(host.restore(with_number(values + 3, bad)), fmi2Error) << bad;  // masses: 1 to 10, whole
    EXPECT_TRUE(host.said({"masses", "out of its range"}));
    EXPECT_EQ(host.restore(with_number(built + 3, bad)), fmi2Error) << bad;
  }
  EXPECT_EQ(host.restore(with_number(values, 2.0)), fmi2Error) << "the mass differs from what was built with";
  EXPECT_EQ(host.restore(with_number(values + 9, 1e6)), fmi2Error) << "force out of its range";
  EXPECT_EQ(host.restore(with_number(values + 10, kNaN)), fmi2Error) << "rate of force";
  EXPECT_EQ(host.restore(with_number(6, kNaN)), fmi2Error) << "time";
  EXPECT_EQ(host.restore(with_word(4, 0)), fmi2Error)
      << "initialised, but its clock is that of an instance that is not";
  EXPECT_EQ(host.restore(with_word(4, 5)), fmi2Error) << "a slave in continuous-time mode";
  EXPECT_EQ(host.restore(with_word(5, 0)), fmi2Error) << "stepped, but never initialised";
  EXPECT_EQ(host.restore(with_number(memory, kNaN)), fmi2Error);
  EXPECT_TRUE(host.said({"not finite"}));
  EXPECT_EQ(host.restore(good), fmi2OK) << host.last();
}

TEST(Bytes, AreWrittenOnlyIntoEnoughRoom) {
  Host host;
  fmi2FMUstate state = host.save();
  std::vector<char> room(16);
  EXPECT_EQ(fmi2SerializeFMUstate(host.fmu, state, room.data(), room.size()), fmi2Error);
  EXPECT_TRUE(host.said({"16 bytes", "fmi2SerializedFMUstateSize"}));
}

TEST(Instances, AreIndependentInThreads) {
  const auto run = [](double mass) {
    Host host;
    host.set("mass", mass);
    host.set_integer("masses", 4);
    host.start();
    for (int i = 0; i < 50; ++i) {
      fmi2FMUstate state = host.save();
      push(host, 0.1 * i, 0.1);
      EXPECT_EQ(host.restore(state), fmi2OK);
      EXPECT_EQ(fmi2FreeFMUstate(host.fmu, &state), fmi2OK);
      push(host, 0.1 * i, 0.1);
    }
    return outputs(host);
  };
  std::vector<std::vector<double>> alone, together(16);
  for (std::size_t i = 0; i < together.size(); ++i) alone.push_back(run(1.0 + 0.1 * i));
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < together.size(); ++i) threads.emplace_back([&, i] { together[i] = run(1.0 + 0.1 * i); });
  threads.clear();
  EXPECT_EQ(alone, together);
}

}  // namespace
}  // namespace probe
