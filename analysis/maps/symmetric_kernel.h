// How the tunnel's symmetry and the reference at OT are built into a kernel, for any stationary base kernel.
//
// A field g without symmetry gives f(x) = (g(x) ± g(Mx))/√2, M the mirror at ȳ = 0, which is even or odd; and
// f(x) − f(0), which is 0 at OT. Their covariances follow from that of g alone, so that whatever is fitted
// with them has the symmetry and the zero exactly, in floating point too, in its mean and in its uncertainty
// (Ginsbourger, Roustant and Durrande 2016, "On degeneracy and invariances of random fields paths").
#pragma once

#include "analysis/maps/field_data.h"

namespace tunnelrig {

/// Covariance of f(a) and f(b); `base(dy, dz)` is even in both and returns a number or an array of them.
template <typename Base>
auto mirrored(const Base& base, Parity parity, const TunnelPoint& a, const TunnelPoint& b) {
  using Value = decltype(base(0.0, 0.0));
  const Value direct = base(a.y_norm - b.y_norm, a.z_norm - b.z_norm);
  const Value across = base(a.y_norm + b.y_norm, a.z_norm - b.z_norm);
  return parity == Parity::kEven ? Value(direct + across) : Value(direct - across);
}

/// Covariance of f(a) − f(0) and f(b) − f(0). The brackets make it exactly 0 where a or b is OT; an odd field
/// is 0 there by itself.
template <typename Base>
auto anchored(const Base& base, Parity parity, const TunnelPoint& a, const TunnelPoint& b) {
  using Value = decltype(base(0.0, 0.0));
  if (parity == Parity::kOdd) return mirrored(base, parity, a, b);
  const TunnelPoint origin;
  const Value from_a = mirrored(base, parity, a, b) - mirrored(base, parity, origin, b);
  const Value from_origin = mirrored(base, parity, a, origin) - mirrored(base, parity, origin, origin);
  return Value(from_a - from_origin);
}

}  // namespace tunnelrig
