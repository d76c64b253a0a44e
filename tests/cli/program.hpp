// Runs the program as a user does, in a folder of the test's own.
#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace clrad::test {

inline const std::string furnace = CLRAD_SCENES "/furnace.obj";

class Program : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("clrad_cli_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  struct Outcome {
    int code;
    std::string out, error;
  };

  pid_t start(const std::vector<std::string>& words) {
    const pid_t child = fork();
    if (child == 0) {
      const std::string out = path("stdout"), error = path("stderr");
      dup2(open(out.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600), 1);
      dup2(open(error.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600), 2);
      std::vector<char*> argv{const_cast<char*>("clrad")};
      for (const auto& w : words) argv.push_back(const_cast<char*>(w.c_str()));
      argv.push_back(nullptr);
      execv(CLRAD_BINARY_DIR "/clrad", argv.data());
      _exit(127);
    }
    return child;
  }
  Outcome finish(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text("stdout"), text("stderr")};
  }
  Outcome run(const std::vector<std::string>& words) { return finish(start(words)); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string text(const std::string& name) const {
    std::ifstream in(folder_ / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& name, const std::string& body) const {
    std::ofstream(folder_ / name) << body;
  }
  bool holds(const std::string& name) const { return std::filesystem::exists(folder_ / name); }

  std::filesystem::path folder_;
};

}  // namespace clrad::test
