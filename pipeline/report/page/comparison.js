"use strict";
/* Draws two runs into the same plots and shows their bodies. Each of `data.sides` has a title, a report and bodies. */
(function () {
  const titles = data.sides.map((side) => side.title);
  const both = { domain: titles, range: colours, legend: true };

  /* One row for each modulus of both reports, without those that have no number. */
  function overModulus(rowsOf) {
    const points = data.sides.flatMap(({ title, report }) => rowsOf(report).map(([E, y, worse]) => ({ title, E, y, worse })));
    return need(points.some((one) => Number.isFinite(one.y)) && points.filter((one) => Number.isFinite(one.y)), "neither report has it");
  }

  function overE(points, label, caption, marks = []) {
    const absent = titles.filter((title) => !points.some((one) => one.title === title));
    return {
      x: { label: "modulus of the fruit E [MPa]" }, y: { label, zero: true }, color: both,
      marks: [
        ...marks, Plot.line(points, { x: "E", y: "y", stroke: "title" }),
        Plot.tip(points, Plot.pointer({ x: "E", y: "y", title: (one) => `${one.title}\nE ${text(one.E, "MPa")}\n${text(one.y)}${one.worse ? `\n${one.worse}` : ""}` })),
      ],
      caption: [caption, ...absent.map((title) => `None of ${title}.`)].join(" "),
    };
  }

  function ratio() {
    const points = overModulus(({ curve }) => d3.zip(curve.E_MPa || [], curve.P || []));
    const E_max = d3.max(points, (one) => one.E);
    const band = data.sides.flatMap(({ title, report: { curve } }) => d3.zip(curve.P || [], curve.E_lower_calibrated_MPa || [], curve.E_upper_calibrated_MPa || [])
      .filter(([y, low]) => Number.isFinite(y) && Number.isFinite(low)).map(([y, low, high]) => ({ title, y, low: Math.min(Math.max(low, 0), E_max), high: Math.min(high ?? E_max, E_max) })));
    return overE(points, "force ratio P [1]", "At full travel; bands: moduli that may show P once the unit is calibrated.",
      [Plot.areaX(band, { y: "y", x1: "low", x2: "high", fill: "title", fillOpacity: 0.2 })]);
  }

  const uncertainty = () => overE(overModulus(({ reading }) => (reading ? reading.moduli : []).map((row) => [row.E_MPa, data.coverage * row.uncertainty_percent])),
    "uncertainty of the modulus read, 95 % [%]", "All sources together, over fruits and poses.");

  const bias = () => overE(overModulus(({ reading }) => (reading ? reading.moduli : []).map((row) => [row.E_MPa, Math.abs(row.E_bias_percent), row.worst])),
    "bias of the modulus read [%]", "In the worst pose of each design.");

  const force = () => overE(overModulus(({ response }) => response.map((row) => [row.E_MPa, d3.max((row.F_N || [row.F_l_N, row.F_h_N]).map(last))])),
    "largest force of a tip [N]", "At full travel.");

  drawPlots([
    ["Force ratio over modulus", ratio],
    ["Force at full travel", force],
    ["Uncertainty of a reading", uncertainty],
    ["Bias of a reading", bias],
  ], element("plots"))();
  setTimeout(() => data.sides.forEach(({ bodies }, side) => showBodies(bodies, element(`bodies-${side}`))));
}());
