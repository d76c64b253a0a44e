#include "scene/read_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <clrad/error.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace clrad {

std::string read_file(const std::string& path) {
  std::error_code status;
  if (std::filesystem::is_directory(path, status)) {
    throw InputError(fmt::format("{}: is a folder; name the scene file inside it", path));
  }
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) throw InputError(fmt::format("{}: reading failed before its end", path));
  if (bytes.empty()) throw InputError(fmt::format("{}: is empty", path));
  return bytes;
}

std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  return text;
}

}  // namespace clrad
