// clrad_atan2 and the pairs of kernels/shared/math.cl, compiled for the host.
#include <gtest/gtest.h>

#include <random>

#include "oracle/point_factor.hpp"
#include "shared/kernel_math.hpp"

namespace clrad {
namespace {

using oracle::Quad;

double ulp32(double x) {
  return std::max(std::ldexp(1.0, std::ilogb(x) - 23), 1e-44);
}
double ulp64(double x) {
  return std::max(std::ldexp(1.0, std::ilogb(x) - 52), 5e-324);
}

struct Worst {
  double ulp32 = 0, ulp64 = 0;
};

// Errors in ulp of the result; long double's own 2^-64 is 5e-4 of a double's ulp.
void check(double y, double x, Worst& worst) {
  const float y32 = float(y), x32 = float(x);
  const double exact32 = double(std::atan2((long double)y32, (long double)x32));
  if (exact32 > 0)
    worst.ulp32 =
        std::max(worst.ulp32, std::abs(double(kernel32::clrad_atan2(y32, x32)) - exact32) / ulp32(exact32));
  const long double exact64 = std::atan2((long double)y, (long double)x);
  if (exact64 > 0)
    worst.ulp64 = std::max(worst.ulp64, std::abs(double((long double)kernel64::clrad_atan2(y, x) - exact64)) /
                                            ulp64(double(exact64)));
}

TEST(Atan2, IsWithinTwoUlp) {
  constexpr std::uint64_t seed = 7;
  RecordProperty("seed", int(seed));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> angle(0, M_PI), exponent(-12, 12), magnitude(-3, 3);
  Worst worst;
  for (int i = 0; i < 400000; ++i) {
    const double a = angle(random), r = std::exp(magnitude(random));
    check(r * std::sin(a), r * std::cos(a), worst);
    const double ratio = std::exp(exponent(random));
    check(ratio, 1, worst);
    check(ratio, -1, worst);
  }
  // On both sides of where the nearest multiple of 1/4 changes, and of the octants' borders.
  for (const double t : {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0})
    for (const double next : {std::nextafter(t, 0), t, std::nextafter(t, 2),
                              double(std::nextafter(float(t), 0.0f)), double(std::nextafter(float(t), 2.0f))})
      for (const double sign : {1.0, -1.0}) {
        check(next, sign, worst);
        check(1, sign * next, worst);
      }
  EXPECT_LE(worst.ulp32, 2);
  EXPECT_LE(worst.ulp64, 2);
}

TEST(Atan2, SpecialArguments) {
  EXPECT_EQ(kernel32::clrad_atan2(0, 1), 0.0f);
  EXPECT_EQ(kernel32::clrad_atan2(0, 0), 0.0f);
  EXPECT_EQ(kernel32::clrad_atan2(0, -1), float(M_PI));
  EXPECT_EQ(kernel32::clrad_atan2(1, 0), float(M_PI / 2));
  EXPECT_EQ(kernel32::clrad_atan2(1, 1), float(M_PI / 4));
  EXPECT_EQ(kernel64::clrad_atan2(0, -1), M_PI);
  EXPECT_EQ(kernel64::clrad_atan2(1, 0), M_PI / 2);
  EXPECT_EQ(kernel64::clrad_atan2(1, -1), 3 * M_PI / 4);
  EXPECT_EQ(kernel64::clrad_atan2(1e-300, 1), 1e-300);
  EXPECT_TRUE(std::isnan(kernel32::clrad_atan2(NAN, 1)) || kernel32::clrad_atan2(NAN, 1) == 0);
}

// Relative error of one operation on pairs against 34 digits: a few eps^2 (eps = 2^-53: 1.2e-32) for sums of
// one sign, products and quotients; for differences of the operands' size.
TEST(Pairs, HaveTwiceTheDigits) {
  constexpr std::uint64_t seed = 11;
  RecordProperty("seed", int(seed));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  const double most = 16 * std::ldexp(1.0, -106);
  const auto value = [](const kernel64::clrad_pair& p) { return Quad(p.hi) + Quad(p.lo); };
  for (int i = 0; i < 5000; ++i) {
    const auto a = kernel64::clrad_two_sum(number(random), std::ldexp(number(random), -53));
    const auto b = kernel64::clrad_two_sum(number(random), std::ldexp(number(random), -53));
    const Quad qa = value(a), qb = value(b);
    EXPECT_LE(abs(value(kernel64::clrad_pair_add(a, b)) - (qa + qb)), most * (abs(qa) + abs(qb)));
    EXPECT_LE(abs(value(kernel64::clrad_pair_mul(a, b)) - qa * qb), most * abs(qa * qb));
    EXPECT_LE(abs(value(kernel64::clrad_pair_div(a, b)) - qa / qb), most * abs(qa / qb));
    EXPECT_EQ(value(kernel64::clrad_two_product(a.hi, b.hi)), Quad(a.hi) * Quad(b.hi));
    const auto positive = a.hi > 0 ? a : kernel64::clrad_pair_negative(a);
    EXPECT_LE(abs(value(kernel64::clrad_pair_sqrt(positive)) - sqrt(value(positive))),
              most * sqrt(value(positive)));
  }
}

// Errors in units of half an ulp of 1, relative to the angle.
struct WorstPair {
  double in_float = 0, in_double = 0;
};
void check_pair(double y, double y_lo, double x, double x_lo, WorstPair& worst) {
  const auto y64 = kernel64::clrad_two_sum(y, y_lo), x64 = kernel64::clrad_two_sum(x, x_lo);
  const auto angle64 = kernel64::clrad_pair_atan2(y64, x64);
  const Quad exact64 = atan2(Quad(y64.hi) + Quad(y64.lo), Quad(x64.hi) + Quad(x64.lo));
  if (exact64 > 0)
    worst.in_double = std::max(
        worst.in_double, double(abs(Quad(angle64.hi) + Quad(angle64.lo) - exact64) / exact64) / 0x1p-53);
  const auto y32 = kernel32::clrad_two_sum(float(y), float(y - double(float(y)))),
             x32 = kernel32::clrad_two_sum(float(x), float(x - double(float(x))));
  const auto angle32 = kernel32::clrad_pair_atan2(y32, x32);
  const long double exact32 = std::atan2((long double)y32.hi + y32.lo, (long double)x32.hi + x32.lo);
  if (exact32 > 0)
    worst.in_float = std::max(
        worst.in_float, double(std::abs((long double)angle32.hi + angle32.lo - exact32) / exact32) / 0x1p-24);
}

TEST(PairAtan2, IsWithinItsBound) {
  constexpr std::uint64_t seed = 13;
  RecordProperty("seed", int(seed));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> angle(0, M_PI), exponent(-12, 12), magnitude(-3, 3), low(-1, 1);
  WorstPair worst;
  const auto check_near = [&](double y, double x) {
    check_pair(y, std::ldexp(y * low(random), -54), x, std::ldexp(x * low(random), -54), worst);
  };
  for (int i = 0; i < 20000; ++i) {
    const double a = angle(random), r = std::exp(magnitude(random));
    check_near(r * std::sin(a), r * std::cos(a));
    const double ratio = std::exp(exponent(random));
    check_near(ratio, 1);
    check_near(ratio, -1);
  }
  for (const double t : {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0})
    for (const double next : {std::nextafter(t, 0), t, std::nextafter(t, 2)})
      for (const double sign : {1.0, -1.0}) {
        check_near(next, sign);
        check_near(1, sign * next);
      }
  // CLRAD_PAIR_ATAN2_ERROR
  EXPECT_LE(worst.in_float, 0x1p-18);
  EXPECT_LE(worst.in_double, 0x1p-11);
  const kernel64::clrad_pair none{0, 0}, one{1, 0}, back{-1, 0};
  EXPECT_EQ(kernel64::clrad_pair_atan2(none, none).hi, 0);
  EXPECT_EQ(kernel64::clrad_pair_atan2(none, one).hi, 0);
  EXPECT_EQ(kernel64::clrad_pair_atan2(none, back).hi, M_PI);
  EXPECT_EQ(kernel64::clrad_pair_atan2(one, none).hi, M_PI / 2);
}

TEST(PowerOfTwo, IsTheLeadingBit) {
  EXPECT_EQ(kernel32::clrad_power_of_two(3.9f), 2.0f);
  EXPECT_EQ(kernel32::clrad_power_of_two(-1.0f), 1.0f);
  EXPECT_EQ(kernel32::clrad_power_of_two(0.0f), 0.0f);
  EXPECT_EQ(kernel64::clrad_power_of_two(1e-20), std::ldexp(1.0, -67));
}

}  // namespace
}  // namespace clrad
