#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "clrad/output.hpp"

namespace clrad {
namespace {

// A file descriptor and the name it will lose or trade; both are gone when this goes, whatever happened.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& path) : path_(path), name_(path + ".XXXXXX") {
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
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (exists_) ::unlink(name_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(const std::string& bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t n = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) fail(n < 0 ? errno : EIO);
      done += std::size_t(n);
    }
  }

  void rename() {
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

 private:
  [[noreturn]] void fail(int error) const {
    throw DeviceError(fmt::format("cannot write {}: {}", path_, std::strerror(error)));
  }

  std::string path_, name_;
  int descriptor_ = -1;
  bool exists_ = false;
};

}  // namespace

void write_file(const std::string& path, const std::string& bytes) {
  if (path.empty()) throw DeviceError("cannot write a file without a name");
  TemporaryFile file(path);
  file.write(bytes);
  file.rename();
}

}  // namespace clrad
