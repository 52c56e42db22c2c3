// SPDX-License-Identifier: Apache-2.0
//
// @TITLE@
//
// Written by `export_surface --to cpp`. The maps of one limit surface, for C++17: no dependency, no
// allocation, no exception. Wrenches are (fx, fy, tau_z) [N, N, N m], applied to the body; twists
// are (vx, vy, omega_z) [m/s, m/s, rad/s]; both about the reference point of the model, in its
// frame. The scalar may be double, float or a type of automatic differentiation that has sqrt,
// exp, log, the comparisons and, found by argument lookup, value_of(x), a double.
//
//     using namespace @NAMESPACE@;
//     Vector<double> twist;
//     if (twist_of_wrench(Vector<double>{1.0, 0.2, 0.03}, twist) == Status::ok) { ... }

#ifndef @GUARD@
#define @GUARD@

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace @NAMESPACE@ {

template <class T>
using Vector = std::array<T, 3>;
template <class T>
using Matrix = std::array<std::array<T, 3>, 3>;

// Where a map writes its Jacobian; a null pointer asks for none.
template <class T>
struct JacobianOf {
    using Pointer = Matrix<T>*;
};

// What a map says beside its answer; an answer is written only if it is ok.
enum class Status { ok, zero_vector, not_finite, no_convergence };

// A point where one term of a sum of norms is at rest: the cone of its normals, and the term there.
struct Corner {
    Vector<double> point, first, second;
    std::array<double, 2> centre;
    std::array<double, 3> curvature;
    double rest;
};

// The model. Its gauge is the load factor of scaled loads, or the dissipation of scaled twists.
namespace model {
@DATA@
}  // namespace model

namespace detail {

inline double value_of(double x) noexcept { return x; }
inline double value_of(float x) noexcept { return static_cast<double>(x); }

template <class T>
double number(const T& x) noexcept {
    return static_cast<double>(value_of(x));
}

template <class T>
T dot(const Vector<T>& a, const Vector<T>& b) noexcept {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class T>
Vector<T> scaled(const Vector<T>& a, const T& factor) noexcept {
    return {a[0] * factor, a[1] * factor, a[2] * factor};
}

template <class T>
Vector<T> times(const Matrix<T>& a, const Vector<T>& x) noexcept {
    return {dot(a[0], x), dot(a[1], x), dot(a[2], x)};
}

// A gauge at a point, with its derivatives there. What is at a kink adds nothing to them.
template <class T>
struct Local {
    T value{};
    Vector<T> gradient{};
    Matrix<T> hessian{};
};

// Relative size of a term below which it is at its kink, and of a form below which it is rounding.
constexpr double kKink = 1e-14;
constexpr double kNull = 1e-28;

template <class T>
Vector<T> image(std::size_t term, const Vector<T>& x) noexcept {
    Vector<T> y{};
    for (std::size_t row = 0; row < 3; ++row) {
        const auto& r = model::roots[term][row];
        y[row] = r[0] * x[0] + r[1] * x[1] + r[2] * x[2];
    }
    return y;
}

template <class T>
Vector<T> pull(std::size_t term, const Vector<T>& y) noexcept {
    const auto& r = model::roots[term];
    Vector<T> p{};
    for (std::size_t i = 0; i < 3; ++i) {
        p[i] = r[0][i] * y[0] + r[1][i] * y[1] + r[2][i] * y[2];
    }
    return p;
}

// Sum of norms |R_k x|, each smoothed to sqrt(|R_k x|^2 + s^2 |R_k|^2 |x|^2).
template <class T>
Local<T> norms(const Vector<T>& x, double smoothing, bool second) noexcept {
    using std::sqrt;
    Local<T> sum;
    const T square = dot(x, x);
    for (std::size_t k = 0; k < model::terms; ++k) {
        const Vector<T> y = image(k, x);
        const double round = smoothing * smoothing * model::sizes[k];
        const T form = dot(y, y) + round * square;
        const T norm = sqrt(form);
        sum.value += norm;
        if (number(form) <= kKink * kKink * model::sizes[k] * number(square)) {
            continue;
        }
        const T inverse = 1.0 / norm;
        Vector<T> p = pull(k, y);
        for (std::size_t i = 0; i < 3; ++i) {
            p[i] = (p[i] + round * x[i]) * inverse;
            sum.gradient[i] += p[i];
        }
        if (!second) {
            continue;
        }
        if (smoothing > 0.0) {
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = 0; j < 3; ++j) {
                    T a = model::forms[k][i][j] - p[i] * p[j];
                    if (i == j) {
                        a += round;
                    }
                    sum.hessian[i][j] += a * inverse;
                }
            }
            continue;
        }
        // R'(1 - u u')R with u = y / |y| keeps its digits where the norm is small.
        Matrix<T> z{};
        for (std::size_t row = 0; row < 3; ++row) {
            const T u = y[row] * inverse;
            for (std::size_t i = 0; i < 3; ++i) {
                z[row][i] = model::roots[k][row][i] - u * p[i];
            }
        }
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = i; j < 3; ++j) {
                const T a = (z[0][i] * z[0][j] + z[1][i] * z[1][j] + z[2][i] * z[2][j]) * inverse;
                sum.hessian[i][j] += a;
                if (j != i) {
                    sum.hessian[j][i] += a;
                }
            }
        }
    }
    return sum;
}

// Gauge g of a sum of powers, sum_i (q_i / g^2)^p_i = 1, by Newton's method for t = -log g.
template <class T>
Local<T> powers(const Vector<T>& x, double smoothing, bool second) noexcept {
    using std::exp;
    using std::log;
    using std::sqrt;
    std::array<T, model::terms> forms{};
    std::array<bool, model::terms> seen{};
    std::array<Vector<T>, model::terms> pulls{};
    const T square = dot(x, x);
    double first = 0.0;
    for (std::size_t k = 0; k < model::terms; ++k) {
        const Vector<T> y = image(k, x);
        const double round = smoothing * smoothing * model::sizes[k];
        forms[k] = dot(y, y) + round * square;
        seen[k] = number(forms[k]) > kNull * model::sizes[k] * number(square);
        if (!seen[k]) {
            continue;
        }
        first += std::sqrt(number(forms[k]));
        pulls[k] = pull(k, y);
        for (std::size_t i = 0; i < 3; ++i) {
            pulls[k][i] += round * x[i];
        }
    }
    // In doubles first; one more step with the scalar's own type carries its derivatives.
    std::array<double, model::terms> logs{};
    for (std::size_t k = 0; k < model::terms; ++k) {
        logs[k] = seen[k] ? std::log(number(forms[k])) : 0.0;
    }
    double t = -std::log(first);
    for (int step = 0; step < 60; ++step) {
        double value = 0.0, rise = 0.0;
        for (std::size_t k = 0; k < model::terms; ++k) {
            if (seen[k]) {
                const double p = model::exponents[k];
                const double part = std::exp(p * (logs[k] + 2.0 * t));
                value += part;
                rise += 2.0 * p * part;
            }
        }
        const double move = std::log(value) * value / rise;
        t -= move;
        if (std::fabs(move) < 1e-9) {
            break;
        }
    }
    T value{}, rise{};
    for (std::size_t k = 0; k < model::terms; ++k) {
        if (seen[k]) {
            const double p = model::exponents[k];
            const T part = exp(p * (log(forms[k]) + 2.0 * t));
            value += part;
            rise += 2.0 * p * part;
        }
    }
    const T tt = t - log(value) * value / rise;
    T total{}, weighted{};
    std::array<T, model::terms> weights{};
    Vector<T> slope{}, mixed{};
    for (std::size_t k = 0; k < model::terms; ++k) {
        if (!seen[k]) {
            continue;
        }
        const double p2 = 2.0 * model::exponents[k];
        const T share = p2 * exp(model::exponents[k] * (log(forms[k]) + 2.0 * tt));
        weights[k] = share / forms[k];
        total += share;
        weighted += p2 * share;
        for (std::size_t i = 0; i < 3; ++i) {
            slope[i] += weights[k] * pulls[k][i];
            mixed[i] += p2 * weights[k] * pulls[k][i];
        }
    }
    Local<T> found;
    found.value = exp(-tt);
    Vector<T> relative{};
    for (std::size_t i = 0; i < 3; ++i) {
        relative[i] = slope[i] / total;
        found.gradient[i] = found.value * relative[i];
    }
    if (!second) {
        return found;
    }
    for (std::size_t k = 0; k < model::terms; ++k) {
        if (!seen[k]) {
            continue;
        }
        const T curvature = (2.0 * model::exponents[k] - 2.0) / forms[k];
        const double round = smoothing * smoothing * model::sizes[k];
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                T a = model::forms[k][i][j] + curvature * pulls[k][i] * pulls[k][j];
                if (i == j) {
                    a += round;
                }
                found.hessian[i][j] += weights[k] * a;
            }
        }
    }
    const T both = weighted / total + 1.0;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const T cross = mixed[i] * relative[j] + mixed[j] * relative[i];
            const T a = (found.hessian[i][j] - cross) / total + both * relative[i] * relative[j];
            found.hessian[i][j] = found.value * a;
        }
    }
    return found;
}

// Fourth root of a homogeneous polynomial P of degree four; by Euler, grad P = Hess P x / 3.
template <class T>
Local<T> quartic(const Vector<T>& v, bool second) noexcept {
    using std::sqrt;
    const auto& c = model::coefficients;
    const T &x = v[0], &y = v[1], &m = v[2];
    const T xx = x * x, xy = x * y, xm = x * m, yy = y * y, ym = y * m, mm = m * m;
    Matrix<T> h{};
    h[0][0] = 12.0 * c[0] * xx + 6.0 * c[1] * xy + 6.0 * c[2] * xm + 2.0 * c[3] * yy +
              2.0 * c[4] * ym + 2.0 * c[5] * mm;
    h[0][1] = 3.0 * c[1] * xx + 4.0 * c[3] * xy + 2.0 * c[4] * xm + 3.0 * c[6] * yy +
              2.0 * c[7] * ym + c[8] * mm;
    h[0][2] = 3.0 * c[2] * xx + 2.0 * c[4] * xy + 4.0 * c[5] * xm + c[7] * yy + 2.0 * c[8] * ym +
              3.0 * c[9] * mm;
    h[1][1] = 2.0 * c[3] * xx + 6.0 * c[6] * xy + 2.0 * c[7] * xm + 12.0 * c[10] * yy +
              6.0 * c[11] * ym + 2.0 * c[12] * mm;
    h[1][2] = c[4] * xx + 2.0 * c[7] * xy + 2.0 * c[8] * xm + 3.0 * c[11] * yy +
              4.0 * c[12] * ym + 3.0 * c[13] * mm;
    h[2][2] = 2.0 * c[5] * xx + 2.0 * c[8] * xy + 6.0 * c[9] * xm + 2.0 * c[12] * yy +
              6.0 * c[13] * ym + 12.0 * c[14] * mm;
    h[1][0] = h[0][1];
    h[2][0] = h[0][2];
    h[2][1] = h[1][2];
    const Vector<T> g = scaled(times(h, v), T(1.0 / 3.0));
    const T p = dot(g, v) * 0.25;
    Local<T> found;
    found.value = sqrt(sqrt(p));
    const T factor = 0.25 * found.value / p;
    found.gradient = scaled(g, factor);
    if (second) {
        const T less = 0.75 / p;
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                found.hessian[i][j] = factor * (h[i][j] - less * g[i] * g[j]);
            }
        }
    }
    return found;
}

template <class T>
Local<T> gauge(const Vector<T>& x, double smoothing, bool second) noexcept {
    if constexpr (model::family == 0) {
        return norms(x, smoothing, second);
    } else if constexpr (model::family == 1) {
        return powers(x, smoothing, second);
    } else {
        return quartic(x, second);
    }
}

// Solve K d = r for K symmetric and positive definite, by K = L D L'.
template <class T>
Vector<T> solve(const Matrix<T>& k, const Vector<T>& r) noexcept {
    const T b = k[0][1] / k[0][0], c = k[0][2] / k[0][0];
    const double least = 1e-16 * (number(k[0][0]) + number(k[1][1]) + number(k[2][2]));
    T middle = k[1][1] - b * k[0][1];
    if (!(number(middle) > least)) {
        middle = T(least);
    }
    const T across = k[1][2] - b * k[0][2];
    const T e = across / middle;
    T last = k[2][2] - c * k[0][2] - e * across;
    if (!(number(last) > least)) {
        last = T(least);
    }
    const T y = r[1] - b * r[0];
    const T z = (r[2] - c * r[0] - e * y) / last;
    const T q = y / middle - e * z;
    return {r[0] / k[0][0] - b * q - c * z, q, z};
}

// Jacobian of x -> g(x) grad g(x), the gradient of g^2 / 2.
template <class T>
Matrix<T> conjugate(const Local<T>& at) noexcept {
    Matrix<T> k{};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            k[i][j] = at.gradient[i] * at.gradient[j] + at.value * at.hessian[i][j];
        }
    }
    return k;
}

// Minimise g(x)^2 / 2 - n.x by Newton's method with Armijo's rule; n of size about one.
inline bool descend(const Vector<double>& n, double smoothing, Vector<double>& x) noexcept {
    Local<double> at = gauge(x, smoothing, true);
    const double along = dot(n, x);
    if (!(along > 0.0) || !(at.value > 0.0)) {
        return false;
    }
    // The best point on the ray.
    const double best = along / (at.value * at.value);
    x = scaled(x, best);
    at.value *= best;
    for (auto& row : at.hessian) {
        row = scaled(row, 1.0 / best);
    }
    double height = 0.5 * at.value * at.value - dot(n, x);
    const double size = std::sqrt(dot(n, n));
    for (int step = 0; step < 40; ++step) {
        Vector<double> rest{};
        for (std::size_t i = 0; i < 3; ++i) {
            rest[i] = n[i] - at.value * at.gradient[i];
        }
        const double residual = std::sqrt(dot(rest, rest));
        const Vector<double> move = solve(conjugate(at), rest);
        const double slope = dot(rest, move);
        const double length = std::sqrt(dot(move, move) / dot(x, x));
        if (!(length < 1e100)) {
            return false;
        }
        if (length <= 1e-13 && residual > 1e-5 * size) {
            return false;  // A kink drew the steps in.
        }
        if ((length <= 1e-9 && residual <= 1e-5 * size) || residual <= 1e-15 * size) {
            for (std::size_t i = 0; i < 3; ++i) {
                x[i] += move[i];
            }
            return true;
        }
        // Far from the reference point the products cancel: rounding is a part of what they sum.
        const double noise = 1e-15 * size * std::sqrt(dot(x, x));
        double part = 1.0;
        bool fell = false;
        for (int halving = 0; halving < 30; ++halving) {
            Vector<double> trial{};
            for (std::size_t i = 0; i < 3; ++i) {
                trial[i] = x[i] + part * move[i];
            }
            Local<double> there = gauge(trial, smoothing, true);
            const double lower = 0.5 * there.value * there.value - dot(n, trial);
            if (lower <= height - 1e-4 * part * slope + noise) {
                x = trial;
                at = there;
                height = lower;
                fell = true;
                break;
            }
            part *= 0.5;
        }
        if (!fell) {
            return residual <= 1e-9 * size;
        }
    }
    return false;
}

// The point of the surface g(x) = 1 with the largest n.x, and whether it is a corner.
inline bool support(const Vector<double>& n, Vector<double>& x, bool& corner) noexcept {
    corner = false;
    Vector<double> start{};
    double most = 0.0;
    for (const auto& each : model::starts) {
        const double power = dot(each, n);
        if (std::fabs(power) > most) {
            most = std::fabs(power);
            start = scaled(each, power > 0.0 ? 1.0 : -1.0);
        }
    }
    if constexpr (model::corner_count > 0) {
        std::size_t which = 0;
        double nearest = std::numeric_limits<double>::infinity();
        Vector<double> at{};
        for (std::size_t k = 0; k < model::corner_count; ++k) {
            const auto& each = model::corners[k];
            double power = dot(each.point, n);
            if (std::fabs(power) < 1e-60) {
                power = 1e-60;
            }
            const double q0 = dot(each.first, n) / power - each.centre[0];
            const double q1 = dot(each.second, n) / power - each.centre[1];
            const double square = q0 * q0 + q1 * q1;
            if (square < nearest) {
                nearest = square;
                which = k;
                at = {q0, q1, power};
            }
        }
        const auto& each = model::corners[which];
        const double sign = at[2] > 0.0 ? 1.0 : -1.0;
        const double distance = std::sqrt(nearest);
        if (distance <= 1.0 + 1e-12 && each.rest == 0.0) {
            x = scaled(each.point, sign);
            corner = true;
            return true;
        }
        if (distance < 4.0) {
            double y0 = 0.0, y1 = 0.0;
            if (distance < 1.0) {
                // A term that is nearly of rank two leaves its kink by its third row.
                const double reach = each.rest / std::sqrt(std::fmax(1.0 - nearest, 1e-16));
                y0 = reach * at[0];
                y1 = reach * at[1];
            } else {
                const double curvature =
                    at[0] * (each.curvature[0] * at[0] + each.curvature[1] * at[1]) +
                    at[1] * (each.curvature[1] * at[0] + each.curvature[2] * at[1]) +
                    1e-3 * nearest;
                const double reach = (distance - 1.0) * distance / curvature + each.rest;
                y0 = reach * at[0];
                y1 = reach * at[1];
            }
            Vector<double> move{}, beside{};
            for (std::size_t i = 0; i < 3; ++i) {
                move[i] = each.first[i] * y0 + each.second[i] * y1;
            }
            const double back = 1.0 - dot(n, move) / at[2];
            for (std::size_t i = 0; i < 3; ++i) {
                beside[i] = sign * (back * each.point[i] + move[i]);
            }
            const double value = gauge(beside, 0.0, false).value;
            if (dot(beside, n) > most * value) {
                start = beside;
            }
        }
    }
    x = start;
    bool found = descend(n, 0.0, x);
    if (!found) {
        // Follow the minimum while the kinks sharpen, along a path that is straight in the end.
        Vector<double> path = start, before = start;
        double smoothing = 0.3;
        for (int round = 0; round < 22; ++round) {
            Vector<double> next{};
            for (std::size_t i = 0; i < 3; ++i) {
                next[i] = path[i] + (round > 1 ? 0.2 * (path[i] - before[i]) : 0.0);
            }
            if (!descend(n, smoothing, next)) {
                next = path;
                if (!descend(n, smoothing, next)) {
                    break;
                }
            }
            before = path;
            path = next;
            smoothing *= 0.2;
            found = smoothing < 1e-13;
        }
        Vector<double> last = path;
        if (descend(n, 0.0, last)) {
            path = last;
            found = true;
        }
        x = path;
    }
    if (found) {
        x = scaled(x, 1.0 / gauge(x, 0.0, false).value);
    }
    return found;
}

// One step of Newton's method with the scalar's own type, which carries its derivatives.
template <class T>
bool support(const Vector<T>& n, Vector<T>& x, bool& corner) noexcept {
    Vector<double> plain{};
    if (!support(Vector<double>{number(n[0]), number(n[1]), number(n[2])}, plain, corner)) {
        return false;
    }
    const double value = dot(plain, Vector<double>{number(n[0]), number(n[1]), number(n[2])});
    Vector<T> y{T(plain[0]), T(plain[1]), T(plain[2])};
    if (!corner) {
        y = {T(value * plain[0]), T(value * plain[1]), T(value * plain[2])};
        const Local<T> at = gauge(y, 0.0, true);
        Vector<T> rest{};
        for (std::size_t i = 0; i < 3; ++i) {
            rest[i] = n[i] - at.value * at.gradient[i];
        }
        const Vector<T> move = solve(conjugate(at), rest);
        for (std::size_t i = 0; i < 3; ++i) {
            y[i] = y[i] + move[i];
        }
        const T size = gauge(y, 0.0, false).value;
        y = scaled(y, T(1.0) / size);
    }
    x = y;
    return true;
}

// Hessian of the support function max n.x over g(x) = 1, at n, whose support point is x:
// |x|^2 [m] H [m]' / (n.x e2(H)), m = grad g(x), H its Hessian there, [m] the cross product.
template <class T>
Matrix<T> support_hessian(const Vector<T>& n, const Vector<T>& x, bool corner) noexcept {
    Matrix<T> result{};
    if (corner) {
        return result;
    }
    const Local<T> at = gauge(x, 0.0, true);
    const auto& h = at.hessian;
    const auto& m = at.gradient;
    const T minors = h[0][0] * h[1][1] - h[0][1] * h[0][1] + h[0][0] * h[2][2] -
                     h[0][2] * h[0][2] + h[1][1] * h[2][2] - h[1][2] * h[1][2];
    const double trace = number(h[0][0]) + number(h[1][1]) + number(h[2][2]);
    if (!(number(minors) > 1e-28 * trace * trace)) {
        return result;
    }
    const T zero(0.0);
    const Matrix<T> cross{{{zero, -m[2], m[1]}, {m[2], zero, -m[0]}, {-m[1], m[0], zero}}};
    const T factor = dot(x, x) / (dot(n, x) * minors);
    for (std::size_t i = 0; i < 3; ++i) {
        const Vector<T> row = times(h, cross[i]);
        for (std::size_t j = 0; j < 3; ++j) {
            result[i][j] = factor * dot(row, cross[j]);
        }
    }
    return result;
}

// Bring a vector to scaled variables and to size one; say what is wrong with it.
template <class T>
Status prepare(const Vector<T>& vector, const Vector<double>& unit, Vector<T>& x,
               double& size) noexcept {
    size = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const double each = std::fabs(number(vector[i]));
        if (!(each <= std::numeric_limits<double>::max())) {
            return Status::not_finite;
        }
        size = std::fmax(size, each);
    }
    if (size == 0.0) {
        return Status::zero_vector;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        x[i] = (vector[i] / T(size)) / T(unit[i]);
    }
    // A unit far from one leaves another size than one.
    double second = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        second = std::fmax(second, std::fabs(number(x[i])));
    }
    for (std::size_t i = 0; i < 3; ++i) {
        x[i] = x[i] / T(second);
    }
    size *= second;
    return Status::ok;
}

// Derivative of y / |y| from that of y: (1 - u u') J / |y|.
template <class T>
Matrix<T> across(const Vector<T>& y, const Matrix<T>& jacobian) noexcept {
    using std::sqrt;
    const T length = sqrt(dot(y, y));
    Matrix<T> result{};
    for (std::size_t j = 0; j < 3; ++j) {
        T along{};
        for (std::size_t i = 0; i < 3; ++i) {
            along += y[i] * jacobian[i][j];
        }
        along = along / (length * length);
        for (std::size_t i = 0; i < 3; ++i) {
            result[i][j] = (jacobian[i][j] - y[i] * along) / length;
        }
    }
    return result;
}

template <class T>
void to_units(Matrix<T>& jacobian, const Vector<double>& out, const Vector<double>& in,
              double size) noexcept {
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            jacobian[i][j] = jacobian[i][j] * T(out[i]) / T(in[j]) / T(size);
        }
    }
}

}  // namespace detail

// How far out a wrench lies: below 1 the body sticks, from 1 on it slides; 0 for a zero wrench.
template <class T>
Status load_factor(const Vector<T>& wrench, T& factor) noexcept {
    Vector<T> x{};
    double size = 0.0;
    const Status status = detail::prepare(wrench, model::wrench_unit, x, size);
    if (status == Status::zero_vector) {
        factor = T(0.0);
        return Status::ok;
    }
    if (status != Status::ok) {
        return status;
    }
    if constexpr (model::gauge_of_loads) {
        factor = detail::gauge(x, 0.0, false).value * T(size);
    } else {
        Vector<T> motion{};
        bool corner = false;
        if (!detail::support(x, motion, corner)) {
            return Status::no_convergence;
        }
        factor = detail::dot(x, motion) * T(size);
    }
    return Status::ok;
}

// Direction of the incipient motion, with vx^2 + vy^2 + (rho omega)^2 = 1, and its derivative by
// the wrench [m/s/N, ...] if `jacobian` is not null.
template <class T>
Status twist_of_wrench(const Vector<T>& wrench, Vector<T>& twist,
                       typename JacobianOf<T>::Pointer jacobian = nullptr) noexcept {
    using std::sqrt;
    Vector<T> x{};
    double size = 0.0;
    const Status status = detail::prepare(wrench, model::wrench_unit, x, size);
    if (status != Status::ok) {
        return status;
    }
    Vector<T> y{};
    Matrix<T> derivative{};
    if constexpr (model::gauge_of_loads) {
        const auto at = detail::gauge(x, 0.0, jacobian != nullptr);
        y = at.gradient;
        derivative = at.hessian;
    } else {
        bool corner = false;
        if (!detail::support(x, y, corner)) {
            return Status::no_convergence;
        }
        if (jacobian != nullptr) {
            derivative = detail::support_hessian(x, y, corner);
        }
    }
    const T length = sqrt(detail::dot(y, y));
    for (std::size_t i = 0; i < 3; ++i) {
        twist[i] = y[i] / length * T(model::twist_unit[i]);
    }
    if (jacobian != nullptr) {
        *jacobian = detail::across(y, derivative);
        detail::to_units(*jacobian, model::twist_unit, model::wrench_unit, size);
    }
    return Status::ok;
}

@INVERSE_COMMENT@
template <class T>
Status wrench_of_twist(const Vector<T>& twist, Vector<T>& wrench,
                       typename JacobianOf<T>::Pointer jacobian = nullptr) noexcept {
    // Of the scalar, so that it is looked at only where somebody calls this map.
    static_assert(!model::gauge_of_loads || model::convex || sizeof(T) == 0,
                  "this surface is not certified convex: its wrench of a twist is not exported");
    Vector<T> x{};
    double size = 0.0;
    const Status status = detail::prepare(twist, model::twist_unit, x, size);
    if (status != Status::ok) {
        return status;
    }
    Vector<T> y{};
    Matrix<T> derivative{};
    if constexpr (model::gauge_of_loads) {
        bool corner = false;
        if (!detail::support(x, y, corner)) {
            return Status::no_convergence;
        }
        if (jacobian != nullptr) {
            derivative = detail::support_hessian(x, y, corner);
        }
    } else {
        const auto at = detail::gauge(x, 0.0, jacobian != nullptr);
        y = at.gradient;
        derivative = at.hessian;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        wrench[i] = y[i] * T(model::wrench_unit[i]);
    }
    if (jacobian != nullptr) {
        *jacobian = derivative;
        detail::to_units(*jacobian, model::wrench_unit, model::twist_unit, size);
    }
    return Status::ok;
}

// Derivative of the load factor by the wrench [1/N, 1/N, 1/(N m)].
template <class T>
Status load_factor_gradient(const Vector<T>& wrench, Vector<T>& gradient) noexcept {
    T factor{};
    Vector<T> twist{};
    const Status status = twist_of_wrench(wrench, twist);
    if (status != Status::ok) {
        return status;
    }
    const Status second = load_factor(wrench, factor);
    if (second != Status::ok) {
        return second;
    }
    gradient = detail::scaled(twist, T(factor / detail::dot(twist, wrench)));
    return Status::ok;
}

}  // namespace @NAMESPACE@

#endif  // @GUARD@
