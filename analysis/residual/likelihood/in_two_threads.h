// Independent jobs on both cores.
#pragma once

#include "datasets/in_threads.h"

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>

namespace tunnelrig {

/// Jobs 0 to `count` − 1, in whatever order. Throws what a job threw, when no other is under way any more.
template <class Job>
void in_two_threads(std::size_t count, const Job& job) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;  // guards thrown
  std::exception_ptr thrown;
  in_threads(2, [&] {
    try {
      for (std::size_t k = next++; k < count; k = next++) job(k);
    } catch (...) {
      const std::lock_guard lock(mutex);
      thrown = std::current_exception();
      next = count;
    }
  });
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace tunnelrig
