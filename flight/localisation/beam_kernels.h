// The matcher's inner loops, compiled for several instruction sets and chosen at run time. Every form adds up
// in the same order, eight sums side by side and no fused products, so that all give the same bits on every
// machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tunnelrig {

constexpr std::size_t kLanes = 16;  // floats in a block

struct alignas(64) Lanes {
  float value[kLanes];
};

/// One float per beam, in whole blocks of kLanes.
class BeamArray {
 public:
  void resize(std::size_t beams) { blocks_.resize((beams + kLanes - 1) / kLanes); }
  float* data() { return blocks_.empty() ? nullptr : blocks_.front().value; }
  std::size_t padded() const { return blocks_.size() * kLanes; }

 private:
  std::vector<Lanes> blocks_;
};

/// Pointers to the arrays of a scan's beams, all of `padded` floats.
struct Beams {
  std::size_t count = 0;
  std::size_t padded = 0;
  float* cosine = nullptr;  // direction in the scan plane
  float* sine = nullptr;
  float* range = nullptr;    // m; 0 without a return
  float* along_y = nullptr;  // direction in the cross-section (not of unit length when pitched or yawed)
  float* along_z = nullptr;
  float* y = nullptr;  // end of the beam in the cross-section, from the LIDAR; far away without a return
  float* z = nullptr;
  /// The wall that a beam should meet, as normal / distance: its product with the direction is 1 / range. 0:
  /// none.
  float* wall_y = nullptr;
  float* wall_z = nullptr;
  float* inverse = nullptr;  // 1 / expected range; 0 where no wall is met
};

/// Scan plane to cross-section, row by row.
struct Projection {
  float yy = 1, yz = 0, zy = 0, zz = 1;
};

/// Normal equations of range residuals (measured − expected) for y, z, rotation in the scan plane, and
/// stretch of y; the first `unknowns` of them.
struct FitSums {
  float normal[4][4] = {};  // JᵀJ, lower triangle
  float gradient[4] = {};   // Jᵀe
  float square = 0;         // eᵀe
  float absolute = 0;       // Σ|e|
  float inliers = 0;        // beams within the gate
  float beyond = 0;         // beams that see through the expected wall
  float expected = 0;       // beams with a return and a wall to meet
};

/// What a fit rests on, along y and z: sums over the beams that count, n the unit normal of a beam's wall, d
/// the distance of its end from that wall.
struct Evidence {
  static constexpr std::size_t kNeighbours = 4;
  float facing_yy = 0, facing_yz = 0, facing_zz = 0;  // Σ n nᵀ, in beams
  float square_y = 0, square_z = 0;                   // Σ (n d)²
  float shared_y = 0, shared_z = 0;  // Σ (n d)(n d)' over pairs of up to kNeighbours beams apart
};

struct BeamKernels {
  const char* instruction_set;
  /// Copies ranges, those outside of (least, most) as 0. The number that are inside, or −1 where one is NaN.
  int (*load)(const float* range, const Beams& beams, float least, float most);
  void (*project)(const Beams& beams, const Projection& projection);
  /// cell = (y cos β + z sin β) / cell size + offset, clamped to 0 … last: (6.1), (6.4).
  void (*cells)(const Beams& beams, float y_per_cell, float z_per_cell, float offset, float last,
                std::int32_t* cell);
  /// Beams first … last − 1 may meet a wall; the nearest of all walls stays.
  void (*see)(const Beams& beams, std::size_t first, std::size_t last, float wall_y, float wall_z);
  /// Beams that meet their wall at more than `most_slope` = 1 / cos(incidence) do not count.
  void (*fit)(const Beams& beams, const Projection& projection, float gate, float most_slope, int unknowns,
              FitSums& sums);
  /// Beams count as in fit. Uses beams.y and beams.z as working memory.
  void (*weigh)(const Beams& beams, float gate, float most_slope, Evidence& evidence);
  /// out[i] = Σ weight[k] histogram[start[k] − i]: the correlation (6.9) with a reference of few cells.
  void (*correlate)(const std::uint16_t* histogram, const std::int32_t* start, const float* weight,
                    std::size_t cells, float* out, std::size_t size);
  /// out[i] = Σ tap[j] in[i + j]
  void (*smooth)(const float* in, const float* tap, std::size_t taps, float* out, std::size_t size);
  float (*maximum)(const float* in, std::size_t size);  // of values that are not negative; 0 of none
};

/// The fastest that this processor runs.
const BeamKernels& beam_kernels();

/// All that it runs, for tests: the portable one first.
std::vector<const BeamKernels*> all_beam_kernels();

}  // namespace tunnelrig
