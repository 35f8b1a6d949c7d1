// Campaigns of so few sessions that coefficients of locations absorb what some effects do.
#include "attribution/generator/campaign.h"
#include "datasets/error.h"
#include "support/message_of.h"

#include <gmock/gmock.h>

namespace tunnelrig::attribution {
namespace {

const Settings kFourSessions = {
    .track = Track::kOne, .noise = Noise::kHeavyTailed, .blocks = 4, .runs = 48, .seed = 161037869783238};

TEST(SmallDesign, AnEffectThatItHidesIsRefusedByName) {
  Settings settings = kFourSessions;
  settings.effects = {"wake_recirculation"};
  EXPECT_THAT(test::message_of([&] { generate(settings); }),
              testing::HasSubstr("--effect wake_recirculation: this design cannot show it"));
}

TEST(SmallDesign, WhereItIsDrawnAnotherTakesItsPlaceForGood) {
  const Campaign campaign = generate(kFourSessions);
  ASSERT_EQ(campaign.effects.size(), 1u);
  EXPECT_NE(campaign.effects[0].effect.name, "wake_recirculation");
  Settings more = kFourSessions;
  more.separating = {{.setting = {{"speed_rpm", 4500}}, .location = ""}};
  EXPECT_EQ(generate(more).effects[0].effect.name, campaign.effects[0].effect.name);
}

}  // namespace
}  // namespace tunnelrig::attribution
