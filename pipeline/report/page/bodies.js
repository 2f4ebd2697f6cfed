"use strict";
/* Shows bodies as GLB, one at a time: in <model-viewer>, turned by mouse, finger or arrow keys; without WebGL as a still. */
const APART = 0.3; // part of their way from which names of bodies do not hide each other
const FIRST_SHOWN = 0.7; // part of their way at first, so that the springs are seen and named
const [LABEL_WIDE, LABEL_HIGH] = [0.17, 0.06]; // room of a label, as a fraction of the width of the picture of all bodies

async function showBodies(bodies, place) {
  if (bodies.length === 0) return;
  const canTurn = document.createElement("canvas").getContext("webgl2") !== null;
  const help = canTurn ? "Drag or use the arrow keys to turn, wheel to zoom, two fingers or the right button to move."
    : "From one side alone: WebGL is off or missing in this browser. The files of the part open in any CAD program or slicer.";
  const moved = (at, by, part) => at.map((entry, i) => entry + part * by[i]);

  /* Of each kind of an assembly one body, where it ends upwards or downwards, the last word of its name without its
     number, and by how much the animation moves it. Of the bodies whose labels cover no other one, the nearest to who
     looks is named; a kind of few bodies has less choice, so it comes first. */
  function partLabels(glb) {
    const { meshes, accessors } = treeOf(glb);
    const middle = ({ min, max }) => min.map((one, i) => 0.5 * (one + max[i]));
    const boxes = meshes.map(({ primitives: [part] }) => accessors[part.attributes.POSITION]);
    const waist = d3.mean(boxes, (box) => middle(box)[1]);
    const labels = meshes.map(({ name, primitives: [part] }, i) => ({ text: name.replace(/_\d+$/, "").split("_").at(-1),
      at: middle(boxes[i]).with(1, (middle(boxes[i])[1] < waist ? boxes[i].min : boxes[i].max)[1]), by: middle(accessors[part.targets[0].POSITION]) }));
    const { right, up } = firstView();
    const seen = ({ at, by }) => [right, up].map((axis) => along(axis, moved(at, by, FIRST_SHOWN)));
    const [low, high] = d3.extent(labels, (label) => seen(label)[0]);
    const covers = (one, other) => [LABEL_WIDE, LABEL_HIGH].every((room, k) => Math.abs(seen(one)[k] - seen(other)[k]) < room * (high - low));
    const named = [];
    const isClear = (label) => !named.some((other) => covers(label, other));
    const nearness = ({ at, by }) => at[0] + by[0] + 2 * (at[2] + by[2]);
    for (const kind of d3.sort(d3.group(labels, (label) => label.text).values(), (bodies) => bodies.length)) {
      named.push(d3.greatest(kind, (one, other) => d3.ascending(isClear(one), isClear(other)) || d3.ascending(nearness(one), nearness(other))));
    }
    return named;
  }

  const files = await Promise.all(bodies.map((body) => unpacked(body.glb, "model/gltf-binary")));
  const glbs = await Promise.all(files.map((file) => file.arrayBuffer()));
  const addresses = files.map((file) => URL.createObjectURL(file));
  const choice = made("select", {}, ...bodies.map(({ name }, index) => made("option", { value: index, textContent: name })));
  const shown = made("div");
  const printed = made("div", { className: "printed" });
  const caption = made("p", { className: "caption", ariaLive: "polite" });
  place.append(made("label", { className: "choice" }, "Shown ", choice), shown, printed, caption);

  function colourBar({ label, low, high, limit, palette }) {
    const domain = palette.map((_, i) => low + ((high - low) * i) / (palette.length - 1));
    const words = limit === null ? label : `${label}, limit ${digits(limit, 3)}`;
    const bar = Plot.legend({ color: { type: "linear", label: words, domain, range: palette, interpolate: d3.interpolateRgb }, ticks: 5, width: 320, style: { background: "none" } });
    asImage(bar, `Colours from ${digits(low, 3)} to ${digits(high, 3)}: ${words}`);
    return bar;
  }

  const labelsOf = () => (bodies[choice.value].labels || partLabels(glbs[choice.value]))
    .map(({ text: words, at, by, side }) => ({ label: made("span", { className: "label", textContent: words }), at, by, side }));
  const isHidden = (part) => bodies[choice.value].slider === "apart" && part < APART;
  /* A label with a side hangs beside its point: on the left for -1, on the right for 1, the other way round from behind. */
  const hang = (labels, facing) => labels.filter(({ side }) => side)
    .forEach(({ label, side }) => { label.dataset.side = side * facing < 0 ? "left" : "right"; });

  /* Both views return the element, and a function that moves bodies and labels by a part of their way. */
  function turned(body, alt) {
    const labels = labelsOf();
    const viewer = made("model-viewer");
    const attributes = { src: addresses[choice.value], alt, "camera-controls": "", "interaction-prompt": "none", "shadow-intensity": "0.6", "environment-image": "neutral",
      "animation-name": "motion", "touch-action": "pan-y", exposure: "1.1", "camera-orbit": `25deg 65deg ${body.slider === "apart" ? "130%" : "105%"}` };
    for (const [name, value] of Object.entries(attributes)) viewer.setAttribute(name, value);
    const inMetres = (point) => point.map((entry) => `${entry}m`).join(" ");
    labels.forEach(({ label, at }, i) => {
      label.slot = `hotspot-${i}`;
      label.dataset.position = inMetres(at);
      viewer.append(label);
    });
    hang(labels, 1);
    viewer.addEventListener("camera-change", () => hang(labels, Math.cos(viewer.getCameraOrbit().theta)));
    function move(part) {
      viewer.currentTime = 0.999 * part;
      for (const { label, at, by } of labels) {
        label.hidden = isHidden(part);
        viewer.updateHotspot({ name: label.slot, position: inMetres(moved(at, by, part)) });
      }
    }
    return { view: viewer, move };
  }

  function still(alt) {
    const labels = labelsOf();
    const { canvas, draw, placeOf } = stillOf(glbs[choice.value], alt);
    const view = made("div", { className: "still" }, canvas, ...labels.map(({ label }) => label));
    hang(labels, 1);
    function move(part) {
      draw(part);
      for (const { label, at, by } of labels) {
        label.hidden = isHidden(part);
        [label.style.left, label.style.top] = placeOf(moved(at, by, part)).map((place) => `${place}%`);
      }
    }
    return { view, move };
  }

  let print = () => {};
  window.addEventListener("beforeprint", () => print());

  function show() {
    const body = bodies[choice.value];
    const alt = `${body.name}. ${body.caption || ""}`;
    const { view, move } = canTurn ? turned(body, alt) : still(alt);
    const name = body.slider === "press" ? "Press" : "Apart";
    const slider = made("input", { type: "range", min: 0, max: 1, step: "any", value: body.slider === "press" ? 1 : FIRST_SHOWN, ariaLabel: name });
    const showPart = () => {
      move(Number(slider.value));
      slider.ariaValueText = `${Math.round(100 * slider.value)} %`;
    };
    slider.addEventListener("input", showPart);
    shown.replaceChildren(view, made("label", { className: "motion" }, `${name} `, slider), ...(body.legend ? [colourBar(body.legend)] : []));
    caption.replaceChildren(body.caption || "", made("span", { className: "help", textContent: ` ${help}` }));
    if (!canTurn) {
      showPart();
      return;
    }
    view.addEventListener("load", () => { view.play(); view.pause(); showPart(); });
    print = () => { // the viewer draws only what is in the window
      const copy = still(alt);
      copy.move(Number(slider.value));
      printed.replaceChildren(copy.view);
    };
  }

  choice.addEventListener("change", show);
  show();
}
