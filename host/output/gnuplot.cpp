#include "output/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

#include <cmath>
#include <filesystem>
#include <system_error>

#include "clrad/output.hpp"

namespace clrad {
namespace {

namespace fs = std::filesystem;

// A folder inside `folder`, so that what is in it can be renamed into that one; gone with all in it at the end.
class WorkFolder {
 public:
  explicit WorkFolder(const std::string& folder) : path_(folder + "/.plot.XXXXXX") {
    if (!::mkdtemp(path_.data())) path_.clear();
  }
  ~WorkFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// No shell: the folder may have any name. Between fork and exec nothing but system calls, as other threads run.
bool run_gnuplot(const std::string& folder, const std::string& script) {
  const pid_t child = ::fork();
  if (child < 0) return false;
  if (child == 0) {
    const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    if (nothing >= 0) ::dup2(nothing, 0), ::dup2(nothing, 1), ::dup2(nothing, 2);
    if (::chdir(folder.c_str()) == 0)
      ::execlp("gnuplot", "gnuplot", script.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return false;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

std::string gnuplot_text(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < ' ') continue;
    result += c;
    if (c == '\'') result += c;
  }
  return result;
}

std::string log_ticks(double low, double high, const std::string& unit) {
  const bool few = std::log10(high / low) < 3.4;
  // Ticks' texts are formats.
  std::string of_format;
  for (const char c : unit) of_format += c == '%' ? "%%" : std::string(1, c);
  std::string ticks;
  for (int decade = int(std::floor(std::log10(low))); decade <= int(std::ceil(std::log10(high))); ++decade)
    for (const int digit : {1, 2, 5}) {
      if (digit > 1 && !few) continue;
      // By text, so that 0.1 is not 0.10000000000000001.
      const double value = std::stod(fmt::format("{}e{}", digit, decade));
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
      const std::string number = decade >= -3 && decade < 6
                                     ? fmt::format("{:.{}f}", value, std::max(0, -decade))
                                     : fmt::format("{}e{}", digit, decade);
      ticks += fmt::format("{}\"{}{}\" {:g}", ticks.empty() ? "" : ", ", number, of_format, value);
    }
  return "(" + ticks + ")";
}

bool draw_with_gnuplot(const std::string& folder,
                       const std::vector<std::pair<std::string, std::string>>& files,
                       const std::string& script, const std::vector<std::string>& pictures) {
  const WorkFolder work(folder);
  if (work.path().empty()) return false;
  for (const auto& [name, text] : files) write_file(work.path() + "/" + name, text);
  if (!run_gnuplot(work.path(), script)) return false;
  std::error_code error;
  for (const std::string& picture : pictures)
    if (!fs::exists(work.path() + "/" + picture, error)) return false;
  for (const std::string& picture : pictures) {
    fs::rename(fs::path(work.path()) / picture, fs::path(folder) / picture, error);
    if (error) return false;
  }
  return true;
}

}  // namespace clrad
