// SPDX-License-Identifier: Apache-2.0
// How far real motions lie from a predicted one: surface/kinds/dissipation_scatter.py in a browser.

const SLOWEST = 1e-12;

// The loads of the terms sqrt(x'B x) at a twist, their sum, and the Hessian of the sum.
function termLoads(matrices, u) {
  const parts = [], sum = [0, 0, 0], hessian = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  for (const matrix of matrices) {
    const product = matrix.map((row) => dot(row, u));
    const speed = Math.sqrt(Math.max(dot(product, u), SLOWEST * SLOWEST));
    const part = scaled(product, 1 / speed);
    for (let i = 0; i < 3; ++i) {
      sum[i] += part[i];
      for (let j = 0; j < 3; ++j) hessian[i][j] += (matrix[i][j] - part[i] * part[j]) / speed;
    }
    parts.push(part);
  }
  return { parts, sum, hessian };
}

// M inv(1 + M / most^2) of M = share * the sum of s s', as [xx, xy, yy].
function saturatedSum(shifts, share, most) {
  let xx = 0, xy = 0, yy = 0, determinant = 0;
  shifts.forEach(([x, y], i) => {
    [xx, xy, yy] = [xx + share * x * x, xy + share * x * y, yy + share * y * y];
    // By pairs the determinant keeps its digits where one shift is far the largest.
    for (const [a, b] of shifts.slice(0, i)) determinant += (share * (a * y - b * x)) ** 2;
  });
  const c = 1 / (most * most), whole = 1 + c * (xx + yy) + c * c * determinant;
  return [(xx + c * determinant) / whole, xy / whole, (yy + c * determinant) / whole];
}

// From a unit scaled twist to the region of the real ones: its half-axes [rad], the larger first,
// and unit scaled twists around it, on its border or at a share of the way there.
function makeScatter({ matrices, folds, scale, own, friction, jackknife, quantile }) {
  return (u) => {
    const least = [0, 1, 2].reduce((i, j) => (Math.abs(u[j]) < Math.abs(u[i]) ? j : i));
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                             a[0] * b[1] - a[1] * b[0]];
    const across = cross(u, [0, 1, 2].map((i) => Number(i === least)));
    const first = scaled(across, 1 / length(across)), second = cross(u, first);
    const { parts, sum, hessian } = termLoads(matrices, u);
    const bent = [first, second].map((each) => hessian.map((row) => dot(row, each)));
    const xx = dot(first, bent[0]), xy = dot(first, bent[1]), yy = dot(second, bent[1]);
    const determinant = xx * yy - xy * xy;
    // How the twist turns, in the plane across it, if the load changes.
    const turned = (change) => {
      const along = dot(u, change) / dot(u, sum);
      const rest = change.map((each, i) => each - along * sum[i]);
      const x = dot(first, rest), y = dot(second, rest);
      return [(yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant];
    };
    const size = length(sum);
    const shifts = folds.map((fold) => {
      const other = termLoads(fold, u).sum;
      return turned(other.map((each, i) => (size * each) / length(other) - sum[i]));
    });
    const count = shifts.length;
    const mean = [0, 1].map((i) => shifts.reduce((total, each) => total + each[i], 0) / count);
    const told = saturatedSum(shifts.map(([x, y]) => [x - mean[0], y - mean[1]]),
                              (count - 1) / count, jackknife.saturated);
    const varied = saturatedSum(parts.map(turned), 1, friction.saturated);
    const [a, b, c] = [0, 1, 2].map((i) => quantile * scale * (jackknife.factor * told[i]
      + friction.deviation ** 2 * varied[i] + (i === 1 ? 0 : own * own)));
    const larger = 0.5 * (a + c) + Math.hypot(0.5 * (a - c), b);
    const [p, q] = [Math.sqrt(a), b / Math.sqrt(a)], r = Math.sqrt(Math.max(c - q * q, 0));
    const around = (share) => Array.from({ length: 24 }, (_, k) => {
      const angle = (2 * Math.PI * k) / 24;
      const x = p * Math.cos(angle), y = q * Math.cos(angle) + r * Math.sin(angle);
      // No farther than the antipode.
      const away = Math.hypot(x, y), far = share * Math.min(away, Math.PI);
      return [0, 1, 2].map((i) =>
        Math.cos(far) * u[i] + (Math.sin(far) / away) * (x * first[i] + y * second[i]));
    });
    return { halfAxes: [Math.sqrt(larger), Math.sqrt((p * p * r * r) / larger)], around };
  };
}
