// describe_<name> FILE: writes modelDescription.xml of the FMU whose table is linked in. Runs at build time.
#include <fstream>
#include <iostream>

#include "description.hpp"

int main(int count, char** arguments) try {
  if (count != 2) throw fmu::Error("usage: describe FILE");
  std::ofstream file(arguments[1], std::ios::binary);
  file << fmu::model_description(fmu::Blueprint::get());
  if (!file.flush()) throw fmu::Error(std::string("cannot write ") + arguments[1]);
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
