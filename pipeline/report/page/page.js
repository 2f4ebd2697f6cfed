"use strict";
/* Draws the page of a report: sliders, plots, bodies. `report` is report.json, `tables` are those of tables.py. */
(function () {
  const { report, tables, sliders, start, bruise } = data;
  const setting = { ...start };
  const verdictOf = (name) => report.verdicts.find((verdict) => verdict.name === name);
  const rows = report.response;
  const travel = report.design.press.travel_mm;
  const tipNames = report.tips.map((tip) => tip.name);
  const springs = report.tips.map((tip) => tip.spring);
  const tipForces = (row) => row.F_N || [row.F_l_N, row.F_h_N];
  const moduli = { domain: rows.map((row) => row.E_MPa), range: rows.map((_, i) => colours[i % colours.length]) };
  const colourOf = (E) => moduli.range[moduli.domain.indexOf(E)] || "var(--ink)";

  /* The numbers at the sliders, with changes to them, of the table that holds this setting; null where none does. P is
     the mean force of the high tips over that of the low ones. Where two tables do, the later one has more readings. */
  const [overTravels, overTilts] = tables;
  const nothing = { F: springs.map(() => null), pressure: springs.map(() => null), E_read: null, E_over_noise: null };
  const isHeld = (one) => ({ held }) => Object.entries(held).every(([key, value]) => one[key] === value);
  function at(changes = {}) {
    const one = { ...setting, ...changes };
    const table = tables.findLast(isHeld(one));
    const found = table ? lookUp(table, one) : nothing;
    return { ...found, P: ratioOf(found.F) };
  }
  const meanOf = (spring, F) => d3.mean(F.filter((_, tip) => springs[tip] === spring));
  const ratioOf = (F) => (F.every((one) => one > 0) ? meanOf("high", F) / meanOf("low", F) : null);
  const sliderOf = (key) => sliders.find((one) => one.key === key);
  const steps = ({ min, max }, count) => d3.range(count + 1).map((i) => min + ((max - min) * i) / count);
  const travels = () => steps(sliderOf("travel"), 25);
  const worst = ({ pressure }) => d3.max(pressure, (one) => one ?? NaN);
  const errorOf = ({ E_read: read }, E) => (read === null ? NaN : 100 * (read / E - 1));
  const isRead = sliderOf("noise") !== undefined;
  const { E_MPa: shown } = report.design.fruit;
  /* The limit of the uncertainty that holds 95 % [1]: one number, or one for each modulus shown, between them by ln E. */
  const uncertaintyLimitAt = ({ uncertainty_limit: limit }, E) => data.coverage * (Array.isArray(limit) ? d3.scaleLog(shown, limit).clamp(true)(E) : limit);
  /* What the fruit stands [MPa], between the moduli that have a limit. */
  const limitAt = (E) => (bruise.length < 2 ? bruise[0] : d3.scaleLinear(shown, bruise).clamp(true)(E));

  /* Plots: each returns the options of Plot.plot and a caption. */
  const dotted = (points) => Plot.line(points, { stroke: "var(--ink)", strokeWidth: 3, strokeDasharray: "0 7", strokeLinecap: "round" });
  const atSlider = (x, y, title) => (Number.isFinite(y) ? Plot.dot([{ x, y }], { x: "x", y: "y", r: 5, fill: "var(--ink)", title: () => title }) : null);

  function ratioOverModulus() {
    const curve = report.curve;
    need(curve.E_MPa, "report.json has no curve");
    const points = d3.zip(curve.E_MPa, curve.P, curve.E_lower_as_printed_MPa, curve.E_upper_as_printed_MPa,
      curve.E_lower_calibrated_MPa, curve.E_upper_calibrated_MPa).filter(([, P]) => Number.isFinite(P));
    need(points.length, "a tip is off the fruit at every modulus");
    const E_max = last(curve.E_MPa);
    const band = (low, high, opacity) => Plot.areaX(points.filter((one) => one[low] !== null || one[high] !== null), {
      y: "1", x1: (one) => one[low] ?? 0, x2: (one) => Math.min(one[high] ?? E_max, E_max), fill: colours[0], fillOpacity: opacity,
    });
    const softest = curve.P_softest;
    const NL = verdictOf("NL");
    const chord = NL && softest !== null && Number.isFinite(last(curve.P)) ? [[0, softest], [E_max, last(curve.P)]] : [];
    const moving = steps(sliderOf("E"), 40).map((E) => [E, at({ E }).P]);
    const { P } = at();
    return {
      x: { label: "modulus of the fruit E [MPa]", domain: [0, E_max] }, y: { label: "force ratio P [1]", zero: true },
      marks: here([
        band(2, 3, 0.16), band(4, 5, 0.35),
        Plot.line(points, { x: "0", y: "1", stroke: colours[0], strokeWidth: 2 }),
        Plot.line(chord, { stroke: "var(--muted)", strokeDasharray: "5 3" }),
        dotted(moving),
        atSlider(setting.E, P, `E ${text(setting.E, "MPa")}: P ${text(P)}`),
        Plot.tip(points, Plot.pointerX({ x: "0", y: "1", title: (one) => `E ${text(one[0], "MPa")}\nP ${text(one[1])}\ncalibrated ${text(one[4])} to ${text(one[5], "MPa")}` })),
      ]),
      caption: `At full travel; bands: moduli that may show P, as printed (light) and after calibrating (dark).${chord.length ? " Dashed: straight line." : ""} Dotted: at the sliders.${NL && Number.isFinite(NL.value) ? ` NL ${percent(NL.value)}.` : ""}`,
    };
  }

  function overTravel(points, label, marks, caption) {
    /* The name of each modulus stands at the end of its line, a line of text above the one below it. */
    const step = 0.05 * d3.max(points, (one) => one.y);
    const ends = d3.sort(d3.groups(points, (one) => one.E).map(([, line]) => last(line)), (one) => one.y);
    const named = [];
    for (const one of ends) named.push({ ...one, y: Math.max(one.y, named.length ? last(named).y + step : -Infinity) });
    return {
      x: { label: "travel x of the middle of the tips [mm]", domain: [0, travel] }, y: { label, zero: true }, marginRight: 62,
      color: moduli,
      marks: [
        Plot.line(points, { x: "x", y: "y", stroke: "E" }), Plot.dot(points, { x: "x", y: "y", fill: "E", r: 1.6 }),
        ...here(marks),
        Plot.text(named, { x: "x", y: "y", text: (one) => `${one.E} MPa`, fill: "E", textAnchor: "start", dx: 9 }),
        Plot.tip(points, Plot.pointer({ x: "x", y: "y", title: (one) => `E ${one.E} MPa, travel ${text(one.x, "mm")}\n${text(one.y)}${one.error ? ` ± ${digits(one.error, 2)} %` : ""}` })),
      ],
      caption,
    };
  }

  function ratioOverTravel() {
    const points = rows.flatMap((row) => d3.zip(row.x_mm, row.P, row.P_error_percent || [])
      .map(([x, y, error]) => ({ E: row.E_MPa, x, y, error })).filter((one) => Number.isFinite(one.y)));
    need(points.length, "a tip is off the fruit at every modulus");
    const moving = travels().map((x) => [x, at({ travel: x }).P]);
    const spread = verdictOf("P_displacement_independent");
    return overTravel(points, "force ratio P [1]", [
      Plot.areaY(points, { x: "x", y1: (one) => one.y * (1 - (one.error || 0) / 100), y2: (one) => one.y * (1 + (one.error || 0) / 100), fill: "E", fillOpacity: 0.25 }),
      dotted(moving),
      atSlider(setting.travel, at().P, "at the sliders"),
    ], `${report.paper ? "The paper's Fig. 11. " : ""}Bands: error of P by mesh and springs. Dotted: at the sliders.${spread && Number.isFinite(spread.value) ? ` P varies by at most ${percent(spread.value)} of its mean.` : ""}`);
  }

  function forcesOverTravel() {
    const points = travels().flatMap((x) => at({ travel: x }).F.map((y, tip) => ({ x, y, tip: tipNames[tip], spring: springs[tip] })));
    need(rows.length && at().F.some((one) => one > 0), "no tip is on the fruit");
    const solved = d3.least(rows, (row) => Math.abs(row.E_MPa - setting.E));
    const [shortest] = travels(); // the tables begin there, so a line does too
    const known = tipForces(solved).flatMap((F, tip) => F.map((y, i) => ({ x: solved.x_mm[i], y, tip: tipNames[tip], spring: springs[tip] })))
      .filter(({ x }) => x >= shortest - 1e-9 * travel);
    return {
      x: { label: "travel x of the middle of the tips [mm]", domain: [0, travel] }, y: { label: "force [N]", zero: true }, marginRight: 70,
      color: { domain: ["low", "high"], range: [colours[0], colours[1]], legend: true },
      marks: [
        Plot.line(points.filter((one) => one.y !== null), { x: "x", y: "y", z: "tip", stroke: "spring" }),
        Plot.dot(known.filter((one) => Number.isFinite(one.y)), { x: "x", y: "y", stroke: "spring", r: 2 }),
        ...here(at().F.map((y, tip) => atSlider(setting.travel, y, `${tipNames[tip]}: ${text(y, "N")}`))),
        Plot.tip(points, Plot.pointer({ x: "x", y: "y", title: (one) => `tip ${one.tip} (${one.spring} spring)\ntravel ${text(one.x, "mm")}\nforce ${text(one.y, "N")}` })),
      ],
      caption: `${setting.tilt === start.tilt ? "Lines" : "Large dots"}: at the sliders, E ${text(setting.E, "MPa")}. Circles: solved for the design at ${solved.E_MPa} MPa.`,
    };
  }

  /* Error of the modulus read [%] over the tilt, at the ends of the moduli and at that of the slider. */
  function errorOverTilt() {
    need(overTilts, "no press over the tilt is read");
    const { min, max } = sliderOf("E");
    const drawn = d3.sort(new Set([min, max, setting.E]));
    const points = drawn.flatMap((E) => steps(sliderOf("tilt"), 40).map((tilt) => ({ E, x: tilt, y: errorOf(lookUp(overTilts, { E, tilt }), E) })))
      .filter((one) => Math.abs(one.y) <= 100);
    need(points.length, "no setting has a reading within 100 %");
    const limit = 100 * report.design.reading.bias_limit;
    return {
      x: { label: "tilt along the tips [degrees]" }, y: { label: "error of the modulus read [%]" },
      color: { domain: drawn, range: drawn.map(colourOf), legend: true, tickFormat: (E) => `${digits(E, 3)} MPa` },
      marks: here([
        Plot.ruleY([0], { stroke: "var(--muted)" }),
        Plot.ruleY([-limit, limit], { stroke: "var(--bad)", strokeDasharray: "5 3" }),
        Plot.line(points, { x: "x", y: "y", stroke: "E" }),
        atSlider(setting.tilt, errorOf(at(), setting.E), "at the sliders"),
        Plot.tip(points, Plot.pointer({ x: "x", y: "y", title: (one) => `E ${text(one.E, "MPa")}, ${text(one.x)}\nerror ${ofError(one.y, "%")}` })),
      ]),
      caption: "At full travel. Dashed: the limit of the design. Large dot: at the sliders.",
    };
  }

  function readingOverModulus() {
    const read = need(report.reading && report.reading.moduli.length && report.reading.moduli, "no modulus is read");
    const asked = report.design.reading;
    const points = read.flatMap((row) => [
      { E: row.E_MPa, y: Math.abs(row.E_bias_percent), what: "bias, worst pose", worst: row.worst },
      { E: row.E_MPa, y: data.coverage * row.uncertainty_percent, what: "uncertainty, 95 %", worst: "all sources together" },
      { E: row.E_MPa, y: row.fruit ? data.coverage * row.fruit.one_press_percent : NaN, what: "uneven fruit, one press", worst: "skin and flesh that differ from tip to tip, 95 %" },
    ]).filter((one) => Number.isFinite(one.y));
    need(points.length, "no modulus is read in every pose");
    const own = Math.abs(errorOf(at(), setting.E));
    return {
      x: { label: "modulus of the fruit E [MPa]" }, y: { label: "error of the modulus read [%]", zero: true },
      color: { domain: ["bias, worst pose", "uncertainty, 95 %", "uneven fruit, one press"], range: colours.slice(0, 3), legend: true },
      marks: here([
        Plot.ruleY([100 * asked.bias_limit], { stroke: colours[0], strokeDasharray: "5 3" }),
        Plot.line(report.design.fruit.E_MPa.map((E) => ({ E, y: 100 * uncertaintyLimitAt(asked, E) })), { x: "E", y: "y", stroke: colours[1], strokeDasharray: "5 3" }),
        Plot.line(points, { x: "E", y: "y", stroke: "what" }), Plot.dot(points, { x: "E", y: "y", fill: "what" }),
        atSlider(setting.E, own, `bias at the sliders ${ofError(own, "%")}`),
        Plot.tip(points, Plot.pointer({ x: "E", y: "y", title: (one) => `E ${text(one.E, "MPa")}\n${one.what} ${ofError(one.y, "%")}\n${one.worst}` })),
      ]),
      caption: `Read as ${report.reading.method}, over tilts up to ${asked.tilt_deg} degrees. Dashed: limits. All tips touch by ${percent(report.reading.touch_fraction)} of the travel.${Number.isFinite(own) ? " Large dot: bias at the sliders." : ""}`,
    };
  }

  function pressureOverTravel() {
    const points = rows.flatMap((row) => row.x_mm.map((x) => ({ E: row.E_MPa, x, y: worst(lookUp(overTravels, { E: row.E_MPa, travel: x })) })))
      .filter((one) => Number.isFinite(one.y));
    need(points.some((one) => one.y > 0), "no tip is on the fruit");
    const limits = bruise.length ? rows.map((row) => ({ E: row.E_MPa, y: limitAt(row.E_MPa) })) : [];
    const moving = travels().map((x) => [x, worst(at({ travel: x }))]);
    return overTravel(points, "mean pressure under the worst tip [MPa]", [
      Plot.ruleY(limits, { y: "y", x1: 0.85 * travel, x2: travel, stroke: "E", strokeWidth: 2, strokeDasharray: "5 3" }),
      dotted(moving),
      atSlider(setting.travel, worst(at()), "at the sliders"),
    ], `${limits.length ? "Dashed: what the fruit stands." : "No limit is set for this fruit (fruit.bruise_limit_MPa)."} Dotted: at the sliders.`);
  }

  function errorBudget() {
    const names = { discretisation_percent: "mesh", model_percent: "left out of the model", inputs_percent: "scatter of inputs" };
    const parts = Object.entries(report.errors).filter(([, budget]) => budget !== null).flatMap(([name, budget]) => Object.keys(names)
      .map((key) => ({ name, what: names[key], y: budget[key], effects: (budget[key.replace("_percent", "")] || []) })))
      .filter((one) => Number.isFinite(one.y) && one.y > 0);
    need(parts.length, "no number has a budget");
    const words = (one) => (Array.isArray(one.effects) ? one.effects.map((part) => `${part.effect} ${ofError(part.size_percent, "%")}`).join("\n") : "");
    return {
      x: { label: "error, % of the value, logarithmic", type: "log", tickFormat: (value) => digits(value) }, y: { label: null, domain: Object.values(names) }, fy: { label: null },
      marginLeft: 130, marginRight: 60, height: 60 + 90 * new Set(parts.map((one) => one.name)).size,
      color: { domain: Object.values(names), range: colours },
      marks: [
        Plot.ruleY(parts, { fy: "name", y: "what", x1: d3.min(parts, (one) => one.y) / 2, x2: "y", stroke: "what", strokeWidth: 8 }),
        Plot.tip(parts, Plot.pointerY({ fy: "name", y: "what", x: "y", title: (one) => `${one.name}, ${one.what}: ${ofError(one.y, "%")}\n${words(one)}` })),
      ],
      caption: "Half widths. Inputs are the print, the pose of the sensor and Poisson's ratio of the fruit. Calibrating a unit settles the scatter of its springs.",
    };
  }

  const PLOTS = [
    ["Force ratio over modulus", ratioOverModulus],
    ["Force ratio over travel", ratioOverTravel],
    ["Force of each tip", forcesOverTravel],
    ...(report.design.reading ? [["Error of the reading over the tilt", errorOverTilt], ["Error over all poses", readingOverModulus]] : []),
    ["Pressure on the skin", pressureOverTravel],
    ["What the errors are made of", errorBudget],
  ];

  /* Where a verdict lies: three tolerances to each side of its target, or up to one and a half limits of one side. */
  function verdictScale(place) {
    const { value, limit, error, tolerance, relative, passed, sense } = data.verdicts[Number(place.dataset.verdict)];
    if (![value, limit, tolerance].every(Number.isFinite)) return;
    const width = relative ? tolerance * Math.abs(limit) : tolerance;
    const isTarget = width > 0 && !sense;
    if (!(isTarget || limit > 0)) return;
    const domain = isTarget ? [limit - 3 * width, limit + 3 * width] : [0, 1.5 * limit];
    const below = sense ? sense === "at most" : (value <= limit) === (passed !== false);
    const passing = isTarget ? [limit - width, limit + width] : below ? [0, limit + width] : [limit - width, domain[1]];
    const ends = [value - (error || 0), value + (error || 0)];
    const words = isTarget ? `${digits((value - limit) / width, 2)} of the tolerance from the target` : `${digits(value / limit, 2)} of the limit`;
    const svg = Plot.plot({
      width: 150, height: 22, margin: 5, x: { domain, clamp: true, axis: null }, y: { axis: null }, style: { background: "none" },
      marks: [
        Plot.ruleY([0], { x1: domain[0], x2: domain[1], stroke: "var(--line)", strokeWidth: 2 }),
        Plot.ruleY([0], { x1: passing[0], x2: passing[1], stroke: "var(--passing)", strokeWidth: 10 }),
        Plot.ruleX([limit], { stroke: "var(--ink)" }),
        Plot.ruleY([0], { x1: ends[0], x2: ends[1], stroke: colours[0], strokeWidth: 2.5 }),
        Plot.dot([value], { x: (one) => one, y: 0, r: 4, fill: colours[0] }),
      ],
    });
    asImage(svg, words);
    place.replaceChildren(svg);
  }

  /* The table under the sliders. */
  const judged = (passes, words) => ({ outcome: passes ? PASSED : FAILED, words });

  function numbersOf(found) {
    const numbers = tipNames.map((name, i) => [`force on the tip ${name}`, text(found.F[i], "N"), found.F[i] > 0 ? null : judged(false, "off the fruit")]);
    numbers.push(["force ratio P", text(found.P), null]);
    if (isRead) {
      const asked = report.design.reading;
      const error = found.E_read === null ? null : found.E_read / setting.E - 1;
      const noise = found.E_read === null ? null : (data.coverage * setting.noise * found.E_read) / found.E_over_noise;
      const isJudged = asked && (error !== null || found.P === null); // a square is read by whole presses, not on the way
      const rule = isJudged ? judged(error !== null && Math.abs(error) <= asked.bias_limit, `limit ${percent(asked.bias_limit)}`) : null;
      numbers.push(["modulus read, unit calibrated", text(found.E_read, "MPa"), null]);
      numbers.push(["its error", ofError(error === null ? NaN : Math.round(1e5 * error) / 1e3, "%"), rule]);
      const most = asked ? uncertaintyLimitAt(asked, setting.E) : Infinity;
      const loud = noise > most * setting.E; // noise is one source of several
      numbers.push(["its error by noise, 95 %", ofError(noise ?? NaN, "MPa"), loud ? judged(false, `limit ${percent(most)} of E, all sources together`) : null]);
    }
    const limit = limitAt(setting.E);
    numbers.push(["mean pressure under the worst tip", text(worst(found), "MPa"), limit === undefined ? null
      : judged(worst(found) <= limit, `limit ${text(limit, "MPa")}`)]);
    return numbers;
  }

  const judgedCell = (verdict) => (verdict
    ? made("td", {}, made("span", { className: `outcome ${verdict.outcome}`, textContent: verdict.outcome }), ` ${verdict.words}`)
    : made("td"));

  /* Sliders. One that a single table has sets the others to where that table was solved. */
  const inputs = sliders.map(({ key, label, unit, min, max }) => {
    const place = data.usual_sliders.includes(key) ? "sliders" : "more-sliders";
    const input = made("input", { type: "range", id: `slider-${key}`, min, max, step: "any" });
    const output = made("output", { htmlFor: input.id });
    const name = made("label", { textContent: `${label} [${unit}]`, htmlFor: input.id });
    element(place).append(made("div", { className: "slider" }, name, output, input));
    input.addEventListener("input", () => {
      setting[key] = Number(input.value);
      const having = tables.filter(({ axes }) => axes.some((axis) => axis.key === key));
      if (having.length === 1 && tables.length > 1) moveTo({ ...setting, ...having[0].held });
      moved();
    });
    return { key, input, output, unit };
  });

  function moveTo(other) {
    Object.assign(setting, other);
    for (const { key, input } of inputs) if (Number(input.value) !== setting[key]) input.value = setting[key];
  }

  function show() {
    for (const { key, input, output, unit } of inputs) {
      output.textContent = digits(setting[key], key === "noise" ? 2 : 4);
      input.setAttribute("aria-valuetext", `${output.textContent} ${unit}`);
    }
    const numbers = numbersOf(at());
    element("numbers").replaceChildren(...numbers.map(([name, value, verdict]) => made("tr", {},
      made("th", { scope: "row", textContent: name }), made("td", { textContent: value }), judgedCell(verdict))));
    const verdicts = numbers.filter(([, , verdict]) => verdict);
    element("judged").textContent = verdicts.length ? "judged" : "";
    const wrong = verdicts.filter(([, , { outcome }]) => outcome === FAILED).map(([name]) => name);
    const passed = verdicts.length === 0 ? "No number here has a limit in this design." : "Every number here that has a limit passes.";
    element("live-answer").textContent = wrong.length === 0 ? passed : `These numbers fail: ${wrong.join(", ")}.`;
    drawAll();
  }

  let waiting = false;
  function moved() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; show(); });
  }

  element("reset").addEventListener("click", () => {
    moveTo(start);
    show();
  });
  for (const flags of document.querySelectorAll(".hint code")) {
    if (/^--.*[ =]/.test(flags.textContent)) flags.parentElement.append(" ", copyButton(flags.textContent));
  }
  /* Time and price of a print, of its volume and mass and of what the reader types. */
  const cost = element("print-cost");
  function showCost() {
    const hours = cost.dataset.printed / element("rate").value;
    const price = (cost.dataset.mass / 1000) * element("price").value;
    cost.textContent = [hours < Infinity ? `${digits(hours, 2)} h of printing` : "", price > 0 ? `material for ${digits(price, 3)}` : ""].filter(Boolean).join(", ");
  }
  if (cost) {
    for (const id of ["rate", "price"]) element(id).addEventListener("input", showCost);
    showCost();
  }

  /* Drawings that lie beside the page, which holds them too. */
  async function showDrawings() {
    for (const { name, content } of data.drawings) {
      const image = made("img", { src: URL.createObjectURL(await unpacked(content, "image/svg+xml")), alt: `Drawing ${name}` });
      element("drawings").append(made("figure", {}, made("a", { href: name }, image), made("figcaption", { textContent: name })));
    }
  }

  document.querySelectorAll("[data-verdict]").forEach(verdictScale);
  const drawAll = drawPlots(PLOTS, element("plots"));
  moveTo(start);
  show();
  setTimeout(() => { showBodies(data.bodies, element("bodies")); showDrawings(); });
  window.twintip = { at, setting, show, sliders };
}());
