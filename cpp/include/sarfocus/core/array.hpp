#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <type_traits>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/memory.hpp>

namespace sarfocus {

/// Row-major contiguous N-dimensional array with aligned memory; moves, and copies only by `copy()`.
template <class T, std::size_t N>
class Array {
public:
    using index_type = std::ptrdiff_t;
    using extents_type = std::array<index_type, N>;

    Array() = default;

    /// Zero-initialised. Throws std::bad_alloc.
    explicit Array(const extents_type& extents) : extents_(extents) {
        const std::size_t bytes = static_cast<std::size_t>(size()) * sizeof(T);
        if (bytes == 0) return;
        data_ = std::unique_ptr<T[], Free>(static_cast<T*>(detail::allocate_zeros(bytes)), Free{bytes});
    }

    [[nodiscard]] T* data() { return data_.get(); }
    [[nodiscard]] const T* data() const { return data_.get(); }
    [[nodiscard]] const extents_type& extents() const { return extents_; }
    [[nodiscard]] index_type extent(std::size_t d) const { return extents_[d]; }
    [[nodiscard]] index_type size() const {
        index_type n = 1;
        for (const index_type e : extents_) n *= e;
        return n;
    }
    [[nodiscard]] bool empty() const { return data_ == nullptr; }

    [[nodiscard]] ArrayView<T, N> view() { return {data_.get(), extents_}; }
    [[nodiscard]] ArrayView<const T, N> view() const { return {data_.get(), extents_}; }

    template <class... Index>
    [[nodiscard]] T& operator()(Index... index) {
        return view()(index...);
    }
    template <class... Index>
    [[nodiscard]] const T& operator()(Index... index) const {
        return view()(index...);
    }

    [[nodiscard]] T* begin() { return data_.get(); }
    [[nodiscard]] T* end() { return data_.get() + (data_ ? size() : 0); }
    [[nodiscard]] const T* begin() const { return data_.get(); }
    [[nodiscard]] const T* end() const { return data_.get() + (data_ ? size() : 0); }

    [[nodiscard]] Array copy() const {
        Array out(extents_);
        for (index_type i = 0; i < (data_ ? size() : 0); ++i) out.data_[i] = data_[i];
        return out;
    }

private:
    struct Free {
        std::size_t bytes = 0;
        void operator()(T* p) const { detail::release(p, bytes); }
    };
    static_assert(std::is_arithmetic_v<T> || std::is_same_v<T, cfloat> || std::is_same_v<T, cdouble>, "zero bytes must be zeros");

    std::unique_ptr<T[], Free> data_;
    extents_type extents_{};
};

}  // namespace sarfocus
