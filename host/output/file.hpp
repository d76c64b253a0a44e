// Files that are either whole or not there.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace clrad {

/// Writes a file under a temporary name in the same folder; commit() gives it its name. Without commit(), nothing is left
/// and what stood under the name stays. Every failure is a DeviceError that names the path.
class FileWriter {
 public:
  explicit FileWriter(const std::string& path);
  ~FileWriter();
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;

  void write(const void* data, std::size_t bytes);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Overwrites bytes that were written before.
  void rewrite(std::uint64_t offset, const void* data, std::size_t bytes);
  /// On the disk and under its name when this returns.
  void commit();

 private:
  [[noreturn]] void fail(int error) const;

  std::string path_, name_;
  int descriptor_ = -1;
  bool exists_ = false;
};

/// The ending of a path in lower case, with its point: ".vtu".
std::string lower_ending(const std::string& path);

}  // namespace clrad
