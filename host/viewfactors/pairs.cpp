#include "viewfactors/pairs.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>

namespace clrad {
namespace {

constexpr std::size_t most_receiver_parts = 256;
constexpr std::size_t most_shooter_corners = 12;  // the kernel's pieces have room for 16
constexpr double sliver = 1e-14;                  // x the square of the size: no area

bool has_area(const Convex& polygon, double size) {
  return polygon.size() >= 3 && area_of(polygon) > sliver * size * size;
}

// Corners that cutting left on top of each other: the side between them has no direction.
void drop_repeated(Convex& polygon, double nearer) {
  for (std::size_t i = 0; i < polygon.size() && polygon.size() >= 3;) {
    if (glm::distance(polygon[i], polygon[(i + 1) % polygon.size()]) <= nearer)
      polygon.erase(polygon.begin() + std::ptrdiff_t(i));
    else
      ++i;
  }
}

// The rectangle of the receiver's plane outside which the occluder hides nothing of the shooter.
void find_shadow(PairPart& part, PairPart::Occluder& o) {
  const glm::dvec3 n = part.receiver_normal, on = part.receiver[0][0];
  std::vector<glm::dvec3> points;
  o.shadow.bounded = false;
  for (const glm::dvec3& s : part.shooter)
    for (const glm::dvec3& q : o.corner) {
      const double hs = glm::dot(n, s - on), hq = std::max(0.0, glm::dot(n, q - on));
      if (!(hs > hq * (1 + 1e-9))) return;  // the ray from s through q never comes down
      points.push_back(s + (q - s) * (hs / (hs - hq)));
    }
  // Along the longest side of what the first corner of the shooter casts.
  glm::dvec3 along(0);
  for (std::size_t i = 0; i < o.corner.size(); ++i) {
    const glm::dvec3 side = points[(i + 1) % o.corner.size()] - points[i];
    if (glm::dot(side, side) > glm::dot(along, along)) along = side;
  }
  const double length = glm::length(along);
  if (!(length > 0)) return;
  o.shadow.axis[0] = along / length;
  o.shadow.axis[1] = glm::normalize(glm::cross(n, along));
  o.shadow.middle = points[0];
  for (int k = 0; k < 2; ++k) {
    double low = 0, high = 0;
    for (const glm::dvec3& p : points) {
      const double x = glm::dot(o.shadow.axis[k], p - points[0]);
      low = std::min(low, x), high = std::max(high, x);
    }
    o.shadow.middle += o.shadow.axis[k] * (0.5 * (low + high));
    o.shadow.half[k] = 0.5 * (high - low);
  }
  o.shadow.bounded = true;
}

// Cuts the receiver's parts along the sides of the occluder that stand on it: there what is seen may jump.
void cut_at_contact(PairPart& part, const Convex& occluder, double doubt) {
  const glm::dvec3 n = part.receiver_normal, on = part.receiver[0][0];
  for (std::size_t e = 0; e < occluder.size(); ++e) {
    const glm::dvec3 a = occluder[e], b = occluder[(e + 1) % occluder.size()];
    if (std::abs(glm::dot(n, a - on)) > doubt || std::abs(glm::dot(n, b - on)) > doubt) continue;
    const double length = glm::distance(a, b);
    if (!(length > 2 * doubt)) continue;
    const glm::dvec3 across = glm::normalize(glm::cross(n, b - a));
    std::vector<Convex> next;
    for (Convex& piece : part.receiver) {
      // The part of a..b inside the piece.
      double from = 0, to = 1;
      for (std::size_t i = 0; i < piece.size(); ++i) {
        const glm::dvec3 inward = glm::cross(n, piece[(i + 1) % piece.size()] - piece[i]);
        const double ha = glm::dot(inward, a - piece[i]), hb = glm::dot(inward, b - piece[i]);
        if (ha < 0 && hb < 0) to = -1;
        if (ha < 0 && hb > 0) from = std::max(from, ha / (ha - hb));
        if (ha > 0 && hb < 0) to = std::min(to, ha / (ha - hb));
      }
      const bool passes = (to - from) * length > 4 * doubt;
      Halves halves;
      if (passes) halves = cut(piece, heights_over(piece, across, a), 4 * doubt);
      if (!passes || halves.front.empty() || halves.back.empty()) {
        next.push_back(std::move(piece));
      } else {
        next.push_back(std::move(halves.front));
        next.push_back(std::move(halves.back));
      }
    }
    part.receiver = std::move(next);
    if (part.receiver.size() > most_receiver_parts) return;
  }
}

PairPart::Body body_seen_from(const SurfaceList& surfaces, const ConvexBody& body, std::uint32_t receiver) {
  PairPart::Body moved;
  for (const ConvexBody::Corner& c : body.corner)
    moved.corner.push_back(surfaces.surface[c.polygon].corner[c.index] +
                           surfaces.from_to(receiver, c.polygon));
  for (const std::uint32_t f : body.face)
    moved.face.push_back({surfaces.surface[f].normal, surfaces.from_to(receiver, f)});
  moved.side = body.side;
  return moved;
}

}  // namespace

std::vector<PairPart> parts_of_pair(const SurfaceList& surfaces, const BoxTree& tree, std::uint32_t receiver,
                                    std::uint32_t shooter) {
  const Surface &r = surfaces.surface[receiver], &s = surfaces.surface[shooter];
  if (r.plane == s.plane) return {};
  const glm::dvec3 s_anchor = surfaces.from_to(receiver, shooter);
  const Convex& r_whole = r.corner;
  const Convex s_whole = surfaces.seen_from(shooter, s.corner, receiver);
  const double largest = std::max(r.largest, s.largest);
  // Distances over which each plane is extrapolated.
  const double doubt_r = surfaces.doubt(receiver, reach_of(s_whole, r_whole[0]), largest);
  const double doubt_s = surfaces.doubt(shooter, reach_of(r_whole, s_whole[0]), largest);
  const auto over_r = [&](const Convex& c) { return heights_over(c, r.normal, r_whole[0]); };
  const auto over_s = [&](const Convex& c) { return heights_over(c, s.normal, s_anchor); };
  if (cut(s_whole, over_r(s_whole), doubt_r).front.empty() ||
      cut(r_whole, over_s(r_whole), doubt_s).front.empty())
    return {};

  std::vector<PairPart> parts;
  for (const Convex& r_piece : r.exposed)
    for (const Convex& s_piece_own : s.exposed) {
      const Convex s_piece = surfaces.seen_from(shooter, s_piece_own, receiver);
      PairPart part;
      part.receiver_normal = r.normal;
      part.receiver = {cut(r_piece, over_s(r_piece), doubt_s).front};
      part.shooter = cut(s_piece, over_r(s_piece), doubt_r).front;
      if (!has_area(part.receiver[0], reach_of(r_whole, r_whole[0])) ||
          !has_area(part.shooter, reach_of(s_whole, s_whole[0])))
        continue;
      while (part.shooter.size() > most_shooter_corners) {
        PairPart rest = part;
        rest.shooter.erase(rest.shooter.begin() + 1, rest.shooter.begin() + most_shooter_corners - 1);
        part.shooter.resize(most_shooter_corners);
        parts.push_back(std::move(part));
        part = std::move(rest);
      }
      parts.push_back(std::move(part));
    }
  if (parts.empty()) return {};

  const glm::dvec3 origin = surfaces.frame.to_frame(r.anchor_m);
  for (PairPart& part : parts) {
    const Convex whole = part.receiver[0];
    Shaft shaft(whole, part.shooter);
    shaft.add({-r.normal, r_whole[0]});
    shaft.add({-s.normal, s_anchor});
    const double doubt = std::max(doubt_r, doubt_s);
    part.shooter_doubt = doubt;
    std::map<std::uint32_t, std::uint32_t>
        body_at;  // of those that count as one; no_body: each face by itself
    const auto place_of = [&](std::uint32_t body) {
      if (body == Surface::no_body) return body;
      const auto [at, is_new] = body_at.emplace(body, Surface::no_body);
      if (!is_new) return at->second;
      PairPart::Body moved = body_seen_from(surfaces, surfaces.body[body], receiver);
      for (const glm::dvec3& c : moved.corner)
        if (glm::dot(r.normal, c - r_whole[0]) < -doubt_r || glm::dot(s.normal, c - s_anchor) < -doubt_s)
          return Surface::no_body;
      at->second = std::uint32_t(part.bodies.size());
      part.bodies.push_back(std::move(moved));
      return at->second;
    };
    for (const std::uint32_t k : tree.near(receiver, shooter, shaft, origin)) {
      const Surface& o = surfaces.surface[k];
      if (o.plane == r.plane || o.plane == s.plane) continue;
      Convex corner = surfaces.seen_from(k, o.corner, receiver);
      const double size = reach_of(corner, corner[0]);
      corner = cut(corner, over_r(corner), std::max(doubt_r, 4 * 0x1p-53 * o.largest)).front;
      if (corner.empty()) continue;
      corner = cut(corner, over_s(corner), std::max(doubt_s, 4 * 0x1p-53 * o.largest)).front;
      drop_repeated(corner, 1e-13 * size);
      if (!has_area(corner, size) || !shaft.may_hold(corner, doubt)) continue;
      part.occluders.push_back({std::move(corner), o.normal, place_of(o.body)});
    }
    std::stable_sort(part.occluders.begin(), part.occluders.end(),
                     [](const auto& a, const auto& b) { return area_of(a.corner) > area_of(b.corner); });
    for (auto& o : part.occluders) find_shadow(part, o);
    for (auto& o : part.occluders) {
      if (part.receiver.size() > most_receiver_parts) break;
      cut_at_contact(part, o.corner, 4 * doubt_r);
    }
  }
  return parts;
}

std::vector<PairPart> with_halved_shooter(const PairPart& part) {
  std::size_t longest = 0;
  double length = -1;
  for (std::size_t i = 0; i < part.shooter.size(); ++i) {
    const double l = glm::distance(part.shooter[i], part.shooter[(i + 1) % part.shooter.size()]);
    if (l > length) length = l, longest = i;
  }
  const glm::dvec3 a = part.shooter[longest], b = part.shooter[(longest + 1) % part.shooter.size()];
  const Halves halves = cut(part.shooter, heights_over(part.shooter, (b - a) / length, 0.5 * (a + b)), 0);
  std::vector<PairPart> parts;
  for (const Convex& half : {halves.front, halves.back}) {
    if (half.empty()) continue;
    PairPart one = part;
    one.shooter = half;
    one.occluders.clear();
    // The hull of all receiver parts is that of the receiver they were cut from.
    Convex all;
    for (const Convex& r : part.receiver) all.insert(all.end(), r.begin(), r.end());
    const Shaft shaft(half, all);
    for (const auto& o : part.occluders)
      if (shaft.may_hold(o.corner, part.shooter_doubt)) one.occluders.push_back(o);
    for (auto& o : one.occluders) find_shadow(one, o);
    parts.push_back(std::move(one));
  }
  return parts;
}

}  // namespace clrad
