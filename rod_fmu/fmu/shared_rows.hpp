// Parameters that all segments or TCAs share, and their elements.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "fmu/rows.hpp"

namespace rod {

/// Declares a parameter of every segment or TCA under two names: `all` sets it everywhere, `each`[i] in one place. A
/// parameter that is declared later overrides what an earlier one set, so all rows of the first kind come first.
class SharedRows {
 public:
  SharedRows(Table& table, const Parameters& p) : table_(table), p_(p) {}

  template <class Member, class Refine>
  void segments(const std::string& all, const std::string& each, Member Segment::*member, const std::string& unit,
                const std::string& description, Refine refine) {
    add(std::span(p_.segment).first(p_.segments), all, each, member, unit, description, refine);
  }
  template <class Member, class Refine>
  void tcas(const std::string& name, Member Tca::*member, const std::string& unit, const std::string& description,
            Refine refine) {
    add(std::span(p_.tca).first(p_.tcas), name, name, member, unit, description, refine);
  }
  /// Declares the rows of the second kind.
  void write_elements() {
    for (const auto& write : elements_) write();
  }

 private:
  template <class Owner, class Member, class Refine>
  void add(std::span<const Owner> owners, const std::string& all, const std::string& each, Member Owner::*member,
           const std::string& unit, const std::string& description, Refine refine) {
    fmu::Variable& row = table_.parameter(all, owners[0].*member, unit, description);
    refine(row);
    for (const Owner& other : owners.subspan(1)) table_.also(row, other.*member);
    elements_.push_back([=, this] {
      for (std::size_t i = 0; i < owners.size(); ++i)
        refine(table_.parameter(fmu::indexed(each, i), owners[i].*member, unit, description));
    });
  }

  Table& table_;
  const Parameters& p_;
  std::vector<std::function<void()>> elements_;
};

/// Refinements of a row, for SharedRows.
inline auto within(double least, double most, double nominal = 1.0) {
  return [=](fmu::Variable& row) { row.range(least, most).nominal(nominal); };
}
inline auto among(std::vector<std::string> items) {
  return [=](fmu::Variable& row) { row.choices(items); };
}

}  // namespace rod
