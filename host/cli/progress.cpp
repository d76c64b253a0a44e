#include "cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <csignal>

namespace clrad::cli {
namespace {

volatile std::sig_atomic_t signalled = 0;

void on_signal(int number) {
  if (signalled) {
    std::signal(number, SIG_DFL);
    std::raise(number);
  }
  signalled = 1;
}

}  // namespace

void watch_for_interrupt() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

bool interrupted() {
  return signalled != 0;
}

ProgressLine::ProgressLine(bool quiet, double converge)
    : on_(!quiet && isatty(STDERR_FILENO)), converge_(converge) {}

void ProgressLine::show(const Progress& p) {
  using namespace std::chrono_literals;
  const auto now = std::chrono::steady_clock::now();
  if (!on_ || now - last_ < 100ms) return;
  last_ = now;
  constexpr int width = 24;
  // Unshot power falls about exponentially: on this scale the bar moves evenly.
  const double part = std::clamp(std::log(1 / p.unshot_relative) / std::log(1 / converge_), 0.0, 1.0);
  const int full = int(part * width);
  std::string left =
      p.seconds_left < 0 ? "" : fmt::format(", about {:.0f} s left", std::ceil(p.seconds_left));
  fmt::print(stderr, "\r\033[K[{}{}] {} shoots, {:.3g} % unshot, {:.1f} s{}", std::string(full, '#'),
             std::string(width - full, '.'), p.shoots, 100 * p.unshot_relative, p.seconds, left);
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressLine::say(const char* stage) {
  if (!on_) return;
  fmt::print(stderr, "\r\033[K{} ...", stage);
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressLine::clear() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
  drawn_ = false;
}

}  // namespace clrad::cli
