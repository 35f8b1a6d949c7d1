// The processes, on one machine or several, among which mpirun divides a series of flights.
#pragma once

#include <string>
#include <vector>

namespace tunnelrig {

/// This process among those that mpirun started. Where it did not, or where the suite was built without
/// OpenMPI (-DTUNNELRIG_MPI=ON), there is this one alone. One object, in the main thread.
class Processes {
 public:
  Processes();
  /// Waits for the others, unless an exception ends this process: mpirun then ends them all.
  ~Processes();  // NOLINT(performance-trivially-destructible): it is where there is OpenMPI
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  int rank() const { return rank_; }
  int count() const { return count_; }

  /// Every process's bytes, by rank, to all of them. All must call it, equally often.
  std::vector<std::string> exchange(const std::string& own) const;

 private:
  int rank_ = 0, count_ = 1;
};

}  // namespace tunnelrig
