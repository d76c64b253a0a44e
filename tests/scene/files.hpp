/// Scene files written by tests: small texts in a folder that goes away.
#pragma once
#include <unistd.h>

#include <algorithm>
#include <clrad/error.hpp>
#include <clrad/scene.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace clrad_test {

class Folder {
 public:
  Folder() {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("clrad-test-" + std::to_string(getpid()) + "-" + std::to_string(count++));
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(path_ / name, std::ios::binary) << content;
    return at(name);
  }
  std::string at(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// The message of the InputError that loading throws; "" when it does not throw.
inline std::string load_error(const std::string& path) {
  try {
    clrad::load_scene(path);
    return "";
  } catch (const clrad::InputError& error) {
    return error.what();
  }
}

inline std::vector<clrad::Diagnostic> of_rule(const std::vector<clrad::Diagnostic>& all,
                                              const std::string& rule) {
  std::vector<clrad::Diagnostic> found;
  std::copy_if(all.begin(), all.end(), std::back_inserter(found),
               [&](const auto& d) { return d.rule == rule; });
  return found;
}

inline std::vector<std::string> rules_of(const std::vector<clrad::Diagnostic>& all) {
  std::vector<std::string> rules;
  for (const auto& d : all) rules.push_back(d.rule);
  return rules;
}

/// A material named "m" that emits, so that a file of one face has no finding of its own.
inline constexpr const char* kMtl = "newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\n";

/// An OBJ file that uses kMtl from line 1, its faces from line 3 on.
inline std::string write_obj(const Folder& folder, const std::string& body,
                             const std::string& name = "a.obj") {
  folder.write("a.mtl", kMtl);
  return folder.write(name, "mtllib a.mtl\nusemtl m\n" + body);
}

}  // namespace clrad_test
