// Independent jobs on both cores.
#pragma once

#include <array>
#include <cstddef>
#include <exception>
#include <thread>

namespace tunnelrig {

/// Every other one of `count` jobs in a thread of its own. Throws what a job threw, when both are done.
template <class Job>
void in_two_threads(std::size_t count, const Job& job) {
  std::array<std::exception_ptr, 2> thrown;
  const auto work = [&](std::size_t first) {
    try {
      for (std::size_t k = first; k < count; k += 2) job(k);
    } catch (...) {
      thrown[first] = std::current_exception();
    }
  };
  std::thread second(work, 1);
  work(0);
  second.join();
  for (const std::exception_ptr& each : thrown)
    if (each) std::rethrow_exception(each);
}

}  // namespace tunnelrig
