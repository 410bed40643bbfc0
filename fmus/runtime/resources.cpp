#include "runtime/resources.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <memory>
#include <string>

#ifdef _WIN32
#include <filesystem>
#endif

#include "model/model.hpp"

namespace fmu {
namespace {

constexpr std::string_view kScheme = "file:";
constexpr std::size_t kMostBytes = 1u << 20;  // of a configuration: a line for each of some ten thousand start values

/// The text with %41 read as 'A'.
std::string decoded(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned code = 0;
    const char* digits = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() && std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      plain += static_cast<char>(code);
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

// Files by the C library: that of C++ would tie the binary to a newer glibc than old_glibc.c promises.
struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

File open(const std::string& path) {
#ifdef _WIN32
  return File(_wfopen(std::filesystem::path(std::u8string(path.begin(), path.end())).c_str(), L"rb"));
#else
  return File(std::fopen(path.c_str(), "rb"));
#endif
}

}  // namespace

std::string folder_of(std::string_view uri) {
  std::string_view rest = uri;
  if (!rest.starts_with(kScheme)) {
    if (rest.find("://") != std::string_view::npos)
      throw Error("fmuResourceLocation '" + std::string(uri) + "'; give the URI of a folder, file:///...");
    return std::string(uri);
  }
  rest.remove_prefix(kScheme.size());
  if (rest.starts_with("//")) {  // an authority, empty or localhost, then the path
    rest.remove_prefix(2);
    rest.remove_prefix(std::min(rest.size(), rest.find('/')));
  }
  std::string path = decoded(rest);
  if (path.find('\0') != std::string::npos)  // the C library would open what is in front of it
    throw Error("fmuResourceLocation '" + std::string(uri) + "' holds %00; give the URI of a folder, file:///...");
  const bool has_drive = path.size() > 2 && path[0] == '/' && path[2] == ':';  // /C:/... of Windows
  return has_drive ? path.substr(1) : path;
}

Configuration read_configuration_file(std::string_view uri) {
  const std::string path = folder_of(uri) + "/" + std::string(kConfigurationFile);
  const File file = open(path);
  if (!file) throw Error("cannot read " + path);
  std::string text(kMostBytes + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file.get()));
  if (std::ferror(file.get())) throw Error("cannot read " + path);  // a folder can be opened on some systems
  if (text.size() > kMostBytes) throw Error(path + " is too long for a configuration");
  try {
    return read_configuration(text);
  } catch (const Error& error) {
    throw Error(path + ": " + error.what());
  }
}

}  // namespace fmu
