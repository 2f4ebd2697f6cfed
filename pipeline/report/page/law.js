"use strict";
/* Forces and readings of a sensor at any setting, from the numbers of pipeline/report/page/law.py.
   A setting has E [MPa], travel, place [mm], tilt [deg], radius of the fruit [mm], K {low, high} [N/mm], noise [%]. */
function sensorLaw(data) {
  const tips = [...data.x.keys()];
  const add = (values) => values.reduce((sum, one) => sum + one, 0);
  const product = (matrix, vector) => matrix.map((row) => add(row.map((entry, j) => entry * vector[j])));
  const mean = (values, group) => add(group.map((tip) => values[tip])) / group.length;
  const middle = add(data.x) / data.x.length;

  /* Solve a small linear system by Gauss with row exchanges. */
  function solved(matrix, right) {
    const n = right.length;
    const rows = matrix.map((row, i) => [...row, right[i]]);
    for (let k = 0; k < n; k += 1) {
      let pivot = k;
      for (let i = k + 1; i < n; i += 1) if (Math.abs(rows[i][k]) > Math.abs(rows[pivot][k])) pivot = i;
      [rows[k], rows[pivot]] = [rows[pivot], rows[k]];
      for (let i = k + 1; i < n; i += 1) {
        const factor = rows[i][k] / rows[k][k];
        for (let j = k; j <= n; j += 1) rows[i][j] -= factor * rows[k][j];
      }
    }
    const values = new Array(n).fill(0);
    for (let i = n - 1; i >= 0; i -= 1) {
      values[i] = (rows[i][n] - add(values.map((value, j) => (j > i ? rows[i][j] * value : 0)))) / rows[i][i];
    }
    return values;
  }

  /* Compliance of the springs [mm/N] where their stiffnesses are changed. */
  function springs(K) {
    return data.C.map((row, i) => row.map((entry, j) => (i === j && K ? 1 / K[data.springs[i]] : entry)));
  }

  /* Flat tips, unilateral: (C + S/E) F >= reach, F >= 0, one of them an equality; every set of tips is tried. */
  function linearForces(setting) {
    const slope = Math.tan((setting.tilt * Math.PI) / 180);
    const reach = data.x.map((x, i) => setting.travel + (x - middle) * slope + data.heights[i]);
    const A = springs(setting.K).map((row, i) => row.map((entry, j) => entry + data.S[i][j] / setting.E));
    const length = Math.max(...reach.map(Math.abs), 1e-300);
    for (let off = 0; off < 2 ** tips.length; off += 1) {
      const touching = tips.filter((tip) => !((off >> tip) & 1));
      const F = new Array(tips.length).fill(0);
      const part = solved(touching.map((i) => touching.map((j) => A[i][j])), touching.map((i) => reach[i]));
      touching.forEach((tip, k) => { F[tip] = part[k]; });
      const pressed = product(A, F);
      if (tips.every((tip) => (touching.includes(tip) ? F[tip] > 0 : pressed[tip] - reach[tip] >= -1e-12 * length))) return F;
    }
    return new Array(tips.length).fill(0);
  }

  /* Domes on a sphere or a plane: solve/contact/domes in the same words. */
  const dot = (a, b) => add(a.map((entry, k) => entry * b[k]));
  const along = (a, b, factor) => a.map((entry, k) => entry + factor * b[k]);

  function domePose(setting) {
    const { radius, built } = data.dome;
    const R = data.dome.fruit_radius === null ? Infinity : setting.radius;
    const slopes = [setting.tilt, data.roll].map((angle) => Math.tan((angle * Math.PI) / 180));
    const size = Math.hypot(...slopes, 1);
    const axis = [slopes[0] / size, slopes[1] / size, 1 / size];
    const centres = tips.map((i) => [data.x[i] + setting.place, data.y[i]]);
    const centre = [0, 1].map((k) => add(centres.map((point) => point[k])) / tips.length);
    const both = radius + R;
    const gaps = centres.map(([x, y], i) => (Number.isFinite(R) ? both - Math.sqrt(both ** 2 - x * x - y * y) : 0) - built[i]);
    const lowered = setting.travel + Math.min(...gaps);
    const between = [axis[0] / (1 + axis[2]), axis[1] / (1 + axis[2]), 1];
    const frame = [along([1, 0, 0], between, -axis[0]), along([0, 1, 0], between, -axis[1]), axis];
    const spheres = centres.map((point, i) => inFrame([centre[0], centre[1], -lowered], frame,
      [point[0] - centre[0], point[1] - centre[1], radius - data.heights[i]]));
    return { frame, spheres, R };
  }

  const inFrame = (point, frame, moved) => moved.reduce((sum, size, a) => along(sum, frame[a], size), point);

  /* How domes stand that have moved in the frame of the sensor; `direction` is the normal in that frame. */
  function approach(pose, moved) {
    return pose.spheres.map((sphere, i) => {
      const at = inFrame(sphere, pose.frame, moved[i]);
      const turned = (normal) => pose.frame.map((row) => dot(row, normal));
      if (!Number.isFinite(pose.R)) {
        return { foot: [at[0], at[1], 0], interference: data.dome.radius - at[2], direction: turned([0, 0, 1]) };
      }
      const from = [at[0], at[1], at[2] + pose.R];
      const distance = Math.hypot(...from);
      const normal = from.map((entry) => entry / distance);
      const foot = [normal[0] * pose.R, normal[1] * pose.R, normal[2] * pose.R - pose.R];
      return { foot, interference: data.dome.radius - (distance - pose.R), direction: turned(normal) };
    });
  }

  /* What large strain makes of Hertz's force at a contact radius [mm]: its factor and the slope of that over ln a. */
  function largeStrain(contact, R) {
    const { radius, strain: [c1, c2, c3, c4], deepest } = data.dome;
    const beyond = contact > deepest * radius;
    const held = beyond ? deepest * radius : contact;
    const [s, t] = [held / radius, held / R];
    const first = c1 * s + c2 * t;
    const second = c3 * s * s + c4 * s * t;
    return { factor: 1 + first + second, slope: beyond ? 0 : first + 2 * second };
  }

  function domeForces(setting) {
    const { radius, remainder, shape_change: change, fruit_radius: own, sideways } = data.dome;
    const pose = domePose(setting);
    const E = setting.E;
    const along_press = springs(setting.K);
    const C = along_press.map((row, i) => row.map((entry, j) => [0, 1, 2].map((a) => [0, 1, 2].map((b) => (
      (a === 2 && b === 2 ? entry : 0) + (sideways ? sideways[i][j][a][b] : 0))))));
    const other = own === null ? 0 : own / pose.R - 1;
    const body = remainder.map((row, i) => row.map((entry, j) => entry + other * change[i][j]));
    const relative = 1 / (1 / radius + 1 / pose.R);
    const normal = (1 - data.poisson ** 2) / Math.PI;

    /* Domes at trial depths q [mm], whose forces lean as they stood before. */
    function state(q, before) {
      const a = q.map((depth) => Math.sqrt(relative * Math.max(depth, 0)));
      const strain = a.map((one) => largeStrain(one, pose.R));
      const hertz = a.map((one) => (2 * E * one) / (1 - data.poisson ** 2));
      const stiffness = hertz.map((one, i) => one * (strain[i].factor + strain[i].slope / 3));
      const N = hertz.map((one, i) => (strain[i].factor * one * Math.max(q[i], 0)) / 1.5);
      const now = approach(pose, C.map((row) => [0, 1, 2].map((a) => add(row.map((give, j) => N[j] * dot(give[a], before[j].direction))))));
      const moved = now.map(({ foot }, i) => {
        let slope = [0, 0, 0];
        now.forEach((one, j) => {
          if (j === i) return;
          const vector = along(foot, one.foot, -1);
          slope = along(slope, vector, (normal * N[j]) / (E * Math.hypot(...vector) ** 3));
        });
        return slope.map((entry) => relative * entry);
      });
      const action = now.map((one, i) => now.map((two, j) => {
        if (i === j) return 0;
        const p = Math.hypot(...along(along(one.foot, moved[i], 1), along(two.foot, moved[j], 1), -1));
        return (normal / p) * (1 + (a[i] ** 2 / 6 + a[j] ** 2 / 10) / (p * p));
      }));
      const compliance = action.map((row, i) => row.map((entry, j) => (entry + body[i][j]) / E));
      const sunk = product(compliance, N);
      const residual = now.map((one, i) => one.interference - dot(moved[i], moved[i]) / (2 * relative) - sunk[i] - q[i]);
      return { q, N, stiffness, now, compliance, residual, worst: Math.max(...residual.map(Math.abs)) };
    }

    const unmoved = approach(pose, tips.map(() => [0, 0, 0]));
    let found = state(unmoved.map((one) => one.interference), unmoved);
    const allowed = 1e-11 * Math.max(...pose.spheres.flat().map(Math.abs));
    for (let step = 0; step < 60 && found.worst > allowed; step += 1) {
      const { q, now, stiffness, compliance, residual } = found;
      const jacobian = tips.map((i) => tips.map((j) => (i === j ? 1 : 0)
        + (dot(now[i].direction, product(C[i][j], now[j].direction)) + compliance[i][j]) * stiffness[j]));
      const deeper = solved(jacobian, residual);
      let part = 1;
      let trial = state(along(q, deeper, part), now);
      for (let halved = 0; halved < 12 && trial.worst > Math.max(found.worst, allowed); halved += 1) {
        part *= 0.5;
        trial = state(along(q, deeper, part), now);
      }
      found = trial;
    }
    return found.worst > allowed ? tips.map(() => null) : found.N.map((force, i) => found.now[i].direction[2] * force);
  }

  /* Between the moduli of the table by cubics through four neighbours, at the travels that were solved. */
  function tableForces(setting) {
    const { E, x, F } = data.table;
    const column = d3.leastIndex(x, (one, other) => Math.abs(one - setting.travel) - Math.abs(other - setting.travel));
    const right = Math.min(Math.max(d3.bisect(E, setting.E), 2), E.length - 2);
    const nodes = [right - 2, right - 1, right, right + 1];
    const weights = nodes.map((i) => nodes.reduce((w, j) => (i === j ? w : (w * (setting.E - E[j])) / (E[i] - E[j])), 1));
    return tips.map((tip) => Math.max(0, add(nodes.map((i, k) => weights[k] * F[i][tip][column]))));
  }

  const forces = { linear: linearForces, domes: domeForces, table: tableForces }[data.kind];

  function ratioOf(F) {
    return F.every((force) => force > 0) ? mean(F, data.high) / mean(F, data.low) : null;
  }

  /* The two-spring law: cad/theory/two_spring_law.py. */
  function forceRatio(K, K_m) {
    const high = data.stiffness_ratio * K_m;
    return ((K.high * high) / (K.high + high)) / ((K.low * K_m) / (K.low + K_m));
  }

  function levelNonlinearity(K) {
    const largest = data.E_max * data.K_m_over_E;
    const stiff = K.high / data.stiffness_ratio;
    const K_m = data.definition === "mid-range" ? 0.5 * largest : Math.sqrt(stiff * (stiff + largest)) - stiff;
    const rise = forceRatio(K, largest) - data.stiffness_ratio;
    return (forceRatio(K, K_m) - data.stiffness_ratio) / rise - K_m / largest;
  }

  function nonlinearityOf(P) {
    const last = P.length - 1;
    if ([P[0], P[last / 2], P[last]].includes(null)) return null;
    const departure = P.map((value, i) => (value === null ? null : (value - P[0]) / (P[last] - P[0]) - i / last));
    if (data.definition === "mid-range") return departure[last / 2];
    if (departure.includes(null)) return null;
    const top = Math.min(Math.max(d3.maxIndex(departure), 1), last - 1);
    const [before, here, after] = departure.slice(top - 1, top + 2);
    const bend = before - 2 * here + after;
    return bend < 0 ? here - (after - before) ** 2 / (8 * bend) : here;
  }

  /* P_max, NL and the worst spread of P over the travel [1] of flat tips, null where a tip is off. */
  function targets(setting, K) {
    const pressed = (E, travel) => ratioOf(forces({ ...setting, E, travel }));
    const spreads = data.E.map((E) => {
      const P = d3.range(1, data.scene.travels + 1).map((i) => pressed(E, (setting.travel * i) / data.scene.travels));
      const known = P.filter((one) => one !== null);
      return known.length > 1 ? (d3.max(known) - d3.min(known)) / d3.mean(known) : null;
    });
    const spread = spreads.includes(null) ? null : d3.max(spreads);
    if (setting.tilt === 0 && data.heights.every((height) => height === 0)) {
      return { P_max: forceRatio(K, data.E_max * data.K_m_over_E), NL: levelNonlinearity(K), spread };
    }
    const count = data.scene.moduli;
    const P = d3.range(count + 1).map((i) => pressed(data.E_max * (i === 0 ? data.scene.softest : i / count), setting.travel));
    return { P_max: P[count], NL: nonlinearityOf(P), spread };
  }

  /* The contrast of three or more tips, cad/theory/contrast_law.py: its smallest root z = E^(-1/3). */
  function byContrast(F, C) {
    const law = data.contrast;
    if (F.some((force) => !(force > 0))) return null;
    const leaning = data.lean ? C.map((row, i) => row.map((entry, j) => entry + data.lean[i][j])) : C;
    const rigid = dot(law.weights, product(leaning, F)) + dot(law.weights, law.gaps);
    const dome = law.hertz * dot(law.weights, F.map((force) => force ** (2 / 3)));
    const body = dot(law.weights, product(law.S, F));
    const contrast = (z) => rigid + z * z * (dome + body * z);
    const turn = body !== 0 ? (-2 * dome) / (3 * body) : 0;
    const beyond = 2 * Math.min(dome !== 0 ? Math.sqrt(Math.abs(rigid / dome)) : Infinity,
      body !== 0 ? Math.cbrt(Math.abs(rigid / body)) : Infinity);
    let start = 0;
    let end = turn > 0 ? turn : beyond;
    if (!Number.isFinite(end) || !(rigid * contrast(end) < 0)) return null;
    for (let step = 0; step < 200; step += 1) {
      const half = 0.5 * (start + end);
      if (half === start || half === end) break;
      if (rigid * contrast(half) > 0) start = half; else end = half;
    }
    return shapeCorrected(1 / (end * end * end));
  }

  const between = (x, y, at) => (x.length === 1 ? y[0] : d3.scaleLinear(x, y).clamp(true)(at));

  /* What the shape of the fruit adds to a level reading, between its rows in log E. */
  function shapeCorrected(read) {
    const rows = data.level;
    if (rows.length === 0) return read;
    const logs = rows.map((row) => Math.log(row.read_MPa));
    const shifts = rows.map((row) => Math.log(row.E_MPa / row.read_MPa));
    return read * Math.exp(between(logs, shifts, Math.log(read)));
  }

  function byRatio(F, K) {
    const P = ratioOf(F);
    const r = data.stiffness_ratio;
    if (P === null || P <= r || P >= K.high / K.low) return null;
    return (K.high * K.low * (r - P)) / (r * (P * K.low - K.high)) / data.K_m_over_E;
  }

  const stiffness = (C) => ({ low: 1 / C[data.low[0]][data.low[0]], high: 1 / C[data.high[0]][data.high[0]] });
  const readable = data.contrast !== null || data.kind === "linear";

  /* The modulus read [MPa] of forces [N] with springs of compliance C, null where there is none. */
  function read(F, C) {
    if (!readable) return null;
    return data.contrast !== null ? byContrast(F, C) : byRatio(F, stiffness(C));
  }

  /* Standard deviation [MPa] of a modulus read by noise in every force [% of full scale]. */
  function noiseOf(F, C, noise) {
    const moves = tips.map((tip) => {
      const step = 1e-4 * F[tip];
      const at = (side) => read(F.map((force, i) => (i === tip ? force + side * step : force)), C);
      const [above, below] = [at(1), at(-1)];
      return above === null || below === null ? NaN : (((above - below) / (2 * step)) * 0.01 * noise * data.full_scale[tip]);
    });
    const size = Math.hypot(...moves);
    return Number.isFinite(size) ? size : null;
  }

  function meanPressure(F, E) {
    const force = Math.max(...F.map((one) => one || 0));
    if (data.dome === null || force === 0) return force / data.face;
    return force / (Math.PI * contactRadius(force, E) ** 2);
  }

  function contactRadius(force, E) {
    const R = data.dome.relative_radius;
    const hertz = Math.cbrt((0.75 * (1 - data.poisson ** 2) * R * force) / E);
    let radius = hertz;
    for (let step = 0; step < 20; step += 1) {
      radius = hertz / Math.cbrt(largeStrain(radius, data.dome.fruit_radius ?? Infinity).factor);
    }
    return radius;
  }

  /* How far from the middle of its face a tip is touched at most [mm], as the verdict geometry.tip_face counts it. */
  function farthestContact(F, setting) {
    const { radius, printed, beside } = data.dome;
    const R = data.dome.fruit_radius === null ? Infinity : setting.radius;
    const relative = 1 / (1 / radius + 1 / R);
    const slope = (angle) => Math.abs(Math.tan((angle * Math.PI) / 180));
    return Math.max(...tips.map((i) => {
      const at = [data.x[i] + setting.place, data.y[i]];
      const [x, y] = at.map((place, k) => Math.abs(place / R - beside[i][k] / relative));
      const across = [x + slope(setting.tilt), y + slope(data.roll)];
      const steepest = printed ? Math.max(...across) : Math.hypot(...across);
      return steepest * relative + Math.cbrt((0.75 * (1 - data.poisson ** 2) * relative * Math.max(F[i] || 0, 0)) / setting.E);
    }));
  }

  /* What the fruit stands [MPa], between the moduli that have a limit; null without. */
  function bruiseLimit(E) {
    return data.bruise.length === 0 ? null : between(data.E, data.bruise, E);
  }

  /* Forces [N] and all that follows from them. `calibrated` false reads with the springs of the design. */
  function evaluate(setting) {
    const C = springs(setting.K);
    const F = forces(setting);
    const found = { F, P: ratioOf(F), pressure: meanPressure(F, setting.E), bruise: bruiseLimit(setting.E) };
    found.reach = data.kind === "domes" ? farthestContact(F, setting) : null;
    found.E_read = read(F, C);
    found.E_uncalibrated = read(F, data.C);
    found.noise = found.E_read === null ? null : noiseOf(F, C, setting.noise);
    return data.kind === "linear" ? { ...found, ...targets(setting, stiffness(C)) } : found;
  }

  /* What can be moved, and how far: only what the law follows. */
  const own = stiffness(data.C);
  const start = {
    E: data.E[Math.floor(data.E.length / 2)], travel: data.travel, tilt: data.tilt, place: 0,
    radius: data.dome ? data.dome.fruit_radius : null, K: own, noise: data.reading ? data.reading.noise_percent : 0.5,
  };
  const tilt = data.reading ? data.reading.tilt_deg : 3;
  const place = data.reading ? data.reading.off_centre_mm || 1 : 1;
  const spread = data.reading ? data.reading.radius_spread || 0.2 : 0.2;
  const sliders = [
    { key: "E", label: "Modulus of the fruit, E", unit: "MPa", min: d3.min(data.E), max: Math.max(data.E_max, ...data.E) },
    data.kind === "table"
      ? { key: "travel", label: "Travel, x", unit: "mm", min: data.table.x[0], max: data.travel, step: data.table.x[0] }
      : { key: "travel", label: "Travel, x", unit: "mm", min: data.travel / data.scene.travels, max: data.travel },
  ];
  if (data.kind !== "table") {
    sliders.push({ key: "tilt", label: "Tilt along the tips", unit: "degrees", min: data.tilt - tilt, max: data.tilt + tilt });
    if (data.kind === "domes") sliders.push({ key: "place", label: "Off the apex, along the tips", unit: "mm", min: -place, max: place });
    if (start.radius) {
      sliders.push({ key: "radius", label: "Radius of the fruit", unit: "mm", min: start.radius * (1 - spread), max: start.radius * (1 + spread) });
    }
    for (const kind of ["low", "high"]) {
      sliders.push({ key: `K-${kind}`, label: `Stiffness of the ${kind} spring, K`, unit: "N/m", min: 500 * own[kind], max: 2000 * own[kind] });
    }
  }
  if (readable) sliders.push({ key: "noise", label: "Noise of each force", unit: "% of full scale", min: 0, max: 4 * start.noise || 2 });

  return { data, start, sliders, evaluate, forces, contactRadius, bruiseLimit, meanPressure, ratioOf, readable };
}
