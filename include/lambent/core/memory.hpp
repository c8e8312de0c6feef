#pragma once
#include <lambent/core/config.hpp>
#include <cstddef>
#include <new>
#include <vector>
#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace lambent {
inline namespace LAMBENT_ABI {

/// Asks the system for large pages where an array is worth some: data that rays reach in no order then misses the
/// processor's page table less often. Where the system has none, memory is what it would have been.
/// measured  2 MiB pages made bounces 2 % faster in a tree of 18 MB, and 7 % in one of 56 MB
template <class T>
struct LargePageAllocator {
    using value_type = T;
    static constexpr std::size_t page = std::size_t(2) << 20;

    LargePageAllocator() = default;
    template <class U> LargePageAllocator(const LargePageAllocator<U>&) {}

    T* allocate(std::size_t n) {
        // Vectors ask for no more than max_size() of them: the product does not overflow.
        void* const p = ::operator new(n * sizeof(T), alignment(n));
#if defined(__linux__) && defined(MADV_HUGEPAGE)
        if (large(n)) madvise(p, n * sizeof(T), MADV_HUGEPAGE); // advice: nothing depends on its being taken
#endif
        return static_cast<T*>(p);
    }
    void deallocate(T* p, std::size_t n) { ::operator delete(p, alignment(n)); }

    friend bool operator==(const LargePageAllocator&, const LargePageAllocator&) { return true; }

private:
    static bool large(std::size_t n) { return n * sizeof(T) >= page; }
    static std::align_val_t alignment(std::size_t n) {
        return std::align_val_t(large(n) ? page : alignof(T) > 64 ? alignof(T) : 64);
    }
};

/// LargePageAllocator for arrays that start with whatever the memory holds: nothing is written before it is wanted, so
/// that the threads that fill an array share the work of getting its pages.
template <class T>
struct ScratchAllocator : LargePageAllocator<T> {
    ScratchAllocator() = default;
    template <class U> ScratchAllocator(const ScratchAllocator<U>&) {}

    template <class U> void construct(U* p) { ::new (static_cast<void*>(p)) U; }
};

/// An array of numbers that are written before they are read; 64-byte aligned.
template <class T>
using ScratchArray = std::vector<T, ScratchAllocator<T>>;

/// An array for data that rays reach in no order; 64-byte aligned.
template <class T>
using LargeArray = std::vector<T, LargePageAllocator<T>>;

} // namespace LAMBENT_ABI
} // namespace lambent
