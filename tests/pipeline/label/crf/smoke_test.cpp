// The same marginals on every processor.
#include <gtest/gtest.h>

#include <bit>

#include "pipeline/label/crf/batch_crf.hpp"
#include "tests/pipeline/label/crf/clouds.hpp"

namespace tactus::label::test {
namespace {

// Made without libm: what a cloud of the other tests is made with may differ by processor.
Cloud plain_cloud(int materials) {
  std::uint64_t state = 1;
  const auto random = [&state](std::uint32_t below) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::uint32_t>(state >> 33) % below;
  };
  Cloud cloud;
  for (int i = 0; i < 1500; ++i) {
    const auto a = static_cast<float>(random(64)) * 0.01F, b = static_cast<float>(random(64)) * 0.01F;
    const bool wall = random(2) == 0;
    cloud.add(wall ? Vec3f{a, b, 0} : Vec3f{a, 0, b},
              {static_cast<std::uint8_t>(random(64)), static_cast<std::uint8_t>(wall ? 200 : 90), 30},
              wall ? Vec3f{0, 0, 1} : Vec3f{0, 0.8F, 0.6F}, 0);
    for (int l = 0; l < kMaterialCount; ++l)
      cloud.unary_nat.push_back(l < materials ? static_cast<float>(random(96)) * 0.03125F : 3.0F);
  }
  return cloud;
}

TEST(CrfSmoke, MarginalsAreTheSameOnEveryProcessor) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const int materials : {3, 12, 23}) {  // 8, 16 and 24 columns
    const Cloud cloud = plain_cloud(materials);
    const auto config = BatchCrfConfig::for_any_points(cloud.size());
    const Memory memory(BatchCrf::bytes_needed(config));
    rt::Slice slice = memory.slice();
    BatchCrf sut;
    sut.bind(slice, config);
    CrfParameters parameters = three_kernels();
    parameters.normalisation = materials == 3 ? CrfNormalisation::per_point : CrfNormalisation::symmetric;
    ASSERT_EQ(sut.prepare(cloud.points(), parameters), rt::Status::ok);
    std::vector<float> marginals(cloud.size() * kMaterialCount);
    static_cast<void>(sut.solve(marginals));
    for (const float q : marginals) hash = (hash ^ std::bit_cast<std::uint32_t>(q)) * 1099511628211ULL;
  }
  EXPECT_EQ(hash, 8428561664632326748ULL);
}

}  // namespace
}  // namespace tactus::label::test
