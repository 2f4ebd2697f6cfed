"use strict";
/* Looks up numbers in a table of pipeline/report/page/tables.py: a table has two axes and, of each number, a grid over
   them or a list of grids; null stands where there is no number. */

/* Between nodes of an axis: the cubic through four neighbouring numbers, or a curve through three or two of them where no
   four are known. Of the two or three fours around a point it is the one that bends least, so that a tip that lifts is
   not felt beyond. On a logarithmic axis it is one of logarithms, of numbers too where all are positive. */
function between({ nodes, log }, numbers, at) {
  const slack = 1e-9 * (last(nodes) - nodes[0]);
  if (!(at >= nodes[0] - slack && at <= last(nodes) + slack)) return null;
  const [to, from] = log && numbers.every((one) => one === null || one > 0) ? [Math.log, Math.exp] : [Number, Number];
  const before = Math.min(Math.max(d3.bisect(nodes, at) - 1, 0), nodes.length - 2);
  const around = (count) => d3.range(Math.max(0, before - count + 2), Math.min(before, nodes.length - count) + 1)
    .map((first) => d3.range(first, first + count)).filter((four) => four.every((i) => numbers[i] !== null));
  const fours = [4, 3, 2].map(around).find((found) => found.length > 0);
  if (fours === undefined) return null;
  const place = (i) => to(nodes[i]);
  const product = (four, i, factor) => four.reduce((found, j) => (j === i ? found : found * factor(j)), 1);
  const bend = (four) => Math.abs(d3.sum(four, (i) => to(numbers[i]) / product(four, i, (j) => place(i) - place(j))));
  const four = d3.least(fours, bend);
  return from(d3.sum(four, (i) => to(numbers[i]) * product(four, i, (j) => (to(at) - place(j)) / (place(i) - place(j)))));
}

/* All numbers of a table at a setting, which has a value for the key of each axis. */
function lookUp({ axes: [rows, columns], numbers }, setting) {
  const along = (axis, values) => between(axis, values, setting[axis.key]);
  const inside = (grid) => along(columns, columns.nodes.map((_, j) => along(rows, grid.map((row) => row[j]))));
  const found = (grid) => (Array.isArray(grid[0][0]) ? grid.map(inside) : inside(grid));
  return Object.fromEntries(Object.entries(numbers).map(([name, grid]) => [name, found(grid)]));
}
