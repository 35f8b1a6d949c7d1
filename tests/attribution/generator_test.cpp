#include "attribution/effects/catalogue.h"
#include "attribution/generator/campaign.h"
#include "attribution/generator/oracle.h"
#include "cli/program.h"
#include "datasets/csv.h"
#include "datasets/error.h"
#include "support/seeds.h"
#include "support/temporary_folder.h"

#include <map>
#include <utility>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::attribution {
namespace {

using test::TemporaryFolder;

std::vector<std::string> reduced_effects() {
  return {"air_pressure",
          "air_humidity",
          "rotor_speed",
          "reynolds_number",
          "tip_mach",
          "supply_voltage",
          "motor_warm_up",
          "axial_wind",
          "creep",
          "wake_recirculation",
          "hysteresis",
          "zero_drift_time",
          "mounting_step",
          "propeller_step",
          "zero_drift_temperature",
          "span_drift_temperature",
          "temperature_gradient",
          "ground_effect",
          "ceiling_effect"};
}

std::vector<std::string> made_up_effects() {
  return {"humidity_wave", "voltage_band", "time_of_day_arch", "temperature_kink",
          "cable_wave",    "fan_switch",   "blade_sets"};
}

std::string files_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> texts;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) texts[entry.path().lexically_relative(folder)] = read_text(entry.path());
  }
  std::string all;
  for (const auto& [name, text] : texts) all.append(name).append("\n").append(text);
  return all;
}

/// Rms of what stands between readings and baseline once the scatter is divided out, location means taken
/// out; over the rotors that `effect` acts on.
double rms_in_readings(const Campaign& campaign) {
  double square = 0;
  int count = 0;
  const auto only = campaign.effects.front().effect.rotor;
  for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
    if (only && *only != rotor) continue;
    std::map<std::string, std::vector<double>> places;
    for (std::size_t i = 0; i < campaign.world.runs.size(); ++i) {
      const double clean_N = campaign.measured_N[i][rotor] / (1 + campaign.scatter[i][rotor]);
      const std::string place = campaign.open_space ? "" : campaign.world.runs[i].location;
      places[place].push_back(clean_N / campaign.world.baseline_N[i][rotor] - 1);
    }
    for (const auto& [name, values] : places) {
      double mean = 0;
      for (const double value : values) mean += value / static_cast<double>(values.size());
      for (const double value : values) square += (value - mean) * (value - mean);
      count += static_cast<int>(values.size());
    }
  }
  return std::sqrt(square / count);
}

TEST(Generator, SameSeedSameBytes) {
  const TemporaryFolder scratch;
  for (const bool raw : {false, true}) {
    Settings settings{.track = Track::kOne, .noise = Noise::kHeavyTailed, .seed = test::seed(), .raw = raw};
    settings.runs = raw ? 40 : 215;
    settings.effects = {"creep"};
    const std::string name = raw ? "raw" : "reduced";
    write_folder(generate(settings), scratch / (name + "1"));
    write_folder(generate(settings), scratch / (name + "2"));
    EXPECT_EQ(files_of(scratch / (name + "1")), files_of(scratch / (name + "2")));
    EXPECT_EQ(key_json(generate(settings)), key_json(generate(settings)));
    settings.seed += 1;
    write_folder(generate(settings), scratch / (name + "3"));
    EXPECT_NE(files_of(scratch / (name + "1")), files_of(scratch / (name + "3")));
  }
}

TEST(Generator, EffectsHaveTheSizeAskedFor) {
  for (const std::string& effect : reduced_effects()) {
    for (const double size : {0.25, 1.0, 4.0}) {
      for (const Noise noise : {Noise::kWhite, Noise::kSession}) {
        const Campaign campaign = generate(
            {.track = Track::kOne, .noise = noise, .size = size, .effects = {effect}, .seed = test::seed()});
        const Sized& sized = campaign.effects.front();
        SCOPED_TRACE(effect + " " + std::to_string(size));
        EXPECT_NEAR(sized.rms_over_level / size, 1, 0.02);
        EXPECT_NEAR(rms_in_readings(campaign), sized.rms, 0.02 * sized.rms);
        EXPECT_NEAR(sized.rms_over_run, sized.rms / campaign.noise.run, 1e-12);
      }
    }
  }
  for (const std::string& effect : made_up_effects()) {
    const Campaign campaign = generate({.track = Track::kOutside, .effects = {effect}, .seed = test::seed()});
    EXPECT_NEAR(campaign.effects.front().rms_over_level, 1, 0.02) << effect;
    EXPECT_FALSE(campaign.effects.front().effect.in_library) << effect;
  }
}

TEST(Generator, SwitchesChangeNothingElse) {
  const TemporaryFolder folder;
  const auto written = [&](bool switches, const char* name) {
    write_folder(generate({.track = Track::kNone, .seed = test::seed(), .switches = switches}),
                 folder / name);
    return parse_csv(read_text(folder / name / "runs.csv"), "runs.csv");
  };
  const Sheet without = written(false, "without"), with = written(true, "with");
  EXPECT_FALSE(without.find("fan_on"));
  ASSERT_TRUE(with.find("fan_on"));
  for (std::size_t row = 0; row < with.rows.size(); ++row) {
    EXPECT_EQ(with.text(row, "thrust_3_N"), without.text(row, "thrust_3_N"));
    EXPECT_THAT(with.text(row, "fan_on"), testing::AnyOf("0", "1"));
    EXPECT_THAT(with.text(row, "blade_set"), testing::AnyOf("A", "B", "C"));
  }
}

TEST(Generator, SizesCanBeOverTheRunScatterAtEveryLevel) {
  const Campaign campaign = generate({.track = Track::kOne,
                                      .noise = Noise::kSession,
                                      .size = 0.5,
                                      .effects = {"span_drift_temperature"},
                                      .seed = test::seed(),
                                      .size_over_run_scatter = true});
  EXPECT_NEAR(campaign.effects.front().rms_over_run, 0.5, 0.01);
}

TEST(Generator, KnownPhysicsKeepsItsLaw) {
  const Campaign campaign =
      generate({.track = Track::kOne, .size = 2, .effects = {"air_pressure"}, .seed = test::seed()});
  for (std::size_t i = 0; i < campaign.world.runs.size(); ++i) {
    const double law = campaign.world.runs[i].air_pressure_Pa / kStandardPressure_Pa;
    EXPECT_NEAR(reading_over_baseline(campaign, i, 2, 0), law * (1 + campaign.scatter[i][2]), 1e-12);
  }
}

TEST(Generator, ConditionsArePlausible) {
  for (std::uint64_t seed = test::seed(); seed < test::seed() + 30; ++seed) {
    for (const Track track : {Track::kNone, Track::kTwo}) {
      const Campaign campaign = generate({.track = track, .seed = seed});
      double before_s = 0;
      int session = -1;
      for (const Conditions& run : campaign.world.runs) {
        // a run waits for the one before it and for its own motors
        EXPECT_GE(run.start_s, before_s + (run.session == session ? run.time_since_motor_start_s : 0));
        before_s = run.start_s + 60;
        session = run.session;
        EXPECT_THAT(run.air_temperature_C, testing::AllOf(testing::Gt(5), testing::Lt(42)));
        EXPECT_THAT(run.supply_voltage_V, testing::AllOf(testing::Gt(14), testing::Lt(15.6)));
        EXPECT_THAT(run.relative_humidity, testing::AllOf(testing::Gt(0.02), testing::Lt(0.97)));
      }
      EXPECT_EQ(session, campaign.settings.blocks - 1);
      for (const Rotors& thrusts : campaign.world.baseline_N) {
        for (const double thrust_N : thrusts)
          EXPECT_THAT(thrust_N, testing::AllOf(testing::Gt(2), testing::Lt(9.8)));
      }
    }
  }
}

TEST(Oracle, CountsSigmasOfAnAlternatingSignal) {
  World world{.blocks = 1};
  std::vector<Rotors> signal;
  for (int i = 0; i < 20; ++i) {
    Conditions run;
    run.location = "OS";
    world.runs.push_back(run);
    const double value = i % 2 == 0 ? 0.001 : -0.001;
    signal.push_back({value, value, value, value});
  }
  // common mode: variance of the mean of four rotors is run^2 (1 + 3 c) / 4
  const NoiseModel noise{.run = 0.002, .run_common = 0.5};
  const double mean_sigma = 0.002 * std::sqrt((1 + 3 * 0.5) / 4);
  EXPECT_NEAR(distance_sigma(signal, {}, world, noise, false), 0.001 / mean_sigma * std::sqrt(20), 1e-9);
  EXPECT_NEAR(distance_sigma(signal, signal, world, noise, false), 0, 1e-6);
}

double nearest(const Campaign& campaign, const std::string& other) {
  const Sized& truth = campaign.effects.front();
  const auto signal = changes_of(truth.effect, truth.amplitude, campaign.world);
  double best = 1e300;
  for (std::uint64_t draw = 0; draw < 100; ++draw) {
    Random random(draw, "partner");
    Effect partner = make_effect(other, random);
    if (partner.rotor) partner.rotor = truth.effect.rotor;
    best = std::min(best, distance_sigma(signal, changes_of(partner, 1e-3, campaign.world), campaign.world,
                                         campaign.noise, campaign.open_space));
  }
  return best;
}

TEST(Tracks, ConfoundedPairsCannotBeTold) {
  for (std::uint64_t seed = test::seed(); seed < test::seed() + 40; ++seed) {
    const Campaign campaign = generate({.track = Track::kConfounded, .noise = Noise::kSession, .seed = seed});
    ASSERT_EQ(campaign.truth.acceptable.size(), 2U);
    const double distance = nearest(campaign, campaign.truth.acceptable[1]);
    EXPECT_LT(distance, 1.5) << campaign.truth.effects[0] << " / " << campaign.truth.acceptable[1] << " "
                             << seed;
  }
}

/// The partner must be able to do it: no blade sees more than a few times Prandtl and Glauert's 1/2.
TEST(Tracks, AConfoundedMachNumberNeedsNoImpossibleExponent) {
  int impossible = 0;
  for (const Noise noise : {Noise::kWhite, Noise::kSession})
    for (std::uint64_t seed = test::seed(); seed < test::seed() + 20; ++seed) {
      const Campaign campaign = generate(
          {.track = Track::kConfounded, .noise = noise, .effects = {"reynolds_number"}, .seed = seed});
      Random random(0, "partner");
      Sized partner{.effect = make_effect("tip_mach", random), .amplitude = 1};
      measure(partner, campaign.world, campaign.noise, campaign.open_space);
      impossible += campaign.effects.front().rms > 2 * partner.rms;
    }
  EXPECT_LE(impossible, 1);
}

TEST(Tracks, SingleEffectsCanBeToldFromTheirLikes) {
  const std::map<std::string, std::string> likes = {{"span_drift_temperature", "zero_drift_temperature"},
                                                    {"zero_drift_temperature", "span_drift_temperature"},
                                                    {"creep", "wake_recirculation"},
                                                    {"motor_warm_up", "wake_recirculation"}};
  for (const auto& [truth, other] : likes) {
    std::vector<double> distances;
    for (std::uint64_t seed = test::seed(); seed < test::seed() + 15; ++seed) {
      distances.push_back(nearest(generate({.track = Track::kOne, .effects = {truth}, .seed = seed}), other));
    }
    std::sort(distances.begin(), distances.end());
    EXPECT_GT(distances[7], 3) << truth << " / " << other;
  }
}

TEST(Tracks, AHiddenCovariateIsNotInTheTable) {
  const TemporaryFolder scratch;
  const Campaign campaign =
      generate({.track = Track::kNotRecorded, .effects = {"axial_wind"}, .seed = test::seed()});
  write_folder(campaign, scratch / "c");
  EXPECT_FALSE(read_csv(scratch / "c/runs.csv").find("tunnel_airspeed_m_s"));
  EXPECT_TRUE(read_csv(scratch / "c/runs.csv").find("supply_voltage_V"));
}

TEST(Separating, ProposedRunsComeOnTopOfTheSameCampaign) {
  Settings settings{.track = Track::kConfounded, .effects = {"span_drift_temperature"}, .seed = test::seed()};
  const Campaign before = generate(settings);
  settings.separating = {{.setting = {{"speed_rpm", 4000}}, .location = "OS"}};
  const Campaign after = generate(settings);
  ASSERT_EQ(after.world.runs.size(), before.world.runs.size() + 48);
  for (std::size_t i = 0; i < before.world.runs.size(); ++i) {
    ASSERT_EQ(after.measured_N[i], before.measured_N[i]);
  }
  const std::size_t last = after.world.runs.size() - 1;
  EXPECT_TRUE(after.world.runs[last].proposed);
  EXPECT_EQ(after.world.runs[last].location, "OS");
  EXPECT_NEAR(after.world.baseline_N[last][0] / after.world.baseline_N[last - 1][0], 0.64, 0.01);
  EXPECT_GE(after.world.runs[last].session, settings.blocks);
  // the run asked for tells the two apart
  World all = after.world;
  for (Conditions& run : all.runs) run.added = false;
  const Effect& truth = after.effects.front().effect;
  Random random(1, "partner");
  const auto partner = changes_of(make_effect("zero_drift_temperature", random), 1e-3, all);
  const auto signal = changes_of(truth, after.effects.front().amplitude, all);
  EXPECT_GT(distance_sigma(signal, partner, all, after.noise, false),
            distance_sigma(signal, partner, before.world, before.noise, false));
}

TEST(Generator, RefusesWhatNoCampaignCanBe) {
  EXPECT_THROW(generate({.blocks = 0}), InputError);
  EXPECT_THROW(generate({.blocks = 18, .runs = 20}), InputError);
  EXPECT_THROW(generate({.track = Track::kOne, .size = 0}), InputError);
  EXPECT_THROW(generate({.track = Track::kOne, .effects = {"gremlins"}}), InputError);
  EXPECT_THROW(generate({.track = Track::kOne, .effects = {"crosstalk"}}), InputError);
  EXPECT_THROW(generate({.track = Track::kTwo, .effects = {"creep"}}), InputError);
  EXPECT_THROW(generate({.track = Track::kConfounded, .effects = {"rotor_speed"}}), InputError);
}

class ImportTest : public testing::TestWithParam<std::string> {};

TEST_P(ImportTest, ImportsAndCalibratesCleanly) {
  const TemporaryFolder scratch;
  const std::string seed = std::to_string(test::seed());
  const std::string generate = std::string("'") + TUNNELRIG_GENERATE + "' --out '" +
                               (scratch / "c").string() + "' --key '" + (scratch / "key.json").string() +
                               "' --seed " + seed + " " + GetParam();
  ASSERT_EQ(std::system(generate.c_str()), 0);
  for (const char* verb : {"import c --db c.db", "calibrate --db c.db"}) {
    const auto result = test::run_program(scratch.path(), verb);
    EXPECT_EQ(result.code, 0) << result.error;
  }
  const auto key = nlohmann::json::parse(read_text(scratch / "key.json"));
  EXPECT_EQ(key["format"], "tunnelrig-attribution-key/1");
  EXPECT_GT(key["noise_floor"]["with_coefficients_N"], key["noise_floor"]["root_N"]);
  // nothing in the folder says what is in the key; a column may begin like an effect
  const std::string files = files_of(scratch / "c");
  for (const auto& effect : key["effects"]) {
    const auto name = effect["effect"].get<std::string>();
    for (auto at = files.find(name); at != std::string::npos; at = files.find(name, at + 1)) {
      EXPECT_EQ(files.at(at + name.size()), '_') << name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    AllKinds, ImportTest,
    testing::Values("--track none", "--track one --noise session --blocks 4 --runs 60 --order swept",
                    "--track two --noise autocorrelated --blocks 24 --runs 430", "--track confounded",
                    "--track outside --unequal-repeats --missing-cells",
                    "--track not_recorded --noise heavy_tailed", "--track one --effect ground_effect",
                    "--track one --raw --effect adc_clipping --runs 60",
                    "--track one --raw --effect mains_pickup --runs 60"));

TEST(GenerateProgram, KeepsTheKeyOutOfTheFolder) {
  const TemporaryFolder scratch;
  const std::string command = std::string("'") + TUNNELRIG_GENERATE + "' --out '" + (scratch / "c").string() +
                              "' --key '" + (scratch / "c/key.json").string() + "' 2>/dev/null";
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 2);
  EXPECT_FALSE(std::filesystem::exists(scratch / "c"));
}

}  // namespace
}  // namespace tunnelrig::attribution
