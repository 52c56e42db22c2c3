// SPDX-License-Identifier: Apache-2.0
/* The maps in closed form as plain loops: what compiled code could reach at best.
 *
 * The same formulas as limit_surface_ros.surface, one vector after the other. roots holds k
 * factors R_i (3 x 3, row by row) with A_i = R_i' R_i; in and out hold n rows of 3.
 */
#include <math.h>
#include <stddef.h>

enum { MOST_TERMS = 16, MOST_STEPS = 60, MOST_DEGREE = 4 };

static double image_of(const double *root, const double *load, double *image)
{
    double form = 0.0;
    for (int row = 0; row < 3; row++) {
        image[row] = root[3 * row] * load[0] + root[3 * row + 1] * load[1]
            + root[3 * row + 2] * load[2];
        form += image[row] * image[row];
    }
    return form;
}

static void add_pull(const double *root, const double *image, double weight, double *normal)
{
    for (int column = 0; column < 3; column++)
        normal[column] += weight * (root[column] * image[0] + root[3 + column] * image[1]
            + root[6 + column] * image[2]);
}

static void scale_load(const double *in, const double *unit, double *load)
{
    double size = fmax(fmax(fabs(in[0]), fabs(in[1])), fabs(in[2]));
    for (int column = 0; column < 3; column++)
        load[column] = in[column] / size / unit[column];
}

static void write_twist(const double *normal, const double *unit, double *out)
{
    double norm = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (int column = 0; column < 3; column++)
        out[column] = normal[column] / norm * unit[column];
}

static double part_of(double form, int degree)
{
    switch (degree) {
    case 1: return form;
    case 2: return sqrt(form);
    case 3: return cbrt(form);
    default: return sqrt(sqrt(form));
    }
}

static double whole_power(double number, int power)
{
    double result = 1.0;
    while (power-- > 0)
        result *= number;
    return result;
}

/* The root of w^n = sum_m c_m w^(n - m), from beyond it by Newton's method. */
static double root_of_equation(const double *sums, int degree, double most)
{
    if (degree == 1)
        return sums[0];
    double rest = sums[degree - 1];
    for (int power = degree - 1; power >= 2; power--)
        rest = sums[power - 1] + rest / most;
    double root = 0.5 * (sums[0] + sqrt(sums[0] * sums[0] + 4.0 * rest));
    if (degree == 2)
        return root;
    for (int step = 0; step < MOST_STEPS; step++) {
        double value = root - sums[0], slope = 2.0 * root - sums[0];
        for (int power = 2; power < degree; power++) {
            value = value * root - sums[power - 1];
            slope = slope * root + value;
        }
        double change = (value * root - sums[degree - 1]) / slope;
        root -= change;
        if (change <= 1e-7 * root)
            break;
    }
    return root;
}

/* H(f) = sum_i (f' A_i f)^(m_i / n): the scale as the root of a polynomial, then the normal. */
void power_sum_twists(const double *roots, const int *powers, int degree, int terms,
    const double *wrench_unit, const double *twist_unit, const double *in, double *out, size_t n)
{
    double images[3 * MOST_TERMS], parts[MOST_TERMS];
    for (size_t i = 0; i < n; i++, in += 3, out += 3) {
        double load[3], normal[3] = {0.0, 0.0, 0.0}, sums[MOST_DEGREE] = {0.0}, most = 0.0;
        scale_load(in, wrench_unit, load);
        for (int term = 0; term < terms; term++) {
            parts[term] = part_of(image_of(roots + 9 * term, load, images + 3 * term), degree);
            most = fmax(most, parts[term]);
            sums[powers[term] - 1] += whole_power(parts[term], powers[term]);
        }
        double root = root_of_equation(sums, degree, most);
        for (int term = 0; term < terms; term++)
            if (parts[term] > 0.0)
                add_pull(roots + 9 * term, images + 3 * term,
                    powers[term] * whole_power(root / parts[term], degree - powers[term]), normal);
        write_twist(normal, twist_unit, out);
    }
}

/* H(f) = sum_i sqrt(f' A_i f): the normal needs no scale. */
void norm_sum_twists(const double *roots, int terms, const double *wrench_unit,
    const double *twist_unit, const double *in, double *out, size_t n)
{
    for (size_t i = 0; i < n; i++, in += 3, out += 3) {
        double load[3], image[3], normal[3] = {0.0, 0.0, 0.0};
        scale_load(in, wrench_unit, load);
        for (int term = 0; term < terms; term++) {
            double form = image_of(roots + 9 * term, load, image);
            if (form > 0.0)
                add_pull(roots + 9 * term, image, 1.0 / sqrt(form), normal);
        }
        write_twist(normal, twist_unit, out);
    }
}

/* D(v) = sum_k sqrt(v' B_k v): the load is its gradient. */
void norm_sum_wrenches(const double *roots, int terms, const double *twist_unit,
    const double *wrench_unit, const double *in, double *out, size_t n)
{
    for (size_t i = 0; i < n; i++, in += 3, out += 3) {
        double twist[3], image[3], load[3] = {0.0, 0.0, 0.0};
        scale_load(in, twist_unit, twist);
        for (int term = 0; term < terms; term++) {
            double form = image_of(roots + 9 * term, twist, image);
            if (form > 0.0)
                add_pull(roots + 9 * term, image, 1.0 / sqrt(form), load);
        }
        for (int column = 0; column < 3; column++)
            out[column] = load[column] * wrench_unit[column];
    }
}

/* P(f) of fourth order; second holds its second derivatives as 9 quadratics of 6 coefficients. */
void quartic_twists(const double *second, const double *wrench_unit, const double *twist_unit,
    const double *in, double *out, size_t n)
{
    for (size_t i = 0; i < n; i++, in += 3, out += 3) {
        double f[3], normal[3] = {0.0, 0.0, 0.0};
        scale_load(in, wrench_unit, f);
        double squares[6] = {f[0] * f[0], f[0] * f[1], f[0] * f[2], f[1] * f[1], f[1] * f[2],
            f[2] * f[2]};
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++)
                for (int square = 0; square < 6; square++)
                    normal[row] += second[18 * row + 6 * column + square] * squares[square]
                        * f[column];
        write_twist(normal, twist_unit, out);
    }
}
