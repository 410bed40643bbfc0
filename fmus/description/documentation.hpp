// documentation/index.html of an FMU: the notes kept beside its variable table, then the table itself.
#pragma once

#include <string>
#include <string_view>

#include "description/blueprint.hpp"

namespace fmu {

/// The whole page, which needs no other file. notes: Markdown with "# " headings, "- " items, one paragraph per line,
/// tables whose first line is their head, blocks between ``` lines and `code`; a line that begins with <svg is a
/// drawing and goes in as it is. May be empty.
std::string documentation(const Blueprint& blueprint, std::string_view notes);

}  // namespace fmu
