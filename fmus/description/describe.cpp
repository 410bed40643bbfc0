// describe_<name> TREE [NOTES]: writes modelDescription.xml and documentation/index.html of the FMU whose table is
// linked in, the latter with the notes of that file, into the FMU's unpacked folder. Runs at build time.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "description/description.hpp"
#include "description/documentation.hpp"

namespace {

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw fmu::Error("cannot read " + path.string());
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw fmu::Error("cannot write " + path.string());
}

}  // namespace

int main(int count, char** arguments) try {
  if (count != 2 && count != 3) throw fmu::Error("usage: describe TREE [NOTES]");
  const std::filesystem::path tree = arguments[1];
  const fmu::Blueprint& blueprint = fmu::Blueprint::get();
  write(tree / "modelDescription.xml", fmu::model_description(blueprint));
  write(tree / "documentation" / "index.html",
        fmu::documentation(blueprint, count == 3 ? read(arguments[2]) : std::string()));
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
