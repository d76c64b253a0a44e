// Solves within a budget of time, in one process with compiled kernels.
#pragma once
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "clrad/tradeoff.hpp"

namespace clrad {

class Runner {
 public:
  Runner(const DeviceOptions& device, const Scene& scene, const TradeoffOptions& options);

  double seconds() const;  ///< since this was made
  double left() const { return options_.budget_s - seconds(); }
  bool over() const { return over_; }  ///< the caller wanted no more
  std::size_t runs = 0;                ///< for options.progress: how many are done

  Device& device_of(Precision precision);
  /// Nothing when it was stopped, by the caller or (unless it `must` be) for want of time. `pending_s`: about what is left to do, for
  /// progress; negative: not known.
  std::optional<Solution> solved(const TradeoffSetting& setting, bool must, double pending_s);

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  DeviceOptions device_options_;
  const Scene& scene_;
  const TradeoffOptions& options_;
  double extent_m_;
  std::map<Precision, std::unique_ptr<Device>> devices_;
  std::set<std::string> warm_;
  bool over_ = false;

  bool tell(const std::string& what, double pending_s, double unshot);
  void warm_up(const TradeoffSetting& setting);
};

}  // namespace clrad
