// Embree's answers to the same segments: the peer that bench_visibility measures against.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "clrad/visibility.hpp"

namespace clrad::bench {

/// Ways to ask Embree: one ray at a time, packets, packets said to be coherent, streams.
enum class EmbreeWay { one, packet_8, packet_16, packet_16_coherent, stream, stream_soa };
inline constexpr EmbreeWay embree_ways[] = {EmbreeWay::one,       EmbreeWay::packet_8,
                                            EmbreeWay::packet_16, EmbreeWay::packet_16_coherent,
                                            EmbreeWay::stream,    EmbreeWay::stream_soa};
std::string name_of(EmbreeWay way);

class EmbreeScene {
 public:
  /// Medium build quality, `threads` threads; robust: RTC_SCENE_FLAG_ROBUST.
  EmbreeScene(std::span<const OccluderTriangle> triangles, bool robust, unsigned threads);
  ~EmbreeScene();
  double build_seconds() const;

  /// Masks as VisibilityEngine::occluded makes them, every receiver against every sample, on `threads` threads. Segments keep
  /// `offset` of their length clear of either end, since Embree knows no planes to ignore.
  void occluded(EmbreeWay way, std::span<const Point> receivers, std::span<const Point> samples, float offset,
                std::span<std::uint32_t> masks) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace clrad::bench
