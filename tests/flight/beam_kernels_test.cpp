// Every instruction set that this machine has gives the same bits.
#include "flight/localisation/beam_kernels.h"

#include "support/seeds.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

struct Arrays {
  BeamArray arrays[10];
  Beams beams;

  explicit Arrays(std::size_t count) {
    float** const into[] = {&beams.cosine, &beams.sine, &beams.range,  &beams.along_y, &beams.along_z,
                            &beams.y,      &beams.z,    &beams.wall_y, &beams.wall_z,  &beams.inverse};
    for (std::size_t i = 0; i < 10; ++i) {
      arrays[i].resize(count);
      *into[i] = arrays[i].data();
    }
    beams.count = count;
    beams.padded = arrays[0].padded();
    for (std::size_t i = 0; i < count; ++i) {
      beams.cosine[i] = std::cos(0.0087F * static_cast<float>(i) - 0.8F);
      beams.sine[i] = std::sin(0.0087F * static_cast<float>(i) - 0.8F);
    }
  }
};

/// All that the kernels put out for one scan, one after the other.
std::vector<float> everything(const BeamKernels& k, const std::vector<float>& range) {
  Arrays a(range.size());
  std::vector<float> out{static_cast<float>(k.load(range.data(), a.beams, 0.06F, 10))};
  const Projection p{0.9F, 0.1F, -0.2F, 0.95F};
  k.project(a.beams, p);
  std::vector<std::int32_t> cell(a.beams.padded);
  k.cells(a.beams, 120, 90, 300, 640, cell.data());
  std::vector<std::uint16_t> histogram(642);
  for (const std::int32_t c : cell) ++histogram[static_cast<std::size_t>(c)];
  out.insert(out.end(), histogram.begin(), histogram.end());
  const std::int32_t start[] = {600, 340, 330};
  const float weight[] = {1, 0.7F, 0.3F};
  std::vector<float> raw(317);
  k.correlate(histogram.data(), start, weight, 3, raw.data(), raw.size());
  const std::vector<float> taps{0.1F, 0.7F, 1, 0.7F, 0.1F};
  std::vector<float> score(raw.size() - 4);
  k.smooth(raw.data(), taps.data(), taps.size(), score.data(), score.size());
  out.insert(out.end(), score.begin(), score.end());
  out.push_back(k.maximum(score.data(), score.size()));
  k.see(a.beams, 0, std::min<std::size_t>(301, range.size()), 0.9F, 0.3F);
  k.see(a.beams, range.size() / 2, range.size(), -0.8F, 0.9F);
  for (const int unknowns : {2, 3, 4}) {
    FitSums sums;
    k.fit(a.beams, p, 0.3F, 5, unknowns, sums);
    for (const auto& row : sums.normal) out.insert(out.end(), row, row + 4);
    out.insert(out.end(), sums.gradient, sums.gradient + 4);
    out.insert(out.end(), {sums.square, sums.absolute, sums.inliers, sums.beyond, sums.expected});
  }
  Evidence e;
  k.weigh(a.beams, 0.3F, 5, e);
  out.insert(out.end(),
             {e.facing_yy, e.facing_yz, e.facing_zz, e.square_y, e.square_z, e.shared_y, e.shared_z});
  return out;
}

TEST(BeamKernels, AllInstructionSetsAgreeToTheBit) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<float> uniform(0, 2);
  for (const std::size_t beams : {541U, 540U, 17U}) {
    std::vector<float> range(beams);
    for (float& r : range) r = uniform(random);
    const auto all = all_beam_kernels();
    const std::vector<float> portable = everything(*all.front(), range);
    for (const BeamKernels* kernels : all) {
      SCOPED_TRACE(kernels->instruction_set);
      const std::vector<float> result = everything(*kernels, range);
      ASSERT_EQ(result.size(), portable.size());
      EXPECT_EQ(std::memcmp(result.data(), portable.data(), result.size() * sizeof(float)), 0);
    }
  }
}

TEST(BeamKernels, LoadCountsReturnsAndFindsNaN) {
  for (const BeamKernels* kernels : all_beam_kernels()) {
    Arrays a(20);
    std::vector<float> range(20, 1);
    range[3] = 0.01F;
    range[7] = 50;
    range[8] = INFINITY;
    EXPECT_EQ(kernels->load(range.data(), a.beams, 0.06F, 10), 17);
    EXPECT_EQ(a.beams.range[3], 0);
    EXPECT_EQ(a.beams.range[8], 0);
    range[19] = NAN;
    EXPECT_EQ(kernels->load(range.data(), a.beams, 0.06F, 10), -1);
  }
}

}  // namespace
}  // namespace tunnelrig
