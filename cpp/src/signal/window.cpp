#include <sarfocus/signal/window.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::signal {
namespace {

// Half the cosine coefficients of the Taylor weighting.
std::vector<double> taylor_terms(int nbar, double sidelobe_level) {
    const double a = std::acosh(std::pow(10.0, sidelobe_level / 20.0)) / pi;
    const double stretch = static_cast<double>(nbar) * nbar / (a * a + (nbar - 0.5) * (nbar - 0.5));
    std::vector<double> out;
    for (int m = 1; m < nbar; ++m) {
        const double m2 = static_cast<double>(m) * m;
        double term = m % 2 == 1 ? 0.5 : -0.5;
        for (int i = 1; i < nbar; ++i) {
            term *= 1.0 - m2 / (stretch * (a * a + (i - 0.5) * (i - 0.5)));
            if (i != m) term /= 1.0 - m2 / (static_cast<double>(i) * i);
        }
        out.push_back(term);
    }
    return out;
}

// F_m of the weighting 1 + 2 sum F_m cos(2 pi m nu) over |nu| <= 1/2, without a scale.
std::vector<double> cosine_terms(const Window& window) {
    switch (window.kind) {
        case WindowKind::hann:
            return {0.5};
        case WindowKind::hamming:
            return {0.46 / (2.0 * 0.54)};
        case WindowKind::taylor:
            return taylor_terms(window.nbar, window.sidelobe_level);
        case WindowKind::rectangular:
        case WindowKind::kaiser:
            break;
    }
    return {};
}

double cosine_sum(const std::vector<double>& terms, double nu) {
    double sum = 1.0;
    for (std::size_t m = 0; m < terms.size(); ++m) sum += 2.0 * terms[m] * std::cos(two_pi * static_cast<double>(m + 1) * nu);
    return sum;
}

double sinc(double x) {
    return x == 0.0 ? 1.0 : std::sin(pi * x) / (pi * x);
}

}  // namespace

void Window::validate() const {
    if (nbar < 1) throw ValueError("nbar", "a whole number >= 1", std::to_string(nbar));
    require_positive(sidelobe_level, "sidelobe_level");
    if (!(std::isfinite(beta) && beta >= 0.0 && beta <= 700.0)) throw ValueError("beta", "a number from 0 to 700", number_text(beta));
}

std::vector<double> window_samples(const Window& window, std::ptrdiff_t n, WindowForm form) {
    window.validate();
    if (n < 1) throw ValueError("n", "a number of samples > 0", std::to_string(n));
    std::vector<double> out(static_cast<std::size_t>(n), 1.0);
    const std::ptrdiff_t length = form == WindowForm::periodic ? n + 1 : n;
    if (length == 1 || n == 1) return out;
    const std::vector<double> terms = cosine_terms(window);
    // The Taylor weighting spans the length of the window, the others put their edges on the first and last samples.
    const auto span = static_cast<double>(window.kind == WindowKind::taylor ? length : length - 1);
    for (std::ptrdiff_t i = 0; i < n; ++i) {
        const double nu = (static_cast<double>(i) - 0.5 * static_cast<double>(length - 1)) / span;
        out[static_cast<std::size_t>(i)] =
            window.kind == WindowKind::kaiser
                ? std::cyl_bessel_i(0.0, window.beta * std::sqrt(std::max(0.0, 1.0 - 4.0 * nu * nu))) / std::cyl_bessel_i(0.0, window.beta)
                : cosine_sum(terms, nu) / cosine_sum(terms, 0.0);
    }
    return out;
}

WindowResponse::WindowResponse(const Window& window) : kind_(window.kind), beta_(window.beta) {
    window.validate();
    terms_ = cosine_terms(window);
}

double WindowResponse::kaiser(double x) const {
    // sinh(sqrt(beta^2 - (pi x)^2)) / sqrt(beta^2 - (pi x)^2), over its value at zero; the exponentials scaled by exp(-beta).
    const auto shape = [this](double square) {
        const double root = std::sqrt(std::abs(square));
        if (root == 0.0) return std::exp(-beta_);
        if (square > 0.0 && root < 1.0) return std::exp(-beta_) * std::sinh(root) / root;
        return square > 0.0 ? (std::exp(root - beta_) - std::exp(-root - beta_)) / (2.0 * root) : std::exp(-beta_) * std::sin(root) / root;
    };
    return shape(beta_ * beta_ - pi * pi * x * x) / shape(beta_ * beta_);
}

double WindowResponse::operator()(double x) const {
    if (kind_ == WindowKind::kaiser) return kaiser(x);
    const double nearest = std::nearbyint(x);
    if (std::abs(x - nearest) < 1e-6) {
        double sum = sinc(x);
        for (std::size_t k = 0; k < terms_.size(); ++k) {
            const auto m = static_cast<double>(k + 1);
            sum += terms_[k] * (sinc(x - m) + sinc(x + m));
        }
        return sum;
    }
    double sum = 1.0 / x;
    double sign = -2.0;
    for (std::size_t k = 0; k < terms_.size(); ++k, sign = -sign) {
        const auto m = static_cast<double>(k + 1);
        sum += sign * terms_[k] * x / (x * x - m * m);
    }
    return std::sin(pi * x) / pi * sum;
}

}  // namespace sarfocus::signal
