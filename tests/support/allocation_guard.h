#pragma once

#include <cstddef>

namespace airworthy::test {

/// While one lives, allocations on this thread are counted. Link airworthy_allocation_guard.
class AllocationGuard {
 public:
  AllocationGuard();
  AllocationGuard(const AllocationGuard&) = delete;
  AllocationGuard& operator=(const AllocationGuard&) = delete;
  ~AllocationGuard();

  [[nodiscard]] std::size_t allocations() const;
};

}  // namespace airworthy::test
