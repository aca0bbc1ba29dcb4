#include "tests/support/allocation_guard.h"

#include <cstdlib>
#include <new>

namespace {

thread_local bool counting = false;
thread_local std::size_t count = 0;

void* allocate(std::size_t size) {
  if (counting) ++count;
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc{};
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }

namespace airworthy::test {

AllocationGuard::AllocationGuard() {
  count = 0;
  counting = true;
}
AllocationGuard::~AllocationGuard() { counting = false; }
std::size_t AllocationGuard::allocations() const { return count; }

}  // namespace airworthy::test
