#include "flight/simulation/run_exchange.h"

#include <cstring>
#include <type_traits>

namespace tunnelrig {
namespace {

/// Calls `visit` with every number of a run; a member that is added to RunResult does not compile here until
/// it is named.
template <class Run, class Visit>
void each_number(Run& run, const Visit& visit) {
  auto& [rms_y, rms_z, largest_y, largest_z, estimator, nees, effort, saturated, clamped, contacts, matches,
         rejected, lost, touched] = run;
  const auto all = [&](auto&... numbers) { (visit(numbers), ...); };
  all(rms_y, rms_z, largest_y, largest_z, estimator, nees, effort, saturated, clamped, contacts, matches,
      rejected, lost);
}

class Packer {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto size = bytes_.size();
    bytes_.resize(size + sizeof value);
    std::memcpy(bytes_.data() + size, &value, sizeof value);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class Unpacker {
 public:
  explicit Unpacker(const std::string& bytes) : bytes_(bytes) {}
  template <class T>
  void get(T& value) {
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
  }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

}  // namespace

void exchange_runs(const Processes& processes, std::vector<RunResult>& runs,
                   std::array<AxisErrors, 2>& pooled) {
  const auto count = static_cast<std::size_t>(processes.count());
  if (count == 1) return;
  Packer own;
  own.put(pooled);
  for (std::size_t i = static_cast<std::size_t>(processes.rank()); i < runs.size(); i += count) {
    each_number(runs[i], [&](const auto& number) { own.put(number); });
    own.put(runs[i].touched.size());
    for (const ContactEvent& contact : runs[i].touched) own.put(contact);
  }
  const std::vector<std::string> parts = processes.exchange(own.bytes());
  pooled = {};
  for (std::size_t rank = 0; rank < count; ++rank) {
    Unpacker part(parts[rank]);
    std::array<AxisErrors, 2> its;
    part.get(its);
    for (std::size_t axis = 0; axis < its.size(); ++axis) pooled[axis].add(its[axis]);
    for (std::size_t i = rank; i < runs.size(); i += count) {
      each_number(runs[i], [&](auto& number) { part.get(number); });
      std::size_t contacts = 0;
      part.get(contacts);
      runs[i].touched.resize(contacts);
      for (ContactEvent& contact : runs[i].touched) part.get(contact);
    }
  }
}

}  // namespace tunnelrig
