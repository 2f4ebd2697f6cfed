"use strict";
(function () {
  const data = JSON.parse(document.getElementById("live-data").textContent);

  /* Solve a small linear system by Gauss with row exchanges. */
  function solved(matrix, right) {
    const n = right.length;
    const rows = matrix.map((row, i) => [...row, right[i]]);
    for (let k = 0; k < n; k += 1) {
      let pivot = k;
      for (let i = k + 1; i < n; i += 1) if (Math.abs(rows[i][k]) > Math.abs(rows[pivot][k])) pivot = i;
      [rows[k], rows[pivot]] = [rows[pivot], rows[k]];
      for (let i = k + 1; i < n; i += 1) {
        const share = rows[i][k] / rows[k][k];
        for (let j = k; j <= n; j += 1) rows[i][j] -= share * rows[k][j];
      }
    }
    const values = new Array(n).fill(0);
    for (let i = n - 1; i >= 0; i -= 1) {
      let rest = rows[i][n];
      for (let j = i + 1; j < n; j += 1) rest -= rows[i][j] * values[j];
      values[i] = rest / rows[i][i];
    }
    return values;
  }

  /* Unilateral contact: A F >= reach, F >= 0, one of them an equality; every set of touching tips is tried. */
  function contactForces(A, reach) {
    const n = reach.length;
    const length = Math.max(...reach.map(Math.abs), 1e-300);
    for (let left = 0; left < 2 ** n; left += 1) {
      const tips = [...reach.keys()].filter((i) => !((left >> i) & 1));
      const F = new Array(n).fill(0);
      const part = solved(tips.map((i) => tips.map((j) => A[i][j])), tips.map((i) => reach[i]));
      tips.forEach((tip, k) => { F[tip] = part[k]; });
      const fits = reach.every((r, i) => {
        if (tips.includes(i)) return F[i] > 0;
        return A[i].reduce((sum, a, j) => sum + a * F[j], 0) - r >= -1e-12 * length;
      });
      if (fits) return F;
    }
    return new Array(n).fill(0);
  }

  function springCompliance(K) {
    return data.C.map((row, i) => row.map((entry, j) => (i === j ? 1 / K[data.springs[i]] : entry)));
  }

  function linearForces(input, C) {
    const slope = Math.tan((input.tilt * Math.PI) / 180);
    const reach = data.along.map((x, i) => input.travel + x * slope + data.ahead[i]);
    return contactForces(C.map((row, i) => row.map((entry, j) => entry + data.S[i][j] / input.E)), reach);
  }

  /* Between the rows of the table: a straight line in E and in the travel. */
  function place(values, at) {
    let i = 0;
    while (i < values.length - 2 && values[i + 1] <= at) i += 1;
    if (values.length === 1) return [0, 0, 0];
    return [i, i + 1, Math.min(1, Math.max(0, (at - values[i]) / (values[i + 1] - values[i])))];
  }

  function between(table, input) {
    const [a, b, s] = place(data.table.E, input.E);
    const [c, d, t] = place(data.table.x, input.travel);
    const corners = [[a, c, (1 - s) * (1 - t)], [b, c, s * (1 - t)], [a, d, (1 - s) * t], [b, d, s * t]];
    let sum = 0;
    for (const [i, j, weight] of corners) {
      if (weight === 0) continue;
      const value = table(i, j);
      if (value === null) return null;
      sum += weight * value;
    }
    return sum;
  }

  function mean(values, tips) {
    return tips.reduce((sum, tip) => sum + values[tip], 0) / tips.length;
  }

  function forceRatio(K_l, K_h, K_m, ratio) {
    const high = ratio * K_m;
    return ((K_h * high) / (K_h + high)) / ((K_l * K_m) / (K_l + K_m));
  }

  function nonlinearity(K_l, K_h, K_m_max, ratio, definition) {
    const stiff = K_h / ratio;
    const K_m = definition === "mid-range" ? 0.5 * K_m_max : Math.sqrt(stiff * (stiff + K_m_max)) - stiff;
    const rise = forceRatio(K_l, K_h, K_m_max, ratio) - ratio;
    return (forceRatio(K_l, K_h, K_m, ratio) - ratio) / rise - K_m / K_m_max;
  }

  /* P of the forces; null where a tip is off the fruit. */
  function ratioOf(F) {
    return F.every((force) => force !== null && force > 0) ? mean(F, data.stiff) / mean(F, data.soft) : null;
  }

  /* NL at the tilt and travel of the sliders, by the moduli and the parabola of Python's scene verdicts. */
  function nonlinearityOfForces(P) {
    const last = P.length - 1;
    if ([P[0], P[last / 2], P[last]].includes(null)) return null;
    const departure = P.map((value, i) => (value === null ? null : (value - P[0]) / (P[last] - P[0]) - i / last));
    if (data.definition === "mid-range") return departure[last / 2];
    if (departure.includes(null)) return null;
    const top = Math.min(Math.max(departure.indexOf(Math.max(...departure)), 1), last - 1);
    const [before, here, after] = departure.slice(top - 1, top + 2);
    const bend = before - 2 * here + after;
    return bend < 0 ? here - (after - before) ** 2 / (8 * bend) : here;
  }

  /* (max P - min P) / mean P over equal steps of the travel, the worst of all moduli shown; null where none is known. */
  function worstSpread(pressed, travel) {
    const steps = data.scene.travels;
    const spreads = data.table.E.map((E) => {
      const P = Array.from({ length: steps }, (_, i) => pressed(E, (travel * (i + 1)) / steps)).filter((one) => one !== null);
      return P.length > 1 ? ((Math.max(...P) - Math.min(...P)) * P.length) / P.reduce((sum, one) => sum + one, 0) : null;
    });
    return spreads.includes(null) ? null : Math.max(...spreads);
  }

  /* P_max, NL and the spread of P over the travel: by the two-spring law where all tips touch at once, else by forces. */
  function characteristic(input, C, low, high) {
    const pressed = (E, travel) => ratioOf(linearForces({ E, travel, tilt: input.tilt }, C));
    const spread = worstSpread(pressed, input.travel);
    if (input.tilt === 0 && data.ahead.every((gap) => gap === 0)) {
      const K_m_max = data.E_max * data.K_m_over_E;
      return {
        P_max: forceRatio(low, high, K_m_max, data.stiffness_ratio),
        NL: nonlinearity(low, high, K_m_max, data.stiffness_ratio, data.definition),
        spread,
      };
    }
    const count = data.scene.moduli;
    const P = Array.from({ length: count + 1 },
      (_, i) => pressed(data.E_max * (i === 0 ? data.scene.softest : i / count), input.travel));
    return { P_max: P[count], NL: nonlinearityOfForces(P), spread };
  }

  function readByRatio(P, K_l, K_h) {
    const r = data.stiffness_ratio;
    if (P === null || P <= r || P >= K_h / K_l) return null;
    return (K_h * K_l * (r - P)) / (r * (P * K_l - K_h)) / data.K_m_over_E;
  }

  /* The contrast of three or more tips: rigid + dome z^2 + body z^3 = 0 at z = E^(-1/3), its smallest root. */
  function readByContrast(F, C) {
    const law = data.contrast;
    if (F.some((force) => force === null || !(force > 0))) return null;
    const weighted = (values) => law.weights.reduce((sum, w, i) => sum + w * values[i], 0);
    const product = (matrix) => matrix.map((row) => row.reduce((sum, a, j) => sum + a * F[j], 0));
    const rigid = weighted(product(C)) + weighted(law.gaps);
    const dome = law.hertz * weighted(F.map((force) => force ** (2 / 3)));
    const body = weighted(product(law.S));
    const contrast = (z) => rigid + z * z * (dome + body * z);
    const turn = body !== 0 ? (-2 * dome) / (3 * body) : 0;
    const beyond = 2 * Math.min(dome !== 0 ? Math.sqrt(Math.abs(rigid / dome)) : Infinity,
      body !== 0 ? Math.cbrt(Math.abs(rigid / body)) : Infinity);
    let start = 0;
    let end = turn > 0 ? turn : beyond;
    if (!Number.isFinite(end) || !(rigid * contrast(end) < 0)) return null;
    for (let step = 0; step < 200; step += 1) {
      const middle = 0.5 * (start + end);
      if (middle === start || middle === end) break;
      if (rigid * contrast(middle) > 0) start = middle; else end = middle;
    }
    return 1 / (end * end * end);
  }

  function meanPressure(F, E) {
    const force = Math.max(...F.map((one) => one || 0));
    if (data.dome === null || force === 0) return force / data.face;
    const depth = Math.cbrt((0.75 * (1 - data.dome.poisson ** 2)) / Math.sqrt(data.dome.radius)) ** 2;
    return force / (Math.PI * data.dome.radius * depth * Math.cbrt(force / E) ** 2);
  }

  function bruiseLimit(E) {
    if (data.bruise.limit.length === 0) return null;
    const [a, b, s] = place(data.bruise.E, E);
    return (1 - s) * data.bruise.limit[a] + s * data.bruise.limit[b];
  }

  /* Input: E [MPa], travel [mm], tilt [degrees], K {low, high} [N/mm]. Output: forces [N] and what follows from them. */
  function evaluate(input) {
    const C = data.linear ? springCompliance(input.K) : data.C;
    const F = data.linear ? linearForces(input, C)
      : data.names.map((_, tip) => between((i, j) => data.table.F[i][tip][j], input));
    const ratio = data.linear ? ratioOf(F) : between((i, j) => data.table.P[i][j], input);
    const found = { F, P: ratio, pressure: meanPressure(F, input.E), bruise: bruiseLimit(input.E) };
    const low = 1 / C[data.soft[0]][data.soft[0]];
    const high = 1 / C[data.stiff[0]][data.stiff[0]];
    const own = [1 / data.C[data.soft[0]][data.soft[0]], 1 / data.C[data.stiff[0]][data.stiff[0]]];
    if (data.contrast !== null) {
      found.E_read = readByContrast(F, C);
      found.E_uncalibrated = readByContrast(F, data.contrast.C);
    } else if (data.linear) {
      found.E_read = readByRatio(ratio, low, high);
      found.E_uncalibrated = readByRatio(ratio, ...own);
    }
    if (data.linear) Object.assign(found, characteristic(input, C, low, high));
    return found;
  }

  function digits(value) {
    return String(Number(Number(value).toPrecision(4)));
  }

  function text(value, unit) {
    return value === null || value === undefined ? "none" : `${digits(value)}${unit ? ` ${unit}` : ""}`;
  }

  function judged(passes, words) {
    return { outcome: passes ? "passed" : "failed", words };
  }

  /* The outcome of a number by the target and tolerance of its verdict in the report; null where it has none. */
  function byVerdict(name, value) {
    const rule = data.judged[name];
    if (!rule) return null;
    if (value === null) return judged(false, "a tip is off the fruit");
    const allowed = rule.relative ? rule.tolerance * rule.limit : rule.tolerance;
    const within = rule.relative ? `${digits(100 * rule.tolerance)} %` : digits(rule.tolerance);
    return judged(Math.abs(value - rule.limit) <= allowed, `target ${digits(rule.limit)} within ${within}`);
  }

  function rowsOf(found) {
    const rows = data.names.map((name, i) => [`force on the tip ${name}`, text(found.F[i], "N"),
      found.F[i] > 0 ? null : judged(false, "off the fruit")]);
    rows.push(["force ratio P", text(found.P), null]);
    if ("E_read" in found) rows.push(["modulus read, unit calibrated", text(found.E_read, "MPa"), null]);
    if ("E_uncalibrated" in found) {
      rows.push(["modulus read with the stiffnesses of the design", text(found.E_uncalibrated, "MPa"), null]);
    }
    if (data.linear) {
      rows.push(["P at the largest modulus, P_max", text(found.P_max), byVerdict("P_max", found.P_max)]);
      rows.push(["nonlinearity NL", text(found.NL), byVerdict("NL", found.NL)]);
      rows.push(["spread of P over the travel", text(found.spread), byVerdict("P_displacement_independent", found.spread)]);
    }
    rows.push(["mean pressure under the worst tip", text(found.pressure, "MPa"), found.bruise === null ? null
      : judged(found.pressure <= found.bruise, `limit ${text(found.bruise, "MPa")}`)]);
    return rows;
  }

  const keys = ["E", "travel", "tilt", ...new Set(data.springs.map((name) => `K-${name}`))];
  const sliders = Object.fromEntries(keys.map((key) => [key, document.getElementById(`live-${key}`)]));

  function asked() {
    const value = (key) => Number(sliders[key].value);
    const K = Object.fromEntries(data.springs.map((name) => [name, 1e-3 * value(`K-${name}`)]));
    return { E: value("E"), travel: value("travel"), tilt: value("tilt"), K };
  }

  function cell(kind, words, outcome) {
    const made = document.createElement(kind);
    if (kind === "th") made.scope = "row";
    if (outcome) {
      const span = document.createElement("span");
      span.className = `outcome ${outcome}`;
      span.textContent = outcome;
      made.append(span, ` ${words}`);
    } else {
      made.textContent = words;
    }
    return made;
  }

  function show() {
    const found = evaluate(asked());
    for (const key of keys) {
      document.getElementById(`shown-${key}`).textContent = digits(sliders[key].value);
    }
    const rows = rowsOf(found);
    document.querySelector("#live-numbers tbody").replaceChildren(...rows.map(([name, value, verdict]) => {
      const row = document.createElement("tr");
      row.append(cell("th", name), cell("td", value), cell("td", verdict ? verdict.words : "", verdict && verdict.outcome));
      return row;
    }));
    const wrong = rows.filter(([, , verdict]) => verdict && verdict.outcome === "failed").map(([name]) => name);
    document.getElementById("live-answer").textContent = wrong.length === 0
      ? "Everything judged here passes at these settings." : `At these settings fails: ${wrong.join(", ")}.`;
  }

  for (const slider of Object.values(sliders)) slider.addEventListener("input", show);
  document.getElementById("live-reset").addEventListener("click", () => {
    for (const slider of Object.values(sliders)) slider.value = slider.defaultValue;
    show();
  });
  window.addEventListener("beforeprint", () => {
    for (const one of document.querySelectorAll("details")) one.open = true;
  });
  window.twintip = { data, evaluate };
  show();
}());
