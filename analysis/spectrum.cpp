#include "analysis/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <string>

#include <fftw3.h>
#include <fmt/format.h>

namespace tunnelrig {
namespace {

constexpr std::size_t kWindow = 4096;
constexpr std::size_t kShortestWindow = 128;
constexpr std::size_t kMostLines = 12;
constexpr std::size_t kNoiseStep = 24;  // bins
constexpr double kShaftBand = 0.04, kBesideHum = 0.05;

/// FFTW's planner, which also destroys, is the one part of it that threads must not share.
std::mutex& planner() {
  static std::mutex mutex;
  return mutex;
}

/// Made once per length and thread. A thread's end destroys its plans.
struct Plan {
  explicit Plan(std::size_t window) : in(fftwf_alloc_real(window)), out(fftwf_alloc_complex(window / 2 + 1)) {
    const std::lock_guard lock(planner());
    plan = fftwf_plan_dft_r2c_1d(static_cast<int>(window), in, out, FFTW_ESTIMATE);
  }
  ~Plan() {
    {
      const std::lock_guard lock(planner());
      fftwf_destroy_plan(plan);
    }
    fftwf_free(in);
    fftwf_free(out);
  }
  Plan(const Plan&) = delete;
  Plan& operator=(const Plan&) = delete;

  float* in;
  fftwf_complex* out;
  fftwf_plan plan = nullptr;
};

Plan& plan_for(std::size_t window) {
  thread_local std::map<std::size_t, std::unique_ptr<Plan>> plans;
  std::unique_ptr<Plan>& plan = plans[window];
  if (!plan) plan = std::make_unique<Plan>(window);
  return *plan;
}

}  // namespace

std::size_t welch_window(std::size_t frames) {
  std::size_t window = kWindow;
  while (window > kShortestWindow && window * 2 > frames) window /= 2;
  return window * 2 > frames ? 0 : window;
}

WelchSpectrum::WelchSpectrum(std::size_t channels) : channels_(channels) {}

void WelchSpectrum::choose_window(std::size_t window) {
  window_ = window;
  taper_.resize(window);
  for (std::size_t i = 0; i < window; ++i) {
    const double phase = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(window);
    taper_[i] = static_cast<float>(0.5 - 0.5 * std::cos(phase));
  }
  power_.assign(channels_ * (window / 2 + 1), 0);
}

void WelchSpectrum::transform(std::size_t first_frame) {
  Plan& plan = plan_for(window_);
  const std::size_t bins = window_ / 2 + 1;
  for (std::size_t c = 0; c < channels_; ++c) {
    const float* from = waiting_.data() + first_frame * channels_ + c;
    for (std::size_t i = 0; i < window_; ++i) plan.in[i] = from[i * channels_] * taper_[i];
    fftwf_execute(plan.plan);
    double* sum = power_.data() + c * bins;
    for (std::size_t k = 0; k < bins; ++k) {
      sum[k] += static_cast<double>(plan.out[k][0] * plan.out[k][0] + plan.out[k][1] * plan.out[k][1]);
    }
  }
  ++segments_;
}

void WelchSpectrum::transform_waiting(bool all) {
  const std::size_t frames = waiting_.size() / channels_;
  if (window_ == 0) {
    if (!all && frames < 2 * kWindow) return;  // how long the run is will decide
    const std::size_t window = welch_window(frames);
    if (window == 0) return;
    choose_window(window);
  }
  std::size_t first = 0;
  for (; first + window_ <= frames; first += window_ / 2) transform(first);
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(first * channels_));
}

void WelchSpectrum::add(std::span<const float> frames) {
  waiting_.insert(waiting_.end(), frames.begin(), frames.end());
  if (waiting_.size() >= 2 * kWindow * channels_) transform_waiting(false);
}

void WelchSpectrum::interrupt() {
  transform_waiting(false);
  if (window_ != 0)
    waiting_.clear();  // a run that begins with gaps keeps what it has until a window is chosen
}

void WelchSpectrum::finish() {
  transform_waiting(true);
  waiting_.clear();
  // |X| of a sinusoid at a bin's middle is A · N/2 · 0.5 behind a Hann window
  const double scale =
      segments_ == 0 ? 0 : 16.0 / (static_cast<double>(window_ * window_) * static_cast<double>(segments_));
  for (double& value : power_) value *= scale;
}

std::span<const double> WelchSpectrum::power(std::size_t channel) const {
  const std::size_t bins = window_ == 0 ? 0 : window_ / 2 + 1;
  return std::span(power_).subspan(channel * bins, bins);
}

// --- lines

namespace {

/// The noise that lines stand in: medians of the power over 97 bins, one every 24 bins, so that a line or two
/// among them do not count.
std::vector<double> noise_floor(std::span<const double> power) {
  constexpr std::size_t kReach = 48;
  std::vector<double> floor;
  std::vector<double> around;
  for (std::size_t centre = 0; centre < power.size() + kNoiseStep / 2; centre += kNoiseStep) {
    const std::size_t from = centre > kReach ? centre - kReach : 1;
    const std::size_t to = std::min(centre + kReach + 1, power.size());
    around.assign(power.begin() + static_cast<std::ptrdiff_t>(std::min(from, to - 1)),
                  power.begin() + static_cast<std::ptrdiff_t>(to));
    const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
    std::nth_element(around.begin(), middle, around.end());
    floor.push_back(*middle);
  }
  return floor;
}

/// A mean of M periodograms exceeds this multiple of its median about once in a million bins.
double threshold(std::size_t segments) {
  const auto m = static_cast<double>(segments);
  return 1 + 5 / std::sqrt(m) + 14 / m;
}

/// Frequency and amplitude of the line at a local maximum: for a Hann window the ratio of the two highest
/// bins gives the offset δ = (2r − 1)/(r + 1), and the window's shape there the amplitude.
SpectralLine refine(std::span<const double> power, std::size_t bin, double bin_hz) {
  const bool right = power[bin + 1] > power[bin - 1];
  const double r = std::sqrt((right ? power[bin + 1] : power[bin - 1]) / power[bin]);
  const double offset = std::clamp((2 * r - 1) / (r + 1), 0.0, 0.5);
  const double x = std::numbers::pi * offset;
  const double shape = offset < 1e-6 ? 1.0 : std::sin(x) / x / (1 - offset * offset);
  return {.frequency_hz = (static_cast<double>(bin) + (right ? offset : -offset)) * bin_hz,
          .amplitude_V = std::sqrt(power[bin]) / shape,
          .prominence = 0,
          .name = ""};
}

std::vector<SpectralLine> peaks(const WelchSpectrum& spectrum, std::size_t channel, double bin_hz) {
  const auto power = spectrum.power(channel);
  const std::vector<double> floor = noise_floor(power);
  std::vector<SpectralLine> found;
  for (std::size_t k = 4; k + 1 < power.size(); ++k) {  // below bin 4 is turbulence and the mean
    if (power[k] < power[k - 1] || power[k] <= power[k + 1]) continue;
    const double noise = floor[(k + kNoiseStep / 2) / kNoiseStep];
    if (power[k] <= threshold(spectrum.segments()) * noise || noise <= 0) continue;
    SpectralLine line = refine(power, k, bin_hz);
    line.prominence = power[k] / noise;
    found.push_back(line);
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.amplitude_V > b.amplitude_V; });
  return found;
}

/// What a line may be, and how far it may be off: what follows from a multiple of the shaft's frequency is k
/// times as uncertain, and the grid is never quite at its frequency.
struct Origin {
  std::string name;
  double hz, sigma_hz;
  double rarity;         // −ln of how common it is beside the others
  bool of_shaft = true;  // a low multiple, which vibration is sure to have
};

std::vector<double> grids_hz(const std::optional<double>& mains_hz) {
  return mains_hz ? std::vector{*mains_hz} : std::vector<double>{50, 60};
}

std::vector<Origin> origins(double shaft_hz, double rate_hz, double bin_hz, const LineSources& sources) {
  constexpr int kLow = 8;
  constexpr double kGrid_Hz = 0.05;
  constexpr double kOvertone = 1, kAlias = 3, kHarmonic = 0.5;
  const double error_hz = kLineError_bins * bin_hz;
  std::vector<Origin> result;
  for (int k = 1; shaft_hz > 0 && k <= 16; ++k) {
    const bool alias = k * shaft_hz > rate_hz / 2;
    const std::string base = k == 1                ? "shaft"
                             : k == sources.blades ? "blade_pass"
                                                   : fmt::format("shaft_x{}", k);
    result.push_back({alias ? base + "_alias" : base, folded(k * shaft_hz, rate_hz),
                      std::hypot(1, k) * error_hz,
                      alias                           ? kAlias
                      : k == 1 || k == sources.blades ? 0
                                                      : kOvertone,
                      !alias && k <= kLow});
  }
  for (const double mains_hz : grids_hz(sources.mains_hz))
    for (int k = 1; k <= 5; ++k)
      result.push_back({fmt::format("mains_{:g}", k * mains_hz), folded(k * mains_hz, rate_hz),
                        std::hypot(error_hz, k * kGrid_Hz), k > 1 ? kHarmonic : 0, false});
  return result;
}

/// The likeliest origin within a bin and a half; empty: none is as near. Vibration has low multiples of the
/// shaft wherever it turns, so what one of them may be is no hum.
std::string name_of_line(double frequency_hz, const std::vector<Origin>& known, double tolerance_hz) {
  constexpr double kMayBe = 2;  // σ
  std::string name;
  double best = -std::numeric_limits<double>::infinity();
  bool may_be_shaft = false;
  for (const Origin& origin : known) {
    const double off_hz = frequency_hz - origin.hz;
    if (std::abs(off_hz) > tolerance_hz) continue;
    may_be_shaft |= origin.of_shaft && std::abs(off_hz) <= kMayBe * origin.sigma_hz;
    if (may_be_shaft && is_mains(origin.name)) break;  // they come last
    const double likely =
        -0.5 * std::pow(off_hz / origin.sigma_hz, 2) - std::log(origin.sigma_hz) - origin.rarity;
    if (likely <= best) continue;
    best = likely;
    name = origin.name;
  }
  return name;
}

}  // namespace

bool may_be_hum(double frequency_hz, double rate_hz, const std::optional<double>& mains_hz) {
  const double tolerance_hz = 1.5 * rate_hz / static_cast<double>(kWindow);
  return std::ranges::any_of(
      grids_hz(mains_hz), [&](double grid_hz) { return std::abs(frequency_hz - grid_hz) <= tolerance_hz; });
}

LineList find_lines(const WelchSpectrum& spectrum, std::size_t channel, double rate_hz,
                    const LineSources& sources) {
  LineList list;
  if (spectrum.segments() == 0) return list;
  const double bin_hz = rate_hz / static_cast<double>(spectrum.window());
  list.lines = peaks(spectrum, channel, bin_hz);
  const auto strongest_about = [&](double hz) {  // 0: none
    const SpectralLine* strongest = nullptr;
    for (const SpectralLine& line : list.lines) {
      if (std::abs(line.frequency_hz / hz - 1) > kShaftBand) continue;
      if (strongest == nullptr) strongest = &line;
      if (!may_be_hum(line.frequency_hz, rate_hz, sources.mains_hz) &&
          line.amplitude_V > kBesideHum * strongest->amplitude_V)
        return line.frequency_hz;
    }
    return strongest == nullptr ? 0 : strongest->frequency_hz;
  };
  list.shaft_hz = strongest_about(sources.shaft_hz);
  // A propeller that is balanced well has the line of its blades alone.
  const double shaft_hz =
      list.shaft_hz > 0 ? list.shaft_hz : strongest_about(sources.blades * sources.shaft_hz) / sources.blades;
  if (list.lines.size() > kMostLines) list.lines.resize(kMostLines);
  const std::vector<Origin> known = origins(shaft_hz, rate_hz, bin_hz, sources);
  for (SpectralLine& line : list.lines)
    line.name =
        line.frequency_hz == list.shaft_hz ? "shaft" : name_of_line(line.frequency_hz, known, 1.5 * bin_hz);
  return list;
}

std::optional<double> middle_shaft_hz(const RunStatistics& statistics) {
  std::vector<double> lines_hz;
  for (const ChannelStatistics& channel : statistics.channels)
    if (channel.shaft_hz) lines_hz.push_back(*channel.shaft_hz);
  if (lines_hz.empty()) return {};
  std::ranges::sort(lines_hz);
  return (lines_hz[(lines_hz.size() - 1) / 2] + lines_hz[lines_hz.size() / 2]) / 2;
}

}  // namespace tunnelrig
