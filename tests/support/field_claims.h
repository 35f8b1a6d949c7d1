#pragma once

#include <functional>

namespace tunnelrig::test {

/// Checks claims 1 to 8 of the thesis (Section 5.4) on a field: both functions take y_norm and z_norm and
/// give per cent. `slack` is how much a measured map may fall short where the claim is a comparison, in
/// percentage points.
void expect_thesis_claims(const std::function<double(double, double)>& delta_ct,
                          const std::function<double(double, double)>& uneven, double slack = 0);

}  // namespace tunnelrig::test
