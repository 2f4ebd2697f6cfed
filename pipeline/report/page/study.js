"use strict";
/* Draws the page of a study: what its points trade for what, every key beside the others, means over each key. */
(function () {
  const { points, best } = data;
  const passing = (point) => data.wanted.every((key) => !key.endsWith(".passed") || point[key] !== false);
  const labelOf = (key) => data.labels[key] || key;
  /* A number that has a limit beside it is also told as its part of the limit. */
  const parts = data.parts.filter((key) => data.axes.includes(key.replace(/limit$/, "value")) && points.some((point) => Number.isFinite(point[key])));
  const partOf = (key) => `${key.replace(/^verdicts\./, "").replace(/\.limit$/, "")} / limit`;
  for (const key of parts) for (const point of points) point[partOf(key)] = point[key.replace(/limit$/, "value")] / point[key];
  const axes = [...data.axes, ...parts.map(partOf)];
  const setting = { picked: best[0], held: null };
  const isHeld = (point) => setting.held === null || setting.held.has(point.number);
  const found = () => points.find((point) => point.number === setting.picked);
  const colour = (point) => (passing(point) ? colours[0] : "var(--muted)");
  const isWord = (key) => points.length > 0 && typeof points[0][key] === "string";
  const tell = (point) => [`point ${point.number}`, ...[...new Set([...data.vary, ...axes])].slice(0, 12).map((key) => `${labelOf(key)} ${typeof point[key] === "number" ? digits(point[key]) : point[key]}`)].join("\n");

  /* Points that no other one beats in both numbers, both the less the better. */
  function front(x, y) {
    const rows = d3.sort(points.filter((one) => passing(one) && Number.isFinite(one[x]) && Number.isFinite(one[y])), (one) => one[x], (one) => one[y]);
    return rows.filter((one, i) => i === 0 || one[y] < d3.min(rows.slice(0, i), (other) => other[y]));
  }

  function tradeOff() {
    need(axes.length > 1, "fewer than two numbers differ");
    const [x, y] = [element("across").value, element("up").value];
    return {
      x: { label: labelOf(x) }, y: { label: labelOf(y) }, marginLeft: 60,
      marks: here([
        Plot.line(front(x, y), { x, y, curve: "step-after", stroke: colours[1] }),
        Plot.dot(points, { x, y, r: 3, fill: colour, fillOpacity: (one) => (isHeld(one) ? 0.8 : 0.1) }),
        Plot.dot([found()], { x, y, r: 7, stroke: "var(--ink)", strokeWidth: 2 }),
        Plot.tip(points, Plot.pointer({ x, y, title: tell })),
      ]),
      ready: (drawn, svg) => holdByDragging(drawn, svg, x, y),
      caption: "Grey: a verdict fails. Line: points that no passing one beats in both numbers, the less the better.",
    };
  }

  /* The design of each value of a front; of a value that is a list its first number stands for it. */
  function overFront() {
    const first = (value) => (Array.isArray(value) ? value[0] : value);
    const { key, values, proved } = data.front;
    const x = (one) => first(one[key]);
    const y = data.minimise;
    const rows = d3.sort(points.filter((one) => proved.includes(one.number)), x);
    need(rows.length > 0, "no value has a design whose run passes");
    const missing = values.map(first).filter((value) => !rows.some((one) => x(one) === value));
    return {
      x: { label: labelOf(key), domain: d3.extent(values, first) }, y: { label: labelOf(y) }, marginLeft: 60, inset: 12,
      marks: [
        Plot.line(rows, { x, y, stroke: colours[0] }),
        Plot.dot(rows, { x, y, r: 4, fill: colours[0] }),
        Plot.text(missing, { x: (value) => value, frameAnchor: "bottom", text: () => "none", fill: "var(--muted)" }),
        Plot.dot(rows.filter((one) => one.number === setting.picked), { x, y, r: 7, stroke: "var(--ink)", strokeWidth: 2 }),
        Plot.tip(rows, Plot.pointer({ x, y, title: tell })),
      ],
      ready: (drawn, svg) => svg.addEventListener("click", () => svg.value && pick(svg.value.number)),
      caption: `Each dot is the best design at its ${key}${Array.isArray(values[0]) ? ", drawn at the first number of the list" : ""}, proved by a run; none: no run passed.`,
    };
  }

  function holdByDragging(drawn, svg, x, y) {
    const [across, up] = [drawn.scale("x"), drawn.scale("y")];
    d3.select(svg).append("g").call(d3.brush().on("end", ({ selection }) => {
      if (selection === null) {
        const at = d3.select(svg).property("value");
        if (setting.held === null && at) pick(at.number); else { setting.held = null; drawAll(); }
        return;
      }
      const [[left, top], [right, bottom]] = selection;
      const inside = (one) => across.apply(one[x]) >= left && across.apply(one[x]) <= right && up.apply(one[y]) >= top && up.apply(one[y]) <= bottom;
      setting.held = new Set(points.filter(inside).map((one) => one.number));
      drawAll();
    }));
  }

  function everyKey() {
    need(axes.length > 1, "fewer than two numbers differ");
    const ends = new Map(axes.map((key) => [key, d3.extent(points, (one) => one[key])]));
    const rows = points.flatMap((one) => axes.map((key) => ({ key, one, x: (one[key] - ends.get(key)[0]) / (ends.get(key)[1] - ends.get(key)[0]) })))
      .filter((row) => Number.isFinite(row.x));
    const picked = rows.filter((row) => row.one.number === setting.picked);
    return {
      x: { axis: null }, y: { domain: axes, label: null, axis: null }, grid: false, height: 74 + 60 * axes.length, marginTop: 10, marginBottom: 10, marginLeft: 60, marginRight: 60,
      marks: [
        Plot.ruleY(axes, { stroke: "var(--line)" }),
        Plot.line(rows, { x: "x", y: "key", z: (row) => row.one.number, stroke: (row) => colour(row.one), strokeOpacity: (row) => (isHeld(row.one) ? 0.35 : 0.02) }),
        Plot.line(picked, { x: "x", y: "key", z: null, stroke: "var(--ink)", strokeWidth: 2.5 }),
        Plot.text(axes, { frameAnchor: "left", y: (key) => key, dx: -60, dy: -16, text: labelOf, textAnchor: "start", fill: "var(--ink)", fontWeight: 600, stroke: "var(--paper)", strokeWidth: 8 }),
        Plot.text(axes, { x: 0, y: (key) => key, dx: -8, text: (key) => digits(ends.get(key)[0]), textAnchor: "end", fill: "var(--muted)" }),
        Plot.text(axes, { x: 1, y: (key) => key, dx: 8, text: (key) => digits(ends.get(key)[1]), textAnchor: "start", fill: "var(--muted)" }),
        Plot.tip(rows, Plot.pointer({ x: "x", y: "key", title: (row) => tell(row.one) })),
      ],
      ready: (drawn, svg) => svg.addEventListener("click", () => svg.value && pick(svg.value.one.number)),
      caption: "A line is a point, each key from its least to its largest value; the thick one is the point picked.",
    };
  }

  function overKey(key) {
    const y = element("up").value;
    need(key !== y, "it is the number that is drawn up");
    const held = points.filter(isHeld);
    const turned = isWord(key) && d3.sum(new Set(points.map((one) => one[key])), (one) => one.length) > 40 ? { tickRotate: -30 } : {};
    return {
      x: { label: labelOf(key), ...turned }, y: { label: labelOf(y) }, marginLeft: 60, height: 260, ...(turned.tickRotate ? { marginBottom: 70 } : {}),
      marks: [
        Plot.dot(points, { x: key, y, r: points.length < 100 ? 3 : 1.6, fill: colour, fillOpacity: (one) => (isHeld(one) ? 0.6 : 0.05) }),
        isWord(key)
          ? Plot.tickY(held, Plot.groupX({ y: "mean" }, { x: key, y, stroke: colours[1], strokeWidth: 2 }))
          : Plot.line(held, Plot.binX({ y: "mean", x: (bin) => d3.mean(bin) }, { x: key, y, thresholds: 12, stroke: colours[1], strokeWidth: 2 })),
        Plot.dot([found()], { x: key, y, r: 5, stroke: "var(--ink)", strokeWidth: 2 }),
        Plot.tip(points, Plot.pointer({ x: key, y, title: tell })),
      ],
      ready: (drawn, svg) => svg.addEventListener("click", () => svg.value && pick(svg.value.number)),
      caption: isWord(key) ? "Line: the mean of each." : "Line: means over twelve parts of the span.",
    };
  }

  const PLOTS = [
    ...(data.front ? [["The front", overFront]] : []),
    ["Trade-off", tradeOff],
    ["Every key beside the others", everyKey],
    ...data.vary.filter((key) => data.axes.includes(key) || isWord(key)).map((key) => [`Over ${labelOf(key)}`, () => overKey(key)]),
  ];

  /* The design of the point picked: its file where it has one, else the command that makes it of the base. */
  function showPoint() {
    const point = found();
    element("picked").value = setting.picked;
    element("point-number").textContent = setting.picked;
    const outcome = (passed) => (passed === null ? UNDECIDED : passed ? PASSED : FAILED);
    const told = (value) => (typeof value === "number" ? digits(value, 5) : typeof value === "boolean" ? outcome(value) : value ?? "none");
    const judged = (key) => {
      const [limit, passed] = ["limit", "passed"].map((field) => point[key.replace(/value$/, field)]);
      if ([limit ?? null, passed ?? null].every((one) => one === null)) return "";
      return `${limit === undefined ? "" : `, asked: ${told(limit)}`}${passed === undefined ? "" : `, ${outcome(passed)}`}`;
    };
    element("point").replaceChildren(...data.shown.map((key) => made("tr", {},
      made("th", { scope: "row" }, ...labelOf(key).split(/(?<=[._])/).flatMap((part) => [part, made("wbr")])),
      made("td", { className: "number", textContent: `${told(point[key])}${/^verdicts\..*\.value$/.test(key) ? judged(key) : ""}` }))));
    if (!data.links.base) return;
    const setTo = (key) => (Array.isArray(point[key]) ? `--set '${key}=${JSON.stringify(point[key])}'` : `--set ${key}=${point[key]}`);
    const command = ["pipeline run --design", data.links.base, ...data.vary.map(setTo)].join(" ");
    const file = data.links[setting.picked];
    element("design").replaceChildren(...(file ? [made("a", { href: file, textContent: file }), ", the same as "] : []), made("code", { textContent: command }), " ", copyButton(command));
  }

  function pick(number) {
    if (!points.some((point) => point.number === number)) return;
    setting.picked = number;
    showPoint();
    drawAll();
  }

  for (const [id, chosen] of [["across", axes.find((key) => key.endsWith("/ limit")) || [...data.wanted, ...axes].find((key) => axes.includes(key) && key !== data.minimise)], ["up", data.minimise]]) {
    element(id).append(...axes.map((key) => made("option", { value: key, textContent: labelOf(key), selected: key === chosen })));
    element(id).addEventListener("change", () => drawAll());
  }
  element("picked").addEventListener("change", () => pick(Number(element("picked").value)));
  const drawAll = drawPlots(PLOTS, element("plots"));
  if (points.length > 0) {
    showPoint();
    drawAll();
  }
  window.twintip = { setting, pick };
}());
