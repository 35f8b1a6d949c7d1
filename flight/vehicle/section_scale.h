// Metres of the thesis's flight frame (origin at the middle of the lower edge) to normalised coordinates and
// back.
#pragma once

namespace tunnelrig {

/// ȳ = 2y/(w_t − w_q), z̄ = 2z/(h_t − h_q) (4.1, 4.2), about the middle of the cross-section's bounding box.
struct SectionScale {
  double centre_y_m = 0, centre_z_m = 0;
  double half_span_y_m = 1, half_span_z_m = 1;  // (w_t − w_q)/2, (h_t − h_q)/2

  double y_norm(double y_m) const { return (y_m - centre_y_m) / half_span_y_m; }
  double z_norm(double z_m) const { return (z_m - centre_z_m) / half_span_z_m; }
};

}  // namespace tunnelrig
