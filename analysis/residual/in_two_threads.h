// Independent jobs on both cores.
#pragma once

#include <cstddef>
#include <thread>

namespace tunnelrig {

/// Every other one of `count` jobs in a thread of its own.
template <class Job>
void in_two_threads(std::size_t count, const Job& job) {
  const auto work = [&](std::size_t k) {
    for (; k < count; k += 2) job(k);
  };
  std::thread second(work, 1);
  work(0);
  second.join();
}

}  // namespace tunnelrig
