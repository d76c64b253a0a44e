#include "embree.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <thread>

namespace clrad::bench {

std::string name_of(EmbreeWay way) {
  switch (way) {
    case EmbreeWay::one:
      return "1";
    case EmbreeWay::packet_8:
      return "8";
    case EmbreeWay::packet_16:
      return "16";
    case EmbreeWay::packet_16_coherent:
      return "16 coherent";
    case EmbreeWay::stream:
      return "1M";
    case EmbreeWay::stream_soa:
      return "Np";
  }
  return {};
}

struct EmbreeScene::Parts {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  unsigned threads = 1;
  double build_seconds = 0;
};

EmbreeScene::EmbreeScene(std::span<const OccluderTriangle> triangles, bool robust, unsigned threads)
    : parts_(std::make_unique<Parts>()) {
  parts_->threads = threads;
  parts_->device = rtcNewDevice(("threads=" + std::to_string(threads)).c_str());
  if (!parts_->device) throw std::runtime_error("Embree has no device");
  parts_->scene = rtcNewScene(parts_->device);
  rtcSetSceneBuildQuality(parts_->scene, RTC_BUILD_QUALITY_MEDIUM);
  rtcSetSceneFlags(parts_->scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
  const RTCGeometry geometry = rtcNewGeometry(parts_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  const std::size_t n = triangles.size();
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * n));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), n));
  for (std::size_t i = 0; i < n; ++i)
    for (unsigned k = 0; k < 3; ++k) {
      for (int a = 0; a < 3; ++a) *vertices++ = float(triangles[i].corner[k][a]);
      *indices++ = unsigned(3 * i + k);
    }
  const auto start = std::chrono::steady_clock::now();
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(parts_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(parts_->scene);
  parts_->build_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseScene(parts_->scene);
  rtcReleaseDevice(parts_->device);
}

double EmbreeScene::build_seconds() const {
  return parts_->build_seconds;
}

namespace {

struct Rays {
  std::span<const Point> receivers, samples;
  float offset;
};

RTCRay ray_of(const Rays& rays, std::size_t receiver, std::size_t sample) {
  const auto &a = rays.receivers[receiver].position, &b = rays.samples[sample].position;
  RTCRay r;
  r.org_x = float(a.x), r.org_y = float(a.y), r.org_z = float(a.z), r.tnear = rays.offset;
  r.dir_x = float(b.x) - r.org_x, r.dir_y = float(b.y) - r.org_y, r.dir_z = float(b.z) - r.org_z, r.time = 0;
  r.tfar = 1 - rays.offset;
  r.mask = 0xffffffffu, r.id = 0, r.flags = 0;
  return r;
}

// Lanes are receivers: a sample's rays converge.
template <class Packet, std::size_t width, class Ask>
void ask_packets(const Rays& rays, std::size_t first, std::size_t last, std::uint32_t words,
                 std::span<std::uint32_t> masks, Ask ask) {
  for (std::size_t o = first; o < last; o += width) {
    alignas(64) int valid[width];
    for (std::size_t lane = 0; lane < width; ++lane) valid[lane] = o + lane < last ? -1 : 0;
    for (std::size_t k = 0; k < rays.samples.size(); ++k) {
      alignas(64) Packet p;
      for (std::size_t lane = 0; lane < width; ++lane) {
        const RTCRay r = ray_of(rays, std::min(o + lane, last - 1), k);
        p.org_x[lane] = r.org_x, p.org_y[lane] = r.org_y, p.org_z[lane] = r.org_z;
        p.dir_x[lane] = r.dir_x, p.dir_y[lane] = r.dir_y, p.dir_z[lane] = r.dir_z;
        p.tnear[lane] = r.tnear, p.tfar[lane] = r.tfar, p.time[lane] = 0, p.mask[lane] = r.mask,
        p.id[lane] = 0, p.flags[lane] = 0;
      }
      ask(valid, &p);
      for (std::size_t lane = 0; lane < width && o + lane < last; ++lane)
        masks[(o + lane) * words + k / 32] |= std::uint32_t(p.tfar[lane] < 0) << (k % 32);
    }
  }
}

}  // namespace

void EmbreeScene::occluded(EmbreeWay way, std::span<const Point> receivers, std::span<const Point> samples,
                           float offset, std::span<std::uint32_t> masks) const {
  constexpr std::size_t chunk = 256;  // receivers
  const auto words = std::uint32_t((samples.size() + 31) / 32);
  const Rays rays{receivers, samples, offset};
  const RTCScene scene = parts_->scene;
  std::fill(masks.begin(), masks.end(), 0);
  const auto work = [&](std::size_t first, std::size_t last) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = way == EmbreeWay::one || way == EmbreeWay::packet_8 || way == EmbreeWay::packet_16
                        ? RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT
                        : RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const std::size_t n = samples.size(), count = (last - first) * n;
    switch (way) {
      case EmbreeWay::one:
        for (std::size_t o = first; o < last; ++o)
          for (std::size_t k = 0; k < n; ++k) {
            RTCRay r = ray_of(rays, o, k);
            rtcOccluded1(scene, &context, &r);
            masks[o * words + k / 32] |= std::uint32_t(r.tfar < 0) << (k % 32);
          }
        break;
      case EmbreeWay::packet_8:
        ask_packets<RTCRay8, 8>(rays, first, last, words, masks, [&](const int* valid, RTCRay8* p) {
          rtcOccluded8(valid, scene, &context, p);
        });
        break;
      case EmbreeWay::packet_16:
      case EmbreeWay::packet_16_coherent:
        ask_packets<RTCRay16, 16>(rays, first, last, words, masks, [&](const int* valid, RTCRay16* p) {
          rtcOccluded16(valid, scene, &context, p);
        });
        break;
      case EmbreeWay::stream: {
        std::vector<RTCRay> stream(count);
        for (std::size_t i = 0; i < count; ++i) stream[i] = ray_of(rays, first + i / n, i % n);
        rtcOccluded1M(scene, &context, stream.data(), unsigned(count), sizeof(RTCRay));
        for (std::size_t i = 0; i < count; ++i)
          masks[(first + i / n) * words + i % n / 32] |= std::uint32_t(stream[i].tfar < 0) << (i % n % 32);
        break;
      }
      case EmbreeWay::stream_soa: {
        std::vector<float> f(9 * count, 0.0f);
        std::vector<unsigned> mask(count, 0xffffffffu), id(count, 0), flags(count, 0);
        RTCRayNp np{&f[0],         &f[count],     &f[2 * count], &f[6 * count], &f[3 * count], &f[4 * count],
                    &f[5 * count], &f[8 * count], &f[7 * count], mask.data(),   id.data(),     flags.data()};
        for (std::size_t i = 0; i < count; ++i) {
          const RTCRay r = ray_of(rays, first + i / n, i % n);
          np.org_x[i] = r.org_x, np.org_y[i] = r.org_y, np.org_z[i] = r.org_z, np.tnear[i] = r.tnear;
          np.dir_x[i] = r.dir_x, np.dir_y[i] = r.dir_y, np.dir_z[i] = r.dir_z, np.tfar[i] = r.tfar;
        }
        rtcOccludedNp(scene, &context, &np, unsigned(count));
        for (std::size_t i = 0; i < count; ++i)
          masks[(first + i / n) * words + i % n / 32] |= std::uint32_t(np.tfar[i] < 0) << (i % n % 32);
        break;
      }
    }
  };
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (;;) {
      const std::size_t first = next.fetch_add(chunk);
      if (first >= receivers.size()) return;
      work(first, std::min(first + chunk, receivers.size()));
    }
  };
  std::vector<std::thread> threads;
  for (unsigned t = 1; t < parts_->threads; ++t) threads.emplace_back(run);
  run();
  for (auto& t : threads) t.join();
}

}  // namespace clrad::bench
