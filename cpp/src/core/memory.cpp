#include <sarfocus/core/memory.hpp>

#include <cstring>
#include <new>

#if defined(__unix__) || defined(__APPLE__)
#include <sys/mman.h>
#endif

namespace sarfocus::detail {
namespace {

// The sanitisers watch what comes from operator new alone.
#if (defined(__unix__) || defined(__APPLE__)) && !defined(__SANITIZE_ADDRESS__)
constexpr std::size_t least_pages = std::size_t{1} << 20U;

void* map_pages(std::size_t bytes) {
    void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    return memory;
}

void unmap_pages(void* memory, std::size_t bytes) noexcept {
    (void)::munmap(memory, bytes);
}
#else
constexpr std::size_t least_pages = static_cast<std::size_t>(-1);

void* map_pages(std::size_t /*bytes*/) {
    throw std::bad_alloc();
}

void unmap_pages(void* /*memory*/, std::size_t /*bytes*/) noexcept {}
#endif

}  // namespace

void* allocate_zeros(std::size_t bytes) {
    if (bytes >= least_pages) return map_pages(bytes);
    void* memory = ::operator new(bytes, std::align_val_t{memory_alignment});
    return std::memset(memory, 0, bytes);
}

void release(void* memory, std::size_t bytes) noexcept {
    if (bytes >= least_pages)
        unmap_pages(memory, bytes);
    else
        ::operator delete(memory, std::align_val_t{memory_alignment});
}

}  // namespace sarfocus::detail
