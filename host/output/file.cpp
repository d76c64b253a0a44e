#include "output/file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "clrad/output.hpp"

namespace clrad {

FileWriter::FileWriter(const std::string& path) : path_(path), name_(path + ".XXXXXX") {
  if (path.empty()) throw DeviceError("cannot write a file without a name");
  descriptor_ = ::mkstemp(name_.data());
  if (descriptor_ < 0) {
    const int error = errno;
    const auto folder = std::filesystem::path(path).parent_path();
    std::error_code ignored;
    if (error == ENOENT && !std::filesystem::is_directory(folder.empty() ? "." : folder, ignored))
      throw DeviceError(fmt::format("cannot write {}: there is no folder {}", path, folder.string()));
    fail(error);
  }
  exists_ = true;
}

FileWriter::~FileWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (exists_) ::unlink(name_.c_str());
}

void FileWriter::write(const void* data, std::size_t bytes) {
  const char* const from = static_cast<const char*>(data);
  std::size_t done = 0;
  while (done < bytes) {
    const ssize_t n = ::write(descriptor_, from + done, bytes - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail(n < 0 ? errno : EIO);
    done += std::size_t(n);
  }
}

void FileWriter::rewrite(std::uint64_t offset, const void* data, std::size_t bytes) {
  const char* const from = static_cast<const char*>(data);
  std::size_t done = 0;
  while (done < bytes) {
    const ssize_t n = ::pwrite(descriptor_, from + done, bytes - done, off_t(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail(n < 0 ? errno : EIO);
    done += std::size_t(n);
  }
}

void FileWriter::commit() {
  // mkstemp makes files for their owner alone; the user's mask decides what a finished one is.
  const mode_t mask = ::umask(0);
  ::umask(mask);
  if (::fchmod(descriptor_, 0666 & ~mask) != 0 || ::fsync(descriptor_) != 0) fail(errno);
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  if (closed != 0) fail(errno);
  if (std::rename(name_.c_str(), path_.c_str()) != 0) fail(errno);
  exists_ = false;
}

void FileWriter::fail(int error) const {
  throw DeviceError(fmt::format("cannot write {}: {}", path_, std::strerror(error)));
}

void write_file(const std::string& path, const std::string& bytes) {
  FileWriter file(path);
  file.write(bytes);
  file.commit();
}

std::string lower_ending(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return ending;
}

}  // namespace clrad
