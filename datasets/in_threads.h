// One job that several threads share.
#pragma once

#include <functional>
#include <system_error>
#include <thread>
#include <vector>

namespace tunnelrig {

/// Calls `work` in this thread and beside it in others, `count` in all; returns when all of them have. Where
/// the system gives no more threads it is done with those that there are. `work` must not throw, and must
/// take its share from what is left, not from how many there are.
template <class Work>
void in_threads(int count, const Work& work) {
  std::vector<std::jthread> others;  // joined in any case
  try {
    for (int i = 1; i < count; ++i) others.emplace_back(std::cref(work));
  } catch (const std::system_error&) {  // fewer do as well
  }
  work();
}

}  // namespace tunnelrig
