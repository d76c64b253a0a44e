#include <unistd.h>

#include <fstream>

#include "fuzz/targets.hpp"

namespace clrad::fuzz {
namespace {

// Gone with the process, however it ends but by a crash.
struct Folder {
  std::filesystem::path path;
  Folder() {
    const std::filesystem::path memory = "/dev/shm";
    const auto root = ::access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path();
    path = root / ("clrad-fuzz-" + std::to_string(::getpid()));
    std::filesystem::create_directories(path);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

}  // namespace

std::string case_path(const std::string& name) {
  static const Folder folder;
  return (folder.path / name).string();
}

std::string write_case(const std::string& name, Bytes bytes) {
  const std::string path = case_path(name);
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  return path;
}

void require_message(const std::string& message, const std::string& path) {
  require(message.find(path.substr(0, path.rfind('.'))) != std::string::npos,
          "a message that does not name the file: " + message);
  require(message.find('\n') == std::string::npos, "a message of several lines: " + message);
}

}  // namespace clrad::fuzz
