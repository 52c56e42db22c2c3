// SPDX-License-Identifier: Apache-2.0
// The maps of a limit surface from its numbers; see makeSurface.

const KINK = 1e-14, NULL = 1e-28;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const length = (a) => Math.sqrt(dot(a, a));

// Sum of norms |R_k x|, each smoothed to sqrt(|R_k x|^2 + s^2 |R_k|^2 |x|^2).
function norms(model, x, smoothing) {
  let value = 0;
  const gradient = [0, 0, 0], hessian = [0, 0, 0, 0, 0, 0, 0, 0, 0];
  const square = dot(x, x);
  for (const { root, form, size } of model.terms) {
    const y = [dot(root[0], x), dot(root[1], x), dot(root[2], x)];
    const round = smoothing * smoothing * size;
    const q = dot(y, y) + round * square;
    const norm = Math.sqrt(q);
    value += norm;
    if (q <= KINK * KINK * size * square) continue;
    const p = [0, 1, 2].map(
      (i) => (root[0][i] * y[0] + root[1][i] * y[1] + root[2][i] * y[2] + round * x[i]) / norm);
    for (let i = 0; i < 3; ++i) gradient[i] += p[i];
    if (smoothing > 0) {
      for (let i = 0; i < 9; ++i) {
        const diagonal = i % 4 === 0 ? round : 0;
        hessian[i] += (form[(i / 3) | 0][i % 3] + diagonal - p[(i / 3) | 0] * p[i % 3]) / norm;
      }
      continue;
    }
    // R'(1 - u u')R with u = y / |y| keeps its digits where the norm is small.
    const z = root.map((row, r) => row.map((a, i) => a - (y[r] / norm) * p[i]));
    for (let i = 0; i < 3; ++i) {
      for (let j = 0; j < 3; ++j) {
        hessian[3 * i + j] += (z[0][i] * z[0][j] + z[1][i] * z[1][j] + z[2][i] * z[2][j]) / norm;
      }
    }
  }
  return { value, gradient, hessian };
}

// Gauge g of a sum of powers, sum_i (q_i / g^2)^p_i = 1, by Newton's method for t = -log g.
function powers(model, x, smoothing) {
  const square = dot(x, x);
  const seen = [];
  for (const { root, form, size, exponent } of model.terms) {
    const y = [dot(root[0], x), dot(root[1], x), dot(root[2], x)];
    const round = smoothing * smoothing * size;
    const q = dot(y, y) + round * square;
    if (q <= NULL * size * square) continue;
    const pull = [0, 1, 2].map(
      (i) => root[0][i] * y[0] + root[1][i] * y[1] + root[2][i] * y[2] + round * x[i]);
    seen.push({ q, log: Math.log(q), pull, form, round, exponent });
  }
  let t = -Math.log(seen.reduce((sum, { q }) => sum + Math.sqrt(q), 0));
  for (let step = 0; step < 60; ++step) {
    let value = 0, rise = 0;
    for (const { log, exponent } of seen) {
      const part = Math.exp(exponent * (log + 2 * t));
      value += part;
      rise += 2 * exponent * part;
    }
    const move = (Math.log(value) * value) / rise;
    t -= move;
    if (Math.abs(move) < 1e-12) break;
  }
  const value = Math.exp(-t);
  let total = 0, weighted = 0;
  const slope = [0, 0, 0], mixed = [0, 0, 0];
  for (const term of seen) {
    const p2 = 2 * term.exponent;
    const share = p2 * Math.exp(term.exponent * (term.log + 2 * t));
    term.weight = share / term.q;
    total += share;
    weighted += p2 * share;
    for (let i = 0; i < 3; ++i) {
      slope[i] += term.weight * term.pull[i];
      mixed[i] += p2 * term.weight * term.pull[i];
    }
  }
  const relative = scaled(slope, 1 / total);
  const both = weighted / total + 1;
  const hessian = [0, 0, 0, 0, 0, 0, 0, 0, 0];
  for (let i = 0; i < 3; ++i) {
    for (let j = 0; j < 3; ++j) {
      let sum = 0;
      for (const { q, pull, form, round, exponent, weight } of seen) {
        const curvature = ((2 * exponent - 2) / q) * pull[i] * pull[j];
        sum += weight * (form[i][j] + (i === j ? round : 0) + curvature);
      }
      const cross = mixed[i] * relative[j] + mixed[j] * relative[i];
      hessian[3 * i + j] = value * ((sum - cross) / total + both * relative[i] * relative[j]);
    }
  }
  return { value, gradient: scaled(relative, value), hessian };
}

// Fourth root of a homogeneous polynomial P of degree four; by Euler, grad P = Hess P x / 3.
function quartic(model, v) {
  const c = model.coefficients, [x, y, m] = v;
  const xx = x * x, xy = x * y, xm = x * m, yy = y * y, ym = y * m, mm = m * m;
  const a = 12 * c[0] * xx + 6 * c[1] * xy + 6 * c[2] * xm + 2 * c[3] * yy + 2 * c[4] * ym
    + 2 * c[5] * mm;
  const b = 3 * c[1] * xx + 4 * c[3] * xy + 2 * c[4] * xm + 3 * c[6] * yy + 2 * c[7] * ym
    + c[8] * mm;
  const d = 3 * c[2] * xx + 2 * c[4] * xy + 4 * c[5] * xm + c[7] * yy + 2 * c[8] * ym
    + 3 * c[9] * mm;
  const e = 2 * c[3] * xx + 6 * c[6] * xy + 2 * c[7] * xm + 12 * c[10] * yy + 6 * c[11] * ym
    + 2 * c[12] * mm;
  const f = c[4] * xx + 2 * c[7] * xy + 2 * c[8] * xm + 3 * c[11] * yy + 4 * c[12] * ym
    + 3 * c[13] * mm;
  const h = 2 * c[5] * xx + 2 * c[8] * xy + 6 * c[9] * xm + 2 * c[12] * yy + 6 * c[13] * ym
    + 12 * c[14] * mm;
  const second = [a, b, d, b, e, f, d, f, h];
  const g = [0, 3, 6].map((i) => (second[i] * x + second[i + 1] * y + second[i + 2] * m) / 3);
  const p = dot(g, v) / 4;
  const value = Math.sqrt(Math.sqrt(p));
  const factor = (0.25 * value) / p;
  const hessian = second.map(
    (each, i) => factor * (each - (0.75 / p) * g[(i / 3) | 0] * g[i % 3]));
  return { value, gradient: scaled(g, factor), hessian };
}

// Solve K d = r for K symmetric and positive definite, by K = L D L'.
function solve(k, r) {
  const b = k[1] / k[0], c = k[2] / k[0];
  const least = 1e-16 * (k[0] + k[4] + k[8]);
  const middle = Math.max(k[4] - b * k[1], least);
  const across = k[5] - b * k[2], e = across / middle;
  const last = Math.max(k[8] - c * k[2] - e * across, least);
  const y = r[1] - b * r[0];
  const z = (r[2] - c * r[0] - e * y) / last;
  const q = y / middle - e * z;
  return [r[0] / k[0] - b * q - c * z, q, z];
}

// Minimise g(x)^2 / 2 - n.x by Newton's method with Armijo's rule; null if it does not settle.
function descend(gauge, n, smoothing, start) {
  let at = gauge(start, smoothing);
  const along = dot(n, start);
  if (!(along > 0 && at.value > 0)) return null;
  let x = scaled(start, along / (at.value * at.value));
  at = gauge(x, smoothing);
  let height = 0.5 * at.value * at.value - dot(n, x);
  const size = length(n);
  for (let step = 0; step < 40; ++step) {
    const rest = n.map((each, i) => each - at.value * at.gradient[i]);
    const k = at.hessian.map(
      (h, i) => at.value * h + at.gradient[(i / 3) | 0] * at.gradient[i % 3]);
    const move = solve(k, rest);
    const residual = length(rest), relative = length(move) / length(x);
    if (!(relative < 1e100)) return null;
    // A kink draws the steps in.
    if (relative <= 1e-13 && residual > 1e-5 * size) return null;
    if ((relative <= 1e-9 && residual <= 1e-5 * size) || residual <= 1e-15 * size) {
      return x.map((each, i) => each + move[i]);
    }
    const slope = dot(rest, move);
    // Far from the reference point the products cancel: rounding is a part of what they sum.
    const noise = 1e-15 * size * length(x);
    let part = 1, fell = false;
    for (let halving = 0; halving < 30; ++halving, part *= 0.5) {
      const trial = x.map((each, i) => each + part * move[i]);
      const there = gauge(trial, smoothing);
      const lower = 0.5 * there.value * there.value - dot(n, trial);
      if (lower <= height - 1e-4 * part * slope + noise) {
        [x, at, height, fell] = [trial, there, lower, true];
        break;
      }
    }
    if (!fell) return residual <= 1e-9 * size ? x : null;
  }
  return null;
}

// The point of gauge 1 with the largest n.x, as { point, corner }; null if none is certain.
function support(model, gauge, n) {
  let start = null, most = 0;
  for (const each of model.starts) {
    const power = dot(each, n);
    if (Math.abs(power) > most) {
      most = Math.abs(power);
      start = scaled(each, Math.sign(power));
    }
  }
  let nearest = Infinity, best = null;
  for (const corner of model.corners) {
    let power = dot(corner.point, n);
    if (Math.abs(power) < 1e-60) power = 1e-60;
    const q = corner.rows.map((row, i) => dot(row, n) / power - corner.centre[i]);
    const square = q[0] * q[0] + q[1] * q[1];
    if (square < nearest) [nearest, best] = [square, { corner, q, power }];
  }
  if (best) {
    const { corner, q, power } = best, sign = power > 0 ? 1 : -1, distance = Math.sqrt(nearest);
    if (distance <= 1 + 1e-12 && corner.rest === 0) {
      return { point: scaled(corner.point, sign), corner: true };
    }
    if (distance < 4) {
      const [[a, b], [, c]] = corner.curvature;
      const curvature = q[0] * (a * q[0] + b * q[1]) + q[1] * (b * q[0] + c * q[1])
        + 1e-3 * nearest;
      // A term that is nearly of rank two leaves its kink by its third row.
      const reach = distance < 1
        ? corner.rest / Math.sqrt(Math.max(1 - nearest, 1e-16))
        : ((distance - 1) * distance) / curvature + corner.rest;
      const move = [0, 1, 2].map(
        (i) => reach * (corner.rows[0][i] * q[0] + corner.rows[1][i] * q[1]));
      const back = 1 - dot(n, move) / power;
      const beside = corner.point.map((each, i) => sign * (back * each + move[i]));
      if (dot(beside, n) > most * gauge(beside, 0).value) start = beside;
    }
  }
  let found = descend(gauge, n, 0, start);
  if (!found) {
    // Follow the minimum while the kinks sharpen, along a path that is straight in the end.
    let path = start, before = start, smoothing = 0.3, sharp = false;
    for (let round = 0; round < 22; ++round) {
      const ahead = path.map((each, i) => each + (round > 1 ? 0.2 * (each - before[i]) : 0));
      const next = descend(gauge, n, smoothing, ahead) || descend(gauge, n, smoothing, path);
      if (!next) break;
      [before, path] = [path, next];
      smoothing *= 0.2;
      sharp = smoothing < 1e-13;
    }
    found = descend(gauge, n, 0, path) || (sharp ? path : null);
  }
  return found && { point: scaled(found, 1 / gauge(found, 0).value), corner: false };
}

// Bring a vector to scaled variables and to size one; null if it is zero or not finite.
function prepared(vector, unit) {
  const size = Math.max(...vector.map(Math.abs));
  if (!(size > 0 && size < Infinity)) return null;
  const x = vector.map((each, i) => each / size / unit[i]);
  const second = Math.max(...x.map(Math.abs));
  return { x: scaled(x, 1 / second), size: size * second };
}

// The maps of a surface from its numbers, as export_surface writes them.
function makeSurface(numbers) {
  const terms = numbers.roots.map((root, k) => {
    const form = [0, 1, 2].map((i) => [0, 1, 2].map(
      (j) => root[0][i] * root[0][j] + root[1][i] * root[1][j] + root[2][i] * root[2][j]));
    return { root, form, size: form[0][0] + form[1][1] + form[2][2],
             exponent: numbers.exponents[k] };
  });
  const model = { ...numbers, terms };
  const kernel = [norms, powers, quartic][model.family];
  const gauge = (x, smoothing) => kernel(model, x, smoothing);
  const inUnits = (x, unit) => [x[0] * unit[0], x[1] * unit[1], x[2] * unit[2]];
  return {
    name: model.name,
    kind: model.kind,
    convex: model.convex,
    characteristicLength: model.characteristic_length,
    wrenchUnit: model.wrench_unit,
    twistUnit: model.twist_unit,

    // How far out a wrench lies: below 1 the body sticks; 0 for a zero wrench.
    loadFactor(wrench) {
      const given = prepared(wrench, model.wrench_unit);
      if (!given) return wrench.every((each) => each === 0) ? 0 : null;
      if (model.gauge_of_loads) return gauge(given.x, 0).value * given.size;
      const found = support(model, gauge, given.x);
      return found && dot(found.point, given.x) * given.size;
    },

    // Direction of the motion, with vx^2 + vy^2 + (rho omega)^2 = 1.
    twistOfWrench(wrench) {
      const given = prepared(wrench, model.wrench_unit);
      if (!given) return null;
      const found = model.gauge_of_loads
        ? { point: gauge(given.x, 0).gradient } : support(model, gauge, given.x);
      return found && inUnits(scaled(found.point, 1 / length(found.point)), model.twist_unit);
    },

    // Load of maximum dissipation; null where the surface is not certified convex.
    wrenchOfTwist(twist) {
      const given = prepared(twist, model.twist_unit);
      if (!given || (model.gauge_of_loads && !model.convex)) return null;
      const found = model.gauge_of_loads
        ? support(model, gauge, given.x) : { point: gauge(given.x, 0).gradient };
      return found && inUnits(found.point, model.wrench_unit);
    },
  };
}
