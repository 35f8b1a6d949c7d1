#include "flight/localisation/beam_kernels.h"

#include <cstring>

#if defined(__x86_64__)
#define TUNNELRIG_X86 1
#endif

namespace tunnelrig {
namespace {

// Forced into the functions below, which are compiled for one instruction set each.
#define TUNNELRIG_BODY [[gnu::always_inline]] static inline

// What a processor holds in one register. Sums are kept eight side by side whatever the width.
struct Four {
  static constexpr std::size_t kWidth = 4;
  using Floats = float __attribute__((vector_size(16), may_alias));
  using Ints = std::int32_t __attribute__((vector_size(16), may_alias));
};
struct Eight {
  static constexpr std::size_t kWidth = 8;
  using Floats = float __attribute__((vector_size(32), may_alias));
  using Ints = std::int32_t __attribute__((vector_size(32), may_alias));
};

constexpr std::size_t kSums = 8;
static_assert(Evidence::kNeighbours <= kSums);

constexpr float kFar_m = 1e7F;

template <typename Register>
struct Body {
  using Floats = typename Register::Floats;
  using Ints = typename Register::Ints;
  static constexpr std::size_t kWidth = Register::kWidth;
  static constexpr std::size_t kParts = kSums / kWidth;

  /// From and to any address.
  TUNNELRIG_BODY Floats get(const float* from) {
    Floats value;
    std::memcpy(&value, from, sizeof value);
    return value;
  }
  TUNNELRIG_BODY void put(float* to, Floats value) { std::memcpy(to, &value, sizeof value); }

  /// In an order that does not depend on the width.
  TUNNELRIG_BODY float total(const Floats* parts) {
    alignas(32) float value[kSums];
    for (std::size_t part = 0; part < kParts; ++part)
      *reinterpret_cast<Floats*>(value + part * kWidth) = parts[part];
    for (std::size_t half = kSums / 2; half > 0; half /= 2)
      for (std::size_t lane = 0; lane < half; ++lane) value[lane] += value[lane + half];
    return value[0];
  }

  TUNNELRIG_BODY int load(const float* range, const Beams& beams, float least, float most) {
    std::int32_t wrong = 0;
    std::int32_t returned = 0;
    for (std::size_t i = 0; i < beams.count; ++i) {
      const float value = range[i];
      const bool in = (value > least) & (value < most);
      wrong |= value != value ? 1 : 0;
      returned += in ? 1 : 0;
      beams.range[i] = in ? value : 0.0F;
    }
    return wrong != 0 ? -1 : returned;
  }

  TUNNELRIG_BODY void project(const Beams& beams, const Projection& p) {
    for (std::size_t i = 0; i < beams.padded; i += kWidth) {
      const Floats c = *reinterpret_cast<const Floats*>(beams.cosine + i);
      const Floats s = *reinterpret_cast<const Floats*>(beams.sine + i);
      const Floats range = *reinterpret_cast<const Floats*>(beams.range + i);
      const Floats y = p.yy * c + p.yz * s;
      const Floats z = p.zy * c + p.zz * s;
      const Ints returned = range > 0.0F;
      const Floats far = Floats{} + kFar_m;
      *reinterpret_cast<Floats*>(beams.along_y + i) = y;
      *reinterpret_cast<Floats*>(beams.along_z + i) = z;
      *reinterpret_cast<Floats*>(beams.y + i) = returned ? range * y : far;
      *reinterpret_cast<Floats*>(beams.z + i) = returned ? range * z : far;
    }
  }

  TUNNELRIG_BODY void cells(const Beams& beams, float y_per_cell, float z_per_cell, float offset, float last,
                            std::int32_t* cell) {
    for (std::size_t i = 0; i < beams.padded; ++i) {
      float at = y_per_cell * beams.y[i] + z_per_cell * beams.z[i] + offset;
      at = at < 0.0F ? 0.0F : at;
      at = at > last ? last : at;
      cell[i] = static_cast<std::int32_t>(at);
    }
  }

  TUNNELRIG_BODY void see(const Beams& beams, std::size_t first, std::size_t last, float wall_y,
                          float wall_z) {
    std::size_t i = first;
    for (; i + kWidth <= last; i += kWidth) {
      const Floats value = wall_y * get(beams.along_y + i) + wall_z * get(beams.along_z + i);
      const Floats before = get(beams.inverse + i);
      const Ints nearer = value > before;
      put(beams.inverse + i, nearer ? value : before);
      put(beams.wall_y + i, nearer ? Floats{} + wall_y : get(beams.wall_y + i));
      put(beams.wall_z + i, nearer ? Floats{} + wall_z : get(beams.wall_z + i));
    }
    for (; i < last; ++i) {
      const float value = wall_y * beams.along_y[i] + wall_z * beams.along_z[i];
      if (value <= beams.inverse[i]) continue;
      beams.inverse[i] = value;
      beams.wall_y[i] = wall_y;
      beams.wall_z[i] = wall_z;
    }
  }

  template <int unknowns>
  TUNNELRIG_BODY void fit(const Beams& beams, const Projection& p, float gate, float most_slope,
                          FitSums& sums) {
    Floats normal[unknowns * (unknowns + 1) / 2][kParts] = {};
    Floats gradient[unknowns][kParts] = {};
    Floats square[kParts] = {};
    Floats absolute[kParts] = {};
    Floats inliers[kParts] = {};
    Floats beyond[kParts] = {};
    Floats expected[kParts] = {};
    const Floats zero = {};
    const Floats one = zero + 1.0F;
    for (std::size_t i = 0, part = 0; i < beams.padded; i += kWidth, part = (part + 1) % kParts) {
      const Floats range = *reinterpret_cast<const Floats*>(beams.range + i);
      const Floats inverse = *reinterpret_cast<const Floats*>(beams.inverse + i);
      const Floats wall_y = *reinterpret_cast<const Floats*>(beams.wall_y + i);
      const Floats wall_z = *reinterpret_cast<const Floats*>(beams.wall_z + i);
      const Ints met = (range > 0.0F) & (inverse > 0.0F) &
                       (wall_y * wall_y + wall_z * wall_z < most_slope * most_slope * inverse * inverse);
      const Floats should = one / (met ? inverse : one);
      const Floats error = range - should;
      const Ints in = met & (error < gate) & (error > -gate);
      const Ints through = met & (error >= gate);
      expected[part] += met ? one : zero;
      inliers[part] += in ? one : zero;
      beyond[part] += through ? one : zero;
      const Floats e = in ? error : zero;
      Floats j[unknowns];
      // Moving by d towards a wall shortens the range by d·wall·range.
      const Floats scale = in ? -should : zero;
      j[0] = scale * wall_y;
      j[1] = scale * wall_z;
      if constexpr (unknowns >= 3) {
        const Floats c = *reinterpret_cast<const Floats*>(beams.cosine + i);
        const Floats s = *reinterpret_cast<const Floats*>(beams.sine + i);
        j[2] = scale * should * (wall_y * (p.yz * c - p.yy * s) + wall_z * (p.zz * c - p.zy * s));
      }
      if constexpr (unknowns >= 4)
        j[3] = scale * should * wall_y * *reinterpret_cast<const Floats*>(beams.along_y + i);
      square[part] += e * e;
      absolute[part] += e < zero ? -e : e;
      for (int a = 0, k = 0; a < unknowns; ++a) {
        gradient[a][part] += j[a] * e;
        for (int b = 0; b <= a; ++b, ++k) normal[k][part] += j[a] * j[b];
      }
    }
    sums.square = total(square);
    sums.absolute = total(absolute);
    sums.inliers = total(inliers);
    sums.beyond = total(beyond);
    sums.expected = total(expected);
    for (int a = 0, k = 0; a < unknowns; ++a) {
      sums.gradient[a] = total(gradient[a]);
      for (int b = 0; b <= a; ++b, ++k) sums.normal[a][b] = total(normal[k]);
    }
  }

  TUNNELRIG_BODY void fit(const Beams& beams, const Projection& p, float gate, float most_slope, int unknowns,
                          FitSums& sums) {
    if (unknowns == 2) return fit<2>(beams, p, gate, most_slope, sums);
    if (unknowns == 3) return fit<3>(beams, p, gate, most_slope, sums);
    fit<4>(beams, p, gate, most_slope, sums);
  }

  TUNNELRIG_BODY void weigh(const Beams& beams, float gate, float most_slope, Evidence& evidence) {
    Floats facing_yy[kParts] = {};
    Floats facing_yz[kParts] = {};
    Floats facing_zz[kParts] = {};
    Floats square_y[kParts] = {};
    Floats square_z[kParts] = {};
    const Floats zero = {};
    const Floats one = zero + 1.0F;
    for (std::size_t i = 0, part = 0; i < beams.padded; i += kWidth, part = (part + 1) % kParts) {
      const Floats range = *reinterpret_cast<const Floats*>(beams.range + i);
      const Floats inverse = *reinterpret_cast<const Floats*>(beams.inverse + i);
      const Floats wall_y = *reinterpret_cast<const Floats*>(beams.wall_y + i);
      const Floats wall_z = *reinterpret_cast<const Floats*>(beams.wall_z + i);
      const Floats wall_squared = wall_y * wall_y + wall_z * wall_z;
      const Ints met =
          (range > 0.0F) & (inverse > 0.0F) & (wall_squared < most_slope * most_slope * inverse * inverse);
      const Floats error = range - one / (met ? inverse : one);
      const Ints in = met & (error < gate) & (error > -gate);
      const Floats unit = (in ? one : zero) / (met ? wall_squared : one);
      facing_yy[part] += wall_y * wall_y * unit;
      facing_yz[part] += wall_y * wall_z * unit;
      facing_zz[part] += wall_z * wall_z * unit;
      const Floats distance = error * inverse * unit;  // over the length of the wall's vector
      const Floats y = wall_y * distance;
      const Floats z = wall_z * distance;
      square_y[part] += y * y;
      square_z[part] += z * z;
      *reinterpret_cast<Floats*>(beams.y + i) = y;
      *reinterpret_cast<Floats*>(beams.z + i) = z;
    }
    Floats shared_y[kParts] = {};
    Floats shared_z[kParts] = {};
    // The last few beams count as neighbours only.
    for (std::size_t i = 0, part = 0; i + kSums < beams.padded; i += kWidth, part = (part + 1) % kParts) {
      Floats y = {};
      Floats z = {};
      for (std::size_t apart = 1; apart <= Evidence::kNeighbours; ++apart) {
        y += get(beams.y + i + apart);
        z += get(beams.z + i + apart);
      }
      shared_y[part] += *reinterpret_cast<const Floats*>(beams.y + i) * y;
      shared_z[part] += *reinterpret_cast<const Floats*>(beams.z + i) * z;
    }
    evidence = {total(facing_yy), total(facing_yz), total(facing_zz), total(square_y),
                total(square_z),  total(shared_y),  total(shared_z)};
  }

  TUNNELRIG_BODY void correlate(const std::uint16_t* histogram, const std::int32_t* start,
                                const float* weight, std::size_t cells, float* __restrict out,
                                std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) out[i] = 0;
    for (std::size_t k = 0; k < cells; ++k) {
      // Walked backwards through the histogram, since a wall at Y is seen at Y − p from p.
      const std::uint16_t* from = histogram + start[k];
      for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(size); ++i)
        out[i] += weight[k] * static_cast<float>(from[-i]);
    }
  }

  TUNNELRIG_BODY void smooth(const float* in, const float* tap, std::size_t taps, float* __restrict out,
                             std::size_t size) {
    std::size_t i = 0;
    for (; i + kWidth <= size; i += kWidth) {
      Floats sum = {};
      for (std::size_t j = 0; j < taps; ++j) {
        sum += tap[j] * get(in + i + j);
      }
      put(out + i, sum);
    }
    for (; i < size; ++i) {
      out[i] = 0;
      for (std::size_t j = 0; j < taps; ++j) out[i] += tap[j] * in[i + j];
    }
  }

  TUNNELRIG_BODY float maximum(const float* in, std::size_t size) {
    Floats most = {};
    std::size_t i = 0;
    for (; i + kWidth <= size; i += kWidth) {
      const Floats value = get(in + i);
      most = value > most ? value : most;
    }
    float result = 0;
    for (; i < size; ++i) result = in[i] > result ? in[i] : result;
    for (std::size_t lane = 0; lane < kWidth; ++lane) result = most[lane] > result ? most[lane] : result;
    return result;
  }
};

// One struct of functions per instruction set, each with the bodies compiled for it. An attribute cannot
// stand in parentheses. NOLINTBEGIN(bugprone-macro-parentheses)
#define TUNNELRIG_FORM(form, width, target)                                                                  \
  struct form {                                                                                              \
    target static int load(const float* range, const Beams& beams, float least, float most) {                \
      return Body<width>::load(range, beams, least, most);                                                   \
    }                                                                                                        \
    target static void project(const Beams& beams, const Projection& p) { Body<width>::project(beams, p); }  \
    target static void cells(const Beams& beams, float y, float z, float offset, float last,                 \
                             std::int32_t* cell) {                                                           \
      Body<width>::cells(beams, y, z, offset, last, cell);                                                   \
    }                                                                                                        \
    target static void see(const Beams& beams, std::size_t first, std::size_t last, float y, float z) {      \
      Body<width>::see(beams, first, last, y, z);                                                            \
    }                                                                                                        \
    target static void fit(const Beams& beams, const Projection& p, float gate, float most_slope,            \
                           int unknowns, FitSums& sums) {                                                    \
      Body<width>::fit(beams, p, gate, most_slope, unknowns, sums);                                          \
    }                                                                                                        \
    target static void weigh(const Beams& beams, float gate, float most_slope, Evidence& evidence) {         \
      Body<width>::weigh(beams, gate, most_slope, evidence);                                                 \
    }                                                                                                        \
    target static void correlate(const std::uint16_t* histogram, const std::int32_t* start,                  \
                                 const float* weight, std::size_t cell_count, float* out,                    \
                                 std::size_t size) {                                                         \
      Body<width>::correlate(histogram, start, weight, cell_count, out, size);                               \
    }                                                                                                        \
    target static void smooth(const float* in, const float* tap, std::size_t taps, float* out,               \
                              std::size_t size) {                                                            \
      Body<width>::smooth(in, tap, taps, out, size);                                                         \
    }                                                                                                        \
    target static float maximum(const float* in, std::size_t size) {                                         \
      return Body<width>::maximum(in, size);                                                                 \
    }                                                                                                        \
    static const BeamKernels& kernels(const char* name) {                                                    \
      static const BeamKernels all{name, load, project, cells, see, fit, weigh, correlate, smooth, maximum}; \
      return all;                                                                                            \
    }                                                                                                        \
  };

// NOLINTEND(bugprone-macro-parentheses)

TUNNELRIG_FORM(Portable, Four, )
#if TUNNELRIG_X86
TUNNELRIG_FORM(Avx2, Eight, [[gnu::target("avx2")]])
TUNNELRIG_FORM(Avx512, Eight, [[gnu::target("avx512f,avx512bw,avx512dq,avx512vl")]])
#endif

}  // namespace

std::vector<const BeamKernels*> all_beam_kernels() {
  std::vector<const BeamKernels*> all{&Portable::kernels("portable")};
#if TUNNELRIG_X86
  if (__builtin_cpu_supports("avx2")) all.push_back(&Avx2::kernels("AVX2"));
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    all.push_back(&Avx512::kernels("AVX-512"));
#endif
  return all;
}

const BeamKernels& beam_kernels() {
  static const BeamKernels& fastest = *all_beam_kernels().back();
  return fastest;
}

}  // namespace tunnelrig
