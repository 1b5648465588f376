// For the tests under the thread sanitiser only. libgomp is not instrumented, so the sanitiser doesn't see that a parallel region
// begins after what came before it and ends before what comes behind it, and calls every shared variable a race. These wrappers
// (linked with --wrap) tell it about exactly that order, and about barriers; races within a region are still found.
#include <cstdint>

extern "C" {

void __tsan_acquire(void* address);
void __tsan_release(void* address);

using RegionBody = void (*)(void*);

void __real_GOMP_parallel(RegionBody body, void* data, unsigned threads, unsigned flags);
void __real_GOMP_barrier();
void __real_GOMP_loop_end();
}

namespace {

struct Region {
    RegionBody body;
    void* data;
    char begin;
    char end;
};

char barrier_order;

// Not instrumented itself: it reads the region before the order is known.
__attribute__((no_sanitize("thread"))) void ordered_body(void* argument) {
    auto* region = static_cast<Region*>(argument);
    __tsan_acquire(&region->begin);
    region->body(region->data);
    __tsan_release(&region->end);
}

}  // namespace

extern "C" {

__attribute__((no_sanitize("thread"))) void __wrap_GOMP_parallel(RegionBody body, void* data, unsigned threads, unsigned flags) {
    Region region{body, data, 0, 0};
    __tsan_release(&region.begin);
    __real_GOMP_parallel(&ordered_body, &region, threads, flags);
    __tsan_acquire(&region.end);
}

void __wrap_GOMP_barrier() {
    __tsan_release(&barrier_order);
    __real_GOMP_barrier();
    __tsan_acquire(&barrier_order);
}

void __wrap_GOMP_loop_end() {
    __tsan_release(&barrier_order);
    __real_GOMP_loop_end();
    __tsan_acquire(&barrier_order);
}
}
