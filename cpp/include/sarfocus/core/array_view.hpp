#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <type_traits>

namespace sarfocus {

/// A view over N-dimensional memory that belongs to the caller: pointer, extents and signed strides in elements
/// (the shape of std::mdspan with layout_stride). Copying a view never copies data.
template <class T, std::size_t N>
class ArrayView {
public:
    using element_type = T;
    using value_type = std::remove_cv_t<T>;
    using index_type = std::ptrdiff_t;
    using extents_type = std::array<index_type, N>;

    constexpr ArrayView() = default;

    /// Row-major contiguous memory.
    constexpr ArrayView(T* data, const extents_type& extents) : data_(data), extents_(extents) {
        index_type stride = 1;
        for (std::size_t d = N; d-- > 0;) {
            strides_[d] = stride;
            stride *= extents_[d];
        }
    }

    constexpr ArrayView(T* data, const extents_type& extents, const extents_type& strides)
        : data_(data), extents_(extents), strides_(strides) {}

    /// A writable view may be read through; the other direction does not compile.
    template <class U>
        requires(std::is_same_v<const U, T> && !std::is_same_v<U, T>)
    constexpr ArrayView(const ArrayView<U, N>& other) : data_(other.data()), extents_(other.extents()), strides_(other.strides()) {}

    [[nodiscard]] constexpr T* data() const { return data_; }
    [[nodiscard]] constexpr const extents_type& extents() const { return extents_; }
    [[nodiscard]] constexpr const extents_type& strides() const { return strides_; }
    [[nodiscard]] constexpr index_type extent(std::size_t d) const { return extents_[d]; }
    [[nodiscard]] constexpr index_type stride(std::size_t d) const { return strides_[d]; }

    [[nodiscard]] constexpr index_type size() const {
        index_type n = 1;
        for (const index_type e : extents_) n *= e;
        return n;
    }
    [[nodiscard]] constexpr bool empty() const { return size() == 0; }

    /// True where the elements lie one behind the other, the last index fastest.
    [[nodiscard]] constexpr bool is_contiguous() const {
        index_type stride = 1;
        for (std::size_t d = N; d-- > 0;) {
            if (extents_[d] != 1 && strides_[d] != stride) return false;
            stride *= extents_[d];
        }
        return true;
    }

    template <class... Index>
        requires(sizeof...(Index) == N)
    [[nodiscard]] constexpr T& operator()(Index... index) const {
        const extents_type i{static_cast<index_type>(index)...};
        index_type offset = 0;
        for (std::size_t d = 0; d < N; ++d) offset += i[d] * strides_[d];
        return data_[offset];
    }

    /// The view with the first index fixed.
    [[nodiscard]] constexpr ArrayView<T, N - 1> row(index_type i) const
        requires(N >= 2)
    {
        std::array<index_type, N - 1> extents{};
        std::array<index_type, N - 1> strides{};
        for (std::size_t d = 1; d < N; ++d) {
            extents[d - 1] = extents_[d];
            strides[d - 1] = strides_[d];
        }
        return {data_ + i * strides_[0], extents, strides};
    }

    /// The view of one column of a matrix: the second index fixed.
    [[nodiscard]] constexpr ArrayView<T, 1> column(index_type j) const
        requires(N == 2)
    {
        return {data_ + j * strides_[1], {extents_[0]}, {strides_[0]}};
    }

    /// Sub-range [begin, begin + count) of one dimension.
    [[nodiscard]] constexpr ArrayView slice(std::size_t d, index_type begin, index_type count) const {
        ArrayView out = *this;
        out.data_ = data_ + begin * strides_[d];
        out.extents_[d] = count;
        return out;
    }

private:
    T* data_ = nullptr;
    extents_type extents_{};
    extents_type strides_{};
};

using cfloat = std::complex<float>;
using cdouble = std::complex<double>;

/// [n_azimuth, n_range] or [n_pulse, n_range] complex samples.
using ImageView = ArrayView<const cfloat, 2>;
using MutableImageView = ArrayView<cfloat, 2>;

}  // namespace sarfocus
