// Observations for tests of the whole protocol, and the contract of what is written of them.
#pragma once

#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <gtest/gtest.h>

namespace tunnelrig::test {

struct ExplainTest : ::testing::Test {
  std::mt19937_64 random{seed()};

  Observations observations(int blocks, double sigma = 0.002) {
    Observations o = simulate({.runs_of_block = std::vector<int>(static_cast<std::size_t>(blocks), 8),
                               .channels = 4,
                               .sigma = sigma,
                               .session_ratio = 0.4},
                              random);
    add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
    add_covariate(o, "air_pressure_Pa", 100500, 102500, random);
    add_covariate(o, "tunnel_airspeed_m_s", 0, 0.4, random);
    return o;
  }
};

/// Field names are a contract; all numbers are finite.
void expect_contract(const Explanation& explanation);

}  // namespace tunnelrig::test
