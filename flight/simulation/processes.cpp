#include "flight/simulation/processes.h"

#ifdef TUNNELRIG_MPI
#include <cstdlib>
#include <exception>

#define OMPI_SKIP_MPICXX 1
#include <mpi.h>
#endif

namespace tunnelrig {

#ifdef TUNNELRIG_MPI

namespace {

/// As mpirun says to those that it starts. Without it nothing of MPI is touched: its start takes a tenth of a
/// second.
bool started_by_mpirun() { return std::getenv("OMPI_COMM_WORLD_SIZE") != nullptr; }

}  // namespace

Processes::Processes() {
  if (!started_by_mpirun()) return;
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &count_);
}

Processes::~Processes() {
  if (started_by_mpirun() && std::uncaught_exceptions() == 0) MPI_Finalize();
}

std::vector<std::string> Processes::exchange(const std::string& own) const {
  if (count_ == 1) return {own};
  const int size = static_cast<int>(own.size());
  std::vector<int> sizes(static_cast<std::size_t>(count_)), starts;
  MPI_Allgather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, MPI_COMM_WORLD);
  int total = 0;
  for (const int one : sizes) {
    starts.push_back(total);
    total += one;
  }
  std::string all(static_cast<std::size_t>(total), '\0');
  MPI_Allgatherv(own.data(), size, MPI_CHAR, all.data(), sizes.data(), starts.data(), MPI_CHAR,
                 MPI_COMM_WORLD);
  std::vector<std::string> result;
  for (std::size_t i = 0; i < sizes.size(); ++i)
    result.push_back(all.substr(static_cast<std::size_t>(starts[i]), static_cast<std::size_t>(sizes[i])));
  return result;
}

#else

Processes::Processes() = default;
Processes::~Processes() = default;
std::vector<std::string> Processes::exchange(const std::string& own) const { return {own}; }

#endif

}  // namespace tunnelrig
