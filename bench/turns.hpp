// Threads of which one at a time runs: each has its turn, then the next one.
#pragma once
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace clrad::bench {

class Turns {
 public:
  /// Runs every task to its end; throws the first exception that one of them threw. A task is given the function that
  /// ends its turn and comes back at its next.
  static void run(const std::vector<std::function<void(const std::function<void()>&)>>& tasks) {
    Turns turns(tasks.size());
    std::exception_ptr trouble;
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < tasks.size(); ++i)
      threads.emplace_back([&, i] {
        turns.wait(i);
        try {
          tasks[i]([&turns, i] {
            turns.pass();
            turns.wait(i);
          });
        } catch (...) {
          if (!trouble) trouble = std::current_exception();
        }
        turns.leave(i);
      });
    for (auto& t : threads) t.join();
    if (trouble) std::rethrow_exception(trouble);
  }

 private:
  explicit Turns(std::size_t count) : active_(count, true) {}

  void wait(std::size_t i) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return now_ == i; });
  }
  void pass() {
    const std::lock_guard lock(mutex_);
    next();
  }
  void leave(std::size_t i) {
    const std::lock_guard lock(mutex_);
    active_[i] = false;
    next();
  }
  void next() {
    for (std::size_t k = 0; k < active_.size(); ++k) {
      now_ = (now_ + 1) % active_.size();
      if (active_[now_]) break;
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t now_ = 0;
  std::vector<bool> active_;
};

}  // namespace clrad::bench
