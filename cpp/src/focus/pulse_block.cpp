#include "focus/pulse_block.hpp"

#include <utility>

#include <sarfocus/core/multiversion.hpp>

namespace sarfocus::focus::detail {
namespace {

SARFOCUS_MULTIVERSION void one_way(const double* x, const double* y, const double* z, double px, double py, double pz, std::ptrdiff_t n,
                                   double* range) {
#pragma omp simd
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double a = px - x[k], b = py - y[k], c = pz - z[k];
        range[k] = __builtin_sqrt(a * a + b * b + c * c);
    }
}

SARFOCUS_MULTIVERSION void both_ways(const double* x, const double* y, const double* z, double px, double py, double pz, std::ptrdiff_t n,
                                     double* range) {
#pragma omp simd
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double a = px - x[k], b = py - y[k], c = pz - z[k];
        range[k] = 0.5 * (range[k] + __builtin_sqrt(a * a + b * b + c * c));
    }
}

// Adds half the components of the unit vector from the antenna to the point along both axes.
SARFOCUS_MULTIVERSION void add_gradient(const double* x, const double* y, const double* z, const double* p, const double* u,
                                        const double* v, std::ptrdiff_t n, double* first, double* second) {
    const double px = p[0], py = p[1], pz = p[2], ux = u[0], uy = u[1], uz = u[2], vx = v[0], vy = v[1], vz = v[2];
#pragma omp simd
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double a = px - x[k], b = py - y[k], c = pz - z[k];
        const double half = 0.5 / __builtin_sqrt(a * a + b * b + c * c);
        first[k] += half * (a * ux + b * uy + c * uz);
        second[k] += half * (a * vx + b * vy + c * vz);
    }
}

// The same, differentiated along the track; the antenna moves at the rate (rx, ry, rz).
SARFOCUS_MULTIVERSION void add_gradient_rate(const double* x, const double* y, const double* z, const double* rx, const double* ry,
                                             const double* rz, const double* p, const double* u, const double* v, std::ptrdiff_t n,
                                             double* first, double* second) {
    const double px = p[0], py = p[1], pz = p[2], ux = u[0], uy = u[1], uz = u[2], vx = v[0], vy = v[1], vz = v[2];
#pragma omp simd
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double a = px - x[k], b = py - y[k], c = pz - z[k];
        const double inverse = 1.0 / __builtin_sqrt(a * a + b * b + c * c);
        const double s = (a * rx[k] + b * ry[k] + c * rz[k]) * inverse * inverse;
        first[k] += 0.5 * inverse * (s * (a * ux + b * uy + c * uz) - (rx[k] * ux + ry[k] * uy + rz[k] * uz));
        second[k] += 0.5 * inverse * (s * (a * vx + b * vy + c * vz) - (rx[k] * vx + ry[k] * vy + rz[k] * vz));
    }
}

}  // namespace

void ranges_to(const Vector3& p, const double* const tx[3], const double* const rx[3], std::ptrdiff_t n, double* range) {
    one_way(tx[0], tx[1], tx[2], p[0], p[1], p[2], n, range);
    if (rx != nullptr) both_ways(rx[0], rx[1], rx[2], p[0], p[1], p[2], n, range);
}

void PulseBlock::put(Coordinates& to, std::ptrdiff_t k, const Vector3& p) {
    to.x[k] = p[0];
    to.y[k] = p[1];
    to.z[k] = p[2];
}

void PulseBlock::set(std::ptrdiff_t k, const Antennas& pulse, const Antennas& place, const Antennas& rate) {
    put(tx_, k, pulse.tx);
    put(rx_, k, pulse.rx);
    put(track_tx_, k, place.tx);
    put(track_rx_, k, place.rx);
    put(rate_tx_, k, rate.tx);
    put(rate_rx_, k, rate.rx);
}

void PulseBlock::ranges(const Vector3& p, std::ptrdiff_t n, bool monostatic, double* range) const {
    one_way(tx_.x, tx_.y, tx_.z, p[0], p[1], p[2], n, range);
    if (!monostatic) both_ways(rx_.x, rx_.y, rx_.z, p[0], p[1], p[2], n, range);
}

void PulseBlock::match(const Vector3& p, const Vector3& first_axis, const Vector3& second_axis, std::ptrdiff_t n, double* shift,
                       double* scale) const {
    alignas(64) double pulse[2][capacity] = {};
    alignas(64) double track[2][capacity] = {};
    alignas(64) double rate[2][capacity] = {};
    for (const Coordinates* c : {&tx_, &rx_})
        add_gradient(c->x, c->y, c->z, p.data(), first_axis.data(), second_axis.data(), n, pulse[0], pulse[1]);
    for (const auto& [c, r] : {std::pair{&track_tx_, &rate_tx_}, std::pair{&track_rx_, &rate_rx_}}) {
        add_gradient(c->x, c->y, c->z, p.data(), first_axis.data(), second_axis.data(), n, track[0], track[1]);
        add_gradient_rate(c->x, c->y, c->z, r->x, r->y, r->z, p.data(), first_axis.data(), second_axis.data(), n, rate[0], rate[1]);
    }
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const double turn = pulse[0][k] * rate[1][k] - pulse[1][k] * rate[0][k];
        const double off = pulse[0][k] * track[1][k] - pulse[1][k] * track[0][k];
        shift[k] = turn != 0.0 ? -off / turn : 0.0;
        const double a = track[0][k] + shift[k] * rate[0][k];
        const double b = track[1][k] + shift[k] * rate[1][k];
        scale[k] = (pulse[0][k] * a + pulse[1][k] * b) / (a * a + b * b) - 1.0;
    }
}

}  // namespace sarfocus::focus::detail
