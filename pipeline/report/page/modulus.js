"use strict";
/* Draws compression tests: force over travel with the fitted law, stress over strain with the secant. */
(function () {
  const { tests } = data;
  const color = { domain: tests.map((test) => test.name), range: colours, legend: tests.length < 9 };
  const rows = (x, y) => tests.flatMap((test) => d3.zip(test[x], test[y]).map(([one, other]) => ({ name: test.name, x: one, y: other })));

  function forces() {
    const laws = tests.flatMap(({ name, law }) => d3.zip(law.travel, law.force).map(([x, y]) => ({ name, x, y })));
    const points = rows("travel", "force");
    return {
      x: { label: "travel [mm]" }, y: { label: "force [N]" }, color,
      marks: [
        Plot.dot(points, { x: "x", y: "y", r: 3, stroke: "name", strokeOpacity: 0.6 }),
        Plot.line(laws, { x: "x", y: "y", stroke: "currentColor", strokeWidth: 1.2, z: "name" }),
        Plot.ruleX(tests, { x: "touch", stroke: "name", strokeDasharray: "2 3" }),
        Plot.ruleX(tests.filter((test) => test.failure !== null), { x: "failure", stroke: "name", strokeDasharray: "6 3" }),
        Plot.tip(points, Plot.pointer({ x: "x", y: "y", title: (one) => `${one.name}\n${text(one.x, "mm")}: ${text(one.y, "N")}` })),
      ],
      caption: "Circles: measured, up to the failure of the skin. Lines: the law where it is fitted. Dotted: first touch. Dashed: the skin fails; later points are left out.",
    };
  }

  function stresses() {
    const secants = tests.flatMap(({ name, secant }) => [0, secant.strain].map((x) => ({ name, x, y: 0.01 * x * secant.E })));
    const points = rows("strain", "stress").filter((one) => one.x >= 0);
    return {
      x: { label: "strain: travel over height [%]" }, y: { label: "stress: force over plate area [MPa]" }, color, marginLeft: 56,
      marks: [
        Plot.dot(points, { x: "x", y: "y", r: 3, stroke: "name", strokeOpacity: 0.6 }),
        Plot.line(secants, { x: "x", y: "y", stroke: "currentColor", strokeWidth: 1.2, z: "name" }),
        Plot.tip(points, Plot.pointer({ x: "x", y: "y", title: (one) => `${one.name}\n${text(one.x, "%")}: ${text(one.y, "MPa")}` })),
      ],
      caption: "Lines: the secant, whose slope is the paper's modulus.",
    };
  }

  function moduli() {
    return {
      x: { label: "modulus of the flesh E [MPa]", zero: true }, y: { label: null }, marginLeft: 120, height: 90 + 26 * tests.length, color: { ...color, legend: false },
      marks: [
        Plot.ruleY(tests, { y: "name", x1: (one) => one.E * (1 - 0.01 * one.u_percent), x2: (one) => one.E * (1 + 0.01 * one.u_percent), stroke: "name", strokeWidth: 3 }),
        Plot.dot(tests, { y: "name", x: "E", fill: "name", r: 5 }),
        Plot.tip(tests, Plot.pointerY({ y: "name", x: "E", title: (one) => `${one.name}\nE ${text(one.E, "MPa")} ± ${digits(one.u_percent, 2)} %` })),
      ],
      caption: "Bars: 95 %.",
    };
  }

  drawPlots([["Force over travel", forces], ["Stress over strain", stresses], ["Moduli", moduli]], element("plots"))();
}());
